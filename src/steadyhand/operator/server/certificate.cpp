#include "steadyhand/operator/server/certificate.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <memory>
#include <system_error>

namespace steadyhand {
namespace {

namespace fs = std::filesystem;

template <auto Free>
struct Deleter {
  template <typename T>
  void operator()(T* p) const {
    Free(p);
  }
};
using X509Pointer = std::unique_ptr<X509, Deleter<X509_free>>;
using KeyPointer = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY_free>>;
using BioPointer = std::unique_ptr<BIO, Deleter<BIO_free_all>>;
using ExtensionPointer = std::unique_ptr<X509_EXTENSION, Deleter<X509_EXTENSION_free>>;

constexpr long kDay = 24 * 3600;
// Browsers refuse certificates of more than 825 days, Apple's even installed ones.
constexpr long kLifetime = 800 * kDay;

bool is_address(const std::string& name) {
  unsigned char bytes[16];
  return inet_pton(AF_INET, name.c_str(), bytes) == 1 || inet_pton(AF_INET6, name.c_str(), bytes) == 1;
}

std::string text_of(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

std::string fingerprint_of(X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  X509_digest(certificate, EVP_sha256(), digest.data(), &size);
  std::string text;
  for (unsigned i = 0; i < size; ++i) text += fmt::format("{}{:02X}", i > 0 ? ":" : "", digest[i]);
  return text;
}

bool add_extension(X509* certificate, int nid, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const ExtensionPointer extension(X509V3_EXT_conf_nid(nullptr, &context, nid, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

Certificate to_pem(X509* certificate, EVP_PKEY* key) {
  const BioPointer certificate_pem(BIO_new(BIO_s_mem())), key_pem(BIO_new(BIO_s_mem()));
  PEM_write_bio_X509(certificate_pem.get(), certificate);
  PEM_write_bio_PrivateKey(key_pem.get(), key, nullptr, nullptr, 0, nullptr, nullptr);
  return {text_of(certificate_pem.get()), text_of(key_pem.get()), fingerprint_of(certificate)};
}

Result<Certificate> make_certificate(const std::vector<std::string>& names) {
  const KeyPointer key(EVP_EC_gen("P-256"));
  const X509Pointer certificate(X509_new());
  std::array<unsigned char, 16> serial{};
  if (!key || !certificate || RAND_bytes(serial.data(), static_cast<int>(serial.size())) != 1) {
    return Error{"OpenSSL could not make a key for HTTPS"};
  }
  serial[0] &= 0x7f;  // positive
  const std::unique_ptr<BIGNUM, Deleter<BN_free>> number(BN_bin2bn(serial.data(), serial.size(), nullptr));
  X509* x = certificate.get();
  bool good = X509_set_version(x, 2) == 1 && number && BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(x));
  X509_gmtime_adj(X509_getm_notBefore(x), -kDay);  // a headset's clock may be late
  X509_gmtime_adj(X509_getm_notAfter(x), kLifetime);
  X509_NAME* subject = X509_get_subject_name(x);
  const auto* common_name = reinterpret_cast<const unsigned char*>("steadyhand on this host");
  good = good && X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, common_name, -1, -1, 0) == 1;
  good = good && X509_set_issuer_name(x, subject) == 1 && X509_set_pubkey(x, key.get()) == 1;
  std::string alternatives;
  for (const std::string& name : names) {
    alternatives += fmt::format("{}{}:{}", alternatives.empty() ? "" : ",", is_address(name) ? "IP" : "DNS", name);
  }
  good = good && add_extension(x, NID_subject_alt_name, alternatives);
  good = good && add_extension(x, NID_basic_constraints, "critical,CA:FALSE");
  good = good && add_extension(x, NID_key_usage, "critical,digitalSignature");
  good = good && add_extension(x, NID_ext_key_usage, "serverAuth");
  if (!good || X509_sign(x, key.get(), EVP_sha256()) == 0)
    return Error{"OpenSSL could not make a certificate for HTTPS"};
  return to_pem(x, key.get());
}

/// Readable by its owner only, and never incomplete: written next to it, then renamed.
Status write_private(const fs::path& path, const std::string& text) {
  const auto failed = [&](const char* what) {
    return Error{fmt::format("{}: {}: {}", path.string(), what, std::strerror(errno))};
  };
  const std::string draft = path.string() + ".new";
  unlink(draft.c_str());
  const int file = open(draft.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (file < 0) return failed("cannot be made");
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(file) == 0;
  const bool closed = close(file) == 0;
  if (!written || !closed) return failed("cannot be written");
  if (rename(draft.c_str(), path.c_str()) != 0) return failed("cannot be put in place");
  return Done{};
}

bool covers(X509* certificate, const std::string& name) {
  return is_address(name) ? X509_check_ip_asc(certificate, name.c_str(), 0) == 1
                          : X509_check_host(certificate, name.c_str(), name.size(), 0, nullptr) == 1;
}

/// nullptr key: no such file.
Result<std::pair<X509Pointer, KeyPointer>> read(const fs::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    if (errno == ENOENT) return std::pair<X509Pointer, KeyPointer>();
    return Error{fmt::format("{}: {}", path.string(), std::strerror(errno))};
  }
  struct stat about {};
  const bool is_private = fstat(file, &about) == 0 && (about.st_mode & 077) == 0;
  std::array<char, 16384> bytes;
  const ssize_t size = ::read(file, bytes.data(), bytes.size());
  close(file);
  if (!is_private) {
    return Error{fmt::format("{}: others may read this key (mode {:04o}); delete it, a new one is made", path.string(),
                             about.st_mode & 07777)};
  }
  const BioPointer bio(BIO_new_mem_buf(bytes.data(), size > 0 ? static_cast<int>(size) : 0));
  X509Pointer certificate(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
  KeyPointer key(PEM_read_bio_PrivateKey(bio.get(), nullptr, nullptr, nullptr));
  if (!certificate || !key || X509_check_private_key(certificate.get(), key.get()) != 1) {
    return Error{path.string() + ": is no certificate followed by its key; delete it, a new one is made"};
  }
  return std::pair(std::move(certificate), std::move(key));
}

}  // namespace

Result<fs::path> state_folder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state && fs::path(state).is_absolute()) return fs::path(state) / "steadyhand";
  const char* home = std::getenv("HOME");
  if (home && *home) return fs::path(home) / ".local" / "state" / "steadyhand";
  return Error{"neither XDG_STATE_HOME nor HOME says where the certificate for HTTPS may be kept"};
}

Result<Certificate> load_or_make_certificate(const fs::path& folder, const std::vector<std::string>& names) {
  const fs::path path = folder / "server.pem";
  auto found = read(path);
  if (!found) return found.error();
  X509* old = found->first.get();
  if (old) {
    time_t tomorrow = time(nullptr) + kDay;
    bool good = X509_cmp_time(X509_get0_notAfter(old), &tomorrow) > 0;
    for (const std::string& name : names) good = good && covers(old, name);
    if (good) return to_pem(old, found->second.get());
  }
  auto made = make_certificate(names);
  if (!made) return made;
  std::error_code error;
  const bool is_new = fs::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: cannot be made: {}", folder.string(), error.message())};
  if (is_new) fs::permissions(folder, fs::perms::owner_all, error);
  if (Status status = write_private(path, made->certificate_pem + made->key_pem); !status) return status.error();
  return made;
}

std::vector<std::string> lan_addresses() {
  std::vector<std::string> addresses;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return addresses;
  for (const ifaddrs* one = all; one; one = one->ifa_next) {
    if (!one->ifa_addr || !(one->ifa_flags & IFF_UP) || (one->ifa_flags & IFF_LOOPBACK)) continue;
    char text[INET6_ADDRSTRLEN] = {};
    if (one->ifa_addr->sa_family == AF_INET) {
      inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text, sizeof text);
      addresses.emplace_back(text);
    }
  }
  freeifaddrs(all);
  return addresses;
}

std::vector<std::string> host_names() {
  char name[256] = {};
  if (gethostname(name, sizeof name - 1) != 0 || !*name) return {};
  return {name, std::string(name) + ".local"};
}

}  // namespace steadyhand

#include "serve/access.hpp"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>
#include <cctype>

namespace steadyhand {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// "name:port" without its port.
std::string_view without_port(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  if (colon == std::string_view::npos || host.find(']', colon) != std::string_view::npos) return host;
  return host.substr(0, colon);
}

}  // namespace

std::string random_text(int length) {
  constexpr std::string_view kAlphabet = "23456789abcdefghjkmnpqrstuvwxyz_";
  static_assert(kAlphabet.size() == 32);
  std::string text(static_cast<std::size_t>(length), '\0');
  if (RAND_bytes(reinterpret_cast<unsigned char*>(text.data()), length) != 1) return {};
  for (char& c : text) c = kAlphabet[static_cast<unsigned char>(c) % 32];
  return text;
}

bool equal_secret(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

bool host_allowed(std::string_view host, const std::vector<std::string>& names) {
  const std::string name = lower(without_port(host));
  return std::any_of(names.begin(), names.end(), [&](const std::string& allowed) { return lower(allowed) == name; });
}

bool origin_allowed(std::string_view origin, std::string_view host, bool tls) {
  return lower(origin) == (tls ? "https://" : "http://") + lower(host);
}

Status Pairing::renew() {
  code_ = random_text(kCodeLength);
  if (code_.empty()) return Error{"the system gives no random numbers for a pairing code"};
  return Done{};
}

std::string Pairing::redeem(std::string_view code, Time now) {
  if (now - failures_since_ >= kFailureWindow) {
    failures_ = 0;
    failures_since_ = now;
  }
  if (failures_ >= kMaxFailures) return {};
  if (code_.empty() || !equal_secret(code, code_)) {
    ++failures_;
    return {};
  }
  std::string token = random_text(kTokenLength);
  code_.clear();
  if (token.empty() || !renew()) return {};
  if (tokens_.size() >= kMaxTokens) tokens_.erase(tokens_.begin());
  tokens_.push_back(token);
  return token;
}

bool Pairing::known(std::string_view token) const {
  return std::any_of(tokens_.begin(), tokens_.end(),
                     [&](const std::string& given) { return equal_secret(token, given); });
}

}  // namespace steadyhand

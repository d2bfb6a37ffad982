#include "steadyhand/operator/protocol/access.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <utility>

namespace steadyhand {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

bool is_port(std::string_view text) {
  unsigned port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port > 0 && port <= 65535;
}

}  // namespace

std::string random_text(int length) {
  constexpr std::string_view kAlphabet = "bcdfghjkmnpqrstvwxyz";
  constexpr int kFair = 256 / kAlphabet.size() * kAlphabet.size();  // bytes above would favour the first letters
  std::string text;
  while (static_cast<int>(text.size()) < length) {
    unsigned char byte = 0;
    if (getentropy(&byte, 1) != 0) return {};
    if (byte < kFair) text += kAlphabet[byte % kAlphabet.size()];
  }
  return text;
}

bool equal_secret(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  volatile unsigned char difference = 0;  // volatile: no compiler leaves the loop early
  for (std::size_t i = 0; i < a.size(); ++i) difference = difference | static_cast<unsigned char>(a[i] ^ b[i]);
  return difference == 0;
}

bool host_allowed(std::string_view host, const std::vector<std::string>& names) {
  const std::size_t colon = std::min(host.find(':'), host.size());
  if (colon < host.size() && !is_port(host.substr(colon + 1))) return false;
  const std::string name = lower(host.substr(0, colon));
  return std::any_of(names.begin(), names.end(), [&](const std::string& allowed) { return lower(allowed) == name; });
}

bool origin_allowed(std::string_view origin, std::string_view host, bool tls) {
  return lower(origin) == (tls ? "https://" : "http://") + lower(host);
}

std::string_view cookie_of(std::string_view header, std::string_view name) {
  while (!header.empty()) {
    std::string_view one = header.substr(0, header.find(';'));
    header.remove_prefix(std::min(one.size() + 1, header.size()));
    one.remove_prefix(std::min(one.find_first_not_of(' '), one.size()));
    if (one.substr(0, one.find('=')) == name) return one.substr(std::min(name.size() + 1, one.size()));
  }
  return {};
}

Status Pairing::renew() {
  last_code_ = std::exchange(code_, random_text(kCodeLength));
  if (code_.empty()) return Error{"the system gives no random numbers for a pairing code"};
  return Done{};
}

Result<std::string> Pairing::redeem(std::string_view typed) {
  std::string code = lower(typed);
  code.erase(std::remove_if(code.begin(), code.end(), [](char c) { return c == ' ' || c == '-'; }), code.end());
  if (code.size() != kCodeLength) {
    return Error{fmt::format("a code has {} letters, this one {}; the terminal shows it", kCodeLength, code.size())};
  }
  if (code_.empty()) return Error{"the system gives no random numbers for a pairing code"};
  if (!equal_secret(code, code_)) {
    if (equal_secret(code, last_code_)) return Error{"this code is used up; the terminal shows the next one"};
    return Error{"this code is wrong; compare it with the one that the terminal showed last"};
  }
  return add_token(code_);
}

Result<std::string> Pairing::admit() { return add_token({}); }

Result<std::string> Pairing::add_token(const std::string& code) {
  std::string token = random_text(kTokenLength), reading_key = random_text(kTokenLength);
  if (token.empty() || reading_key.empty()) return Error{"the system gives no random numbers for a token"};
  if (tokens_.size() >= kMaxTokens) tokens_.erase(tokens_.begin());
  tokens_.push_back({token, code, std::move(reading_key)});
  return token;
}

bool Pairing::known(std::string_view token) const {
  return std::any_of(tokens_.begin(), tokens_.end(),
                     [&](const Token& given) { return equal_secret(token, given.text); });
}

std::string Pairing::token_of(std::string_view secret) const {
  for (const Token& given : tokens_) {
    if (equal_secret(secret, given.text) || equal_secret(secret, given.reading_key)) return given.text;
  }
  return {};
}

std::string Pairing::reading_key(std::string_view token) const {
  for (const Token& given : tokens_) {
    if (equal_secret(token, given.text)) return given.reading_key;
  }
  return {};
}

bool Pairing::use_up(std::string_view token) {
  const auto earned = [&](const Token& given) {
    return given.text == token && !given.code.empty() && given.code == code_;
  };
  return std::any_of(tokens_.begin(), tokens_.end(), earned) && renew();
}

}  // namespace steadyhand

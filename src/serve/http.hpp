#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"

/// As much of HTTP/1.1 as a server of files needs: the heads of requests without a body, the heads of answers.
namespace steadyhand {

constexpr std::size_t kMaxRequestHead = 8 * 1024;  // bytes

enum class HttpStatus : int {
  kSwitchingProtocols = 101,
  kOk = 200,
  kBadRequest = 400,
  kForbidden = 403,
  kNotFound = 404,
  kMethodNotAllowed = 405,
  kMisdirected = 421,
  kUpgradeRequired = 426,
  kUnavailable = 503,
};

struct HttpRequest {
  std::string method, target;
  bool keep_alive = false;
  std::vector<std::pair<std::string, std::string>> fields;  ///< names in lower case

  /// nullptr: not sent. @param name in lower case
  const std::string* find(std::string_view name) const;
  /// Whether the field is a list that holds this word, in whatever case.
  bool lists(std::string_view name, std::string_view word) const;
  std::string_view host() const { return find("host") ? std::string_view(*find("host")) : ""; }
  bool wants_websocket() const { return lists("connection", "upgrade") && lists("upgrade", "websocket"); }
};

/// @param head any bytes, up to and with the empty line. Errors: it is no request that may be answered; bodies and what
/// two readers could understand differently are refused.
Result<HttpRequest> parse_request(std::string_view head);

/// "HTTP/1.1 200 OK" and its fields, up to and with the empty line. No name or value may hold a line's end.
std::string answer_head(HttpStatus status, const std::vector<std::pair<std::string_view, std::string>>& fields);

}  // namespace steadyhand

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/time.hpp"

/// Who may connect and who may command.
namespace steadyhand {

/// `length` characters of an alphabet of 32 without look-alikes, from the system's random source: 5 bits each. Empty if
/// the source fails.
std::string random_text(int length);

/// In a time that does not depend on where they differ.
bool equal_secret(std::string_view a, std::string_view b);

/// Whether a request for `host` (the Host header, "name" or "name:port") is meant for one of `names`. A page of
/// somebody else's whose name was made to point here (DNS rebinding) carries that name. Case does not count; "[::1]" is
/// an IPv6 name.
bool host_allowed(std::string_view host, const std::vector<std::string>& names);

/// Whether a WebSocket's Origin header is that of a page that this server gave out under this Host header.
bool origin_allowed(std::string_view origin, std::string_view host, bool tls);

/// The one-time code with which a client earns the right to command, and the tokens of those that did. A token outlives
/// its connection, so that a client that comes back need not pair again. One thread.
class Pairing {
 public:
  static constexpr int kCodeLength = 10;  // 50 bits
  static constexpr int kTokenLength = 26;
  static constexpr int kMaxTokens = 64;    ///< the oldest is forgotten
  static constexpr int kMaxFailures = 10;  ///< wrong codes, of all clients together, within
  static constexpr Time kFailureWindow = std::chrono::seconds(10);

  /// Error: no random numbers to be had.
  Status renew();
  const std::string& code() const { return code_; }

  /// A token if the code is the one that is valid; it is used up then and a new one made. Empty: wrong, or too many
  /// wrong ones lately, in which case even the right one is refused.
  std::string redeem(std::string_view code, Time now);
  bool known(std::string_view token) const;

 private:
  std::string code_;
  std::vector<std::string> tokens_;
  int failures_ = 0;
  Time failures_since_{0};
};

}  // namespace steadyhand

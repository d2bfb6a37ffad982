#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"

/// Access: which clients may connect, and which may command.
namespace steadyhand {

/// `length` consonants from the system's random source, 4.3 bits each: a headset's keyboard has them in one layout, and
/// they make no words. Empty if the source fails.
std::string random_text(int length);

/// Takes a time that does not depend on where they differ.
bool equal_secret(std::string_view a, std::string_view b);

/// Whether a request for `host` (the Host header, "name" or "name:port") is meant for one of `names`. A foreign page
/// whose name was made to point here (DNS rebinding) carries that foreign name. Case does not count. The port may be
/// any number: forwarding changes it.
bool host_allowed(std::string_view host, const std::vector<std::string>& names);

/// Whether a WebSocket's Origin header is that of a page that this server gave out under this Host header.
bool origin_allowed(std::string_view origin, std::string_view host, bool tls);

/// The value of a cookie in a Cookie header; empty: it has none of this name.
std::string_view cookie_of(std::string_view header, std::string_view name);

/// In a code's place: the client is a program of the same user on this machine. No code holds a vowel.
constexpr std::string_view kLocalCode = "local";

/// The code with which clients earn the right to command, and the tokens of those that did. A token outlives its
/// connection, so that a client that comes back need not pair again. One thread.
class Pairing {
 public:
  static constexpr int kCodeLength = 12;  // 51 bits
  static constexpr int kTokenLength = 26;
  static constexpr int kMaxTokens = 64;  ///< the oldest is forgotten

  /// Error: no random numbers to be had.
  Status renew();
  const std::string& code() const { return code_; }

  /// A token if this is the valid code, in any case and grouping. Error: it is not; the message is for users.
  Result<std::string> redeem(std::string_view typed);
  /// A token without a code, which uses up none. Error: no random numbers to be had.
  Result<std::string> admit();
  bool known(std::string_view token) const;
  /// The token that this is, or whose reading key it is; empty: neither is known.
  std::string token_of(std::string_view secret) const;
  /// A second secret of a known token, which permits reading recordings and nothing else. A browser keeps it as a
  /// cookie, which it also sends to other ports of the host.
  std::string reading_key(std::string_view token) const;
  /// A client with this token commands. True: that used up the code that is valid, and there is a new one.
  bool use_up(std::string_view token);

 private:
  struct Token {
    std::string text;
    std::string code;  ///< code that earned it; empty: without
    std::string reading_key;
  };
  Result<std::string> add_token(const std::string& code);

  std::string code_, last_code_;
  std::vector<Token> tokens_;
};

}  // namespace steadyhand

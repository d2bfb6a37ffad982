#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

using Json = nlohmann::json;

struct Page {
  unsigned status = 0;
  std::string body, policy, type, cookie;
};

/// One request over a separate connection. Throws if there is no answer.
Page fetch(std::uint16_t port, const std::string& path, const std::string& host = "localhost",
           const std::string& method = "GET");
/// With a token, or (by its name) another header.
Page fetch_with(std::uint16_t port, const std::string& path, const std::string& value,
                const std::string& header = "Authorization");

/// A blocking client over a real socket: Boost.Beast as a client, and bytes as they are.
class SocketClient {
 public:
  /// @param receive_buffer bytes that the kernel keeps for it; 0: as it likes
  explicit SocketClient(std::uint16_t port, int receive_buffer = 0);
  ~SocketClient();

  /// Only as far as TCP goes; false: no listener.
  bool reach();
  /// The HTTP status: 101 if it became a WebSocket. 0: no answer.
  unsigned connect(const std::string& origin = "", std::string host = "", const std::string& path = "/live");
  void say(const Json& message) { say_text(message.dump()); }
  bool say_text(const std::string& text);
  /// These bytes as they are. False: the connection has ended.
  bool say_bytes(std::string_view bytes);
  /// The next bytes, without WebSocket; empty at the end of the connection.
  std::string hear_raw(std::size_t most);
  /// null at the end of the connection.
  Json hear();
  /// The next message of this type; null at the end of the connection.
  Json hear(const std::string& type);
  /// The next message that is no text; empty at the end of the connection.
  std::string hear_bytes();
  /// Whether the connection ends within this time; data until then is dropped. Nothing can be heard afterwards.
  bool ends_within(Time span);
  /// The code that the server's farewell had; 0: it said none.
  unsigned farewell() const;
  /// Whether the server answers a farewell with its own.
  bool part();
  /// The data of the newest pong that was read.
  const std::string& pong() const;
  void greet() { say({{"type", "hello"}, {"version", 3}}); }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace steadyhand

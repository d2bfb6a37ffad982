#pragma once

#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace steadyhand {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Json = nlohmann::json;
using boost::system::error_code;

struct Page {
  unsigned status = 0;
  std::string body, policy, type;
};

/// One request over a connection of its own.
inline Page ask(std::uint16_t port, const http::request<http::empty_body>& request) {
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket socket(io);
  socket.connect({boost::asio::ip::address_v4::loopback(), port});
  http::write(socket, request);
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.skip(request.method() == http::verb::head);
  error_code error;
  http::read(socket, buffer, parser, error);
  const auto& response = parser.get();
  return {response.result_int(), response.body(), std::string(response["Content-Security-Policy"]),
          std::string(response[http::field::content_type])};
}

inline Page fetch(std::uint16_t port, const std::string& path, const std::string& host = "localhost",
                  http::verb verb = http::verb::get) {
  http::request<http::empty_body> request(verb, path, 11);
  request.set(http::field::host, host);
  return ask(port, request);
}

/// A blocking client over a real socket.
class SocketClient {
 public:
  explicit SocketClient(std::uint16_t port) : port_(port) {}

  /// The HTTP status: 101 if it became a WebSocket.
  unsigned connect(const std::string& origin = "", std::string host = "", const std::string& path = "/live") {
    error_code error;
    socket_.next_layer().connect({boost::asio::ip::address_v4::loopback(), port_}, error);
    if (error) return 0;
    if (host.empty()) host = "127.0.0.1:" + std::to_string(port_);
    socket_.set_option(websocket::stream_base::decorator([origin](websocket::request_type& request) {
      if (!origin.empty()) request.set(http::field::origin, origin);
    }));
    socket_.handshake(host, path, error);
    if (!error) return 101;
    // Beast does not say with which status; the same request once more does.
    http::request<http::empty_body> request(http::verb::get, path, 11);
    request.set(http::field::host, host);
    request.set(http::field::connection, "Upgrade");
    request.set(http::field::upgrade, "websocket");
    request.set(http::field::sec_websocket_key, "c3RlYWR5aGFuZCB0ZXN0cw==");
    request.set(http::field::sec_websocket_version, "13");
    if (!origin.empty()) request.set(http::field::origin, origin);
    return ask(port_, request).status;
  }
  void say(const Json& message) { say_text(message.dump()); }
  bool say_text(const std::string& text) {
    error_code error;
    socket_.write(boost::asio::buffer(text), error);
    return !error;
  }
  /// null at the end of the connection.
  Json hear() {
    beast::flat_buffer buffer;
    error_code error;
    socket_.read(buffer, error);
    return error ? Json() : Json::parse(beast::buffers_to_string(buffer.data()));
  }
  /// The next message of this type; null at the end of the connection.
  Json hear(const std::string& type) {
    for (;;) {
      Json message = hear();
      if (message.is_null() || message["type"] == type) return message;
    }
  }
  void greet() { say({{"type", "hello"}, {"version", 1}}); }
  auto& socket() { return socket_; }

 private:
  std::uint16_t port_;
  boost::asio::io_context io_;
  websocket::stream<boost::asio::ip::tcp::socket> socket_{io_};
};

}  // namespace steadyhand

#include "socket_client.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

namespace steadyhand {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

tcp::endpoint endpoint_of(std::uint16_t port) { return {asio::ip::address_v4::loopback(), port}; }

Page ask(std::uint16_t port, const http::request<http::empty_body>& request) {
  asio::io_context io;
  tcp::socket socket(io);
  socket.connect(endpoint_of(port));
  http::write(socket, request);
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.skip(request.method() == http::verb::head);
  http::read(socket, buffer, parser);
  const auto& response = parser.get();
  return {response.result_int(), response.body(), std::string(response["Content-Security-Policy"]),
          std::string(response[http::field::content_type]), std::string(response[http::field::set_cookie])};
}

}  // namespace

Page fetch(std::uint16_t port, const std::string& path, const std::string& host, const std::string& method) {
  http::request<http::empty_body> request(http::string_to_verb(method), path, 11);
  request.set(http::field::host, host);
  return ask(port, request);
}

Page fetch_with(std::uint16_t port, const std::string& path, const std::string& value, const std::string& header) {
  http::request<http::empty_body> request(http::verb::get, path, 11);
  request.set(http::field::host, "localhost:" + std::to_string(port));
  request.set(header, header == "Authorization" ? "Bearer " + value : value);
  return ask(port, request);
}

struct SocketClient::Impl {
  std::uint16_t port = 0;
  int receive_buffer = 0;
  asio::io_context io{};
  websocket::stream<tcp::socket> socket{io};
  std::string pong{};
};

SocketClient::SocketClient(std::uint16_t port, int receive_buffer) : impl_(std::make_unique<Impl>()) {
  impl_->port = port;
  impl_->receive_buffer = receive_buffer;
  impl_->socket.control_callback([pong = &impl_->pong](websocket::frame_type kind, beast::string_view payload) {
    if (kind == websocket::frame_type::pong) *pong = std::string(payload);
  });
}
SocketClient::~SocketClient() = default;

bool SocketClient::reach() {
  tcp::socket& socket = impl_->socket.next_layer();
  socket.open(tcp::v4());
  if (impl_->receive_buffer > 0) socket.set_option(asio::socket_base::receive_buffer_size(impl_->receive_buffer));
  error_code error;
  socket.connect(endpoint_of(impl_->port), error);
  return !error;
}

unsigned SocketClient::connect(const std::string& origin, std::string host, const std::string& path) {
  if (!reach()) return 0;
  auto& socket = impl_->socket;
  if (host.empty()) host = "127.0.0.1:" + std::to_string(impl_->port);
  socket.set_option(websocket::stream_base::decorator([origin](websocket::request_type& request) {
    if (!origin.empty()) request.set(http::field::origin, origin);
  }));
  error_code error;
  socket.handshake(host, path, error);
  if (!error) return 101;
  // Beast does not say with which status; the same request once more does.
  http::request<http::empty_body> request(http::verb::get, path, 11);
  request.set(http::field::host, host);
  request.set(http::field::connection, "Upgrade");
  request.set(http::field::upgrade, "websocket");
  request.set(http::field::sec_websocket_key, "c3RlYWR5aGFuZCB0ZXN0cw==");
  request.set(http::field::sec_websocket_version, "13");
  if (!origin.empty()) request.set(http::field::origin, origin);
  return ask(impl_->port, request).status;
}

bool SocketClient::say_text(const std::string& text) {
  error_code error;
  impl_->socket.write(asio::buffer(text), error);
  return !error;
}

bool SocketClient::say_bytes(std::string_view bytes) {
  error_code error;
  asio::write(impl_->socket.next_layer(), asio::buffer(bytes), error);
  return !error;
}

std::string SocketClient::hear_raw(std::size_t most) {
  std::string bytes(most, '\0');
  error_code error;
  bytes.resize(impl_->socket.next_layer().read_some(asio::buffer(bytes), error));
  return bytes;
}

Json SocketClient::hear() {
  beast::flat_buffer buffer;
  error_code error;
  impl_->socket.read(buffer, error);
  return error ? Json() : Json::parse(beast::buffers_to_string(buffer.data()));
}

Json SocketClient::hear(const std::string& type) {
  for (;;) {
    Json message = hear();
    if (message.is_null() || message["type"] == type) return message;
  }
}

std::string SocketClient::hear_bytes() {
  for (;;) {
    beast::flat_buffer buffer;
    error_code error;
    impl_->socket.read(buffer, error);
    if (error) return {};
    if (impl_->socket.got_binary()) return beast::buffers_to_string(buffer.data());
  }
}

bool SocketClient::part() {
  error_code error;
  impl_->socket.close(websocket::close_code::normal, error);
  return !error;
}

unsigned SocketClient::farewell() const { return impl_->socket.reason().code; }

const std::string& SocketClient::pong() const { return impl_->pong; }

bool SocketClient::ends_within(Time span) {
  const auto end = std::chrono::steady_clock::now() + span;
  pollfd waiting{impl_->socket.next_layer().native_handle(), POLLIN, 0};
  std::array<char, 4096> noise;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0 || poll(&waiting, 1, static_cast<int>(left.count())) <= 0) return false;
    if (recv(waiting.fd, noise.data(), noise.size(), 0) <= 0) return true;
  }
}

}  // namespace steadyhand

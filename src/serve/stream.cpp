#include "serve/stream.hpp"

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/write.hpp>
#include <utility>

namespace steadyhand {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using TlsSocket = asio::ssl::stream<tcp::socket>;

/// One type for every handler.
struct Handler {
  Stream::Done done;
  void operator()(error_code error, std::size_t bytes) const { done(error ? 0 : bytes); }
  void operator()(error_code error) const { done(error ? 0 : 1); }
};

template <typename Socket>
class SocketStream final : public Stream {
 public:
  static constexpr bool kTls = std::is_same_v<Socket, TlsSocket>;

  template <typename... Arguments>
  explicit SocketStream(Arguments&&... arguments) : socket_(std::forward<Arguments>(arguments)...) {}

  bool encrypted() const override { return kTls; }
  void handshake(Done done) override {
    if constexpr (kTls) {
      socket_.async_handshake(asio::ssl::stream_base::server, Handler{std::move(done)});
    } else {
      done(1);
    }
  }
  void read(char* to, std::size_t room, Done done) override {
    socket_.async_read_some(asio::mutable_buffer(to, room), Handler{std::move(done)});
  }
  void write(std::string_view first, std::string_view second, Done done) override {
    const std::array<asio::const_buffer, 2> both = {asio::const_buffer(first.data(), first.size()),
                                                    asio::const_buffer(second.data(), second.size())};
    asio::async_write(socket_, both, Handler{std::move(done)});
  }
  void finish() override {
    error_code ignored;
    socket().shutdown(tcp::socket::shutdown_send, ignored);
  }
  void cut() override {
    error_code ignored;
    socket().close(ignored);
  }
  tcp::socket& socket() override {
    if constexpr (kTls) {
      return socket_.next_layer();
    } else {
      return socket_;
    }
  }

 private:
  Socket socket_;
};

}  // namespace

std::unique_ptr<Stream> make_stream(tcp::socket socket, asio::ssl::context* tls) {
  if (tls) return std::make_unique<SocketStream<TlsSocket>>(std::move(socket), *tls);
  return std::make_unique<SocketStream<tcp::socket>>(std::move(socket));
}

}  // namespace steadyhand

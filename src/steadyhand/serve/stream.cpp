#include "steadyhand/serve/stream.hpp"

#include <boost/asio/ssl.hpp>

namespace steadyhand {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using TlsSocket = asio::ssl::stream<tcp::socket>;

template <typename Layer>
class Stream::TransportOver final : public Transport {
 public:
  static constexpr bool kTls = std::is_same_v<Layer, TlsSocket>;

  template <typename... Arguments>
  explicit TransportOver(Arguments&&... arguments) : layer_(std::forward<Arguments>(arguments)...) {}

  bool encrypted() const override { return kTls; }
  tcp::socket& socket() override {
    if constexpr (kTls) {
      return layer_.next_layer();
    } else {
      return layer_;
    }
  }
  void handshake(Done done) override {
    if constexpr (kTls) {
      layer_.async_handshake(asio::ssl::stream_base::server, [done = std::move(done)](error_code e) { done(e, 0); });
    } else {
      done({}, 0);
    }
  }
  void read(const Pieces<asio::mutable_buffer>& to, Done done) override { layer_.async_read_some(to, std::move(done)); }
  void write(const Pieces<asio::const_buffer>& from, Done done) override {
    layer_.async_write_some(from, std::move(done));
  }

 private:
  Layer layer_;
};

Stream::Stream(Socket socket, asio::ssl::context* tls) {
  if (tls) {
    transport_ = std::make_unique<TransportOver<TlsSocket>>(std::move(socket), *tls);
  } else {
    transport_ = std::make_unique<TransportOver<Socket>>(std::move(socket));
  }
}

void Stream::finish() {
  error_code ignored;
  socket().shutdown(tcp::socket::shutdown_send, ignored);
}

void Stream::cut() {
  error_code ignored;
  socket().close(ignored);
}

void teardown(boost::beast::role_type, Stream& stream, error_code& error) {
  stream.finish();
  error = {};
}

void beast_close_socket(Stream& stream) { stream.cut(); }

}  // namespace steadyhand

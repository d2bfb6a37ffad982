#include "steadyhand/operator/server/stream.hpp"

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
    transport_ = std::make_shared<TransportOver<TlsSocket>>(std::move(socket), *tls);
  } else {
    transport_ = std::make_shared<TransportOver<Socket>>(std::move(socket));
  }
}

std::size_t Stream::Transport::put(const Pieces<asio::const_buffer>& from) {
  const std::size_t size = asio::buffer_size(from);
  if (is_last) return size;
  if (waiting.empty() && going.empty()) progress = std::chrono::steady_clock::now();
  for (const asio::const_buffer& piece : from) waiting.append(static_cast<const char*>(piece.data()), piece.size());
  if (going.empty()) send();
  return size;
}

void Stream::Transport::send() {
  if (going.empty()) going.swap(waiting);
  write({asio::buffer(going)}, [self = shared_from_this()](error_code error, std::size_t bytes) {
    if (error) {
      self->socket().close(error);  // the read that is under way fails, too
      return;
    }
    self->progress = std::chrono::steady_clock::now();
    self->going.erase(0, bytes);
    if (self->going.empty()) std::string().swap(self->going);  // a key picture is large, and clients are many
    if (!self->going.empty() || !self->waiting.empty()) return self->send();
    if (self->taken) self->taken();
  });
}

void Stream::write_behind(std::function<void()> taken) {
  transport_->is_behind = true;
  transport_->taken = std::move(taken);
}

std::chrono::steady_clock::duration Stream::waiting_for() const {
  if (waiting_bytes() == 0) return {};
  return std::chrono::steady_clock::now() - transport_->progress;
}

void Stream::write_last(std::string_view bytes) {
  transport_->put({asio::buffer(bytes)});
  transport_->is_last = true;
}

void Stream::finish() {
  error_code ignored;
  socket().shutdown(tcp::socket::shutdown_send, ignored);
}

void Stream::cut() {
  error_code ignored;
  if (transport_->is_writing || waiting_bytes() > 0) socket().set_option(asio::socket_base::linger(true, 0), ignored);
  socket().close(ignored);
}

void teardown(boost::beast::role_type, Stream& stream, error_code& error) {
  stream.finish();
  error = {};
}

void beast_close_socket(Stream& stream) { stream.cut(); }

}  // namespace steadyhand

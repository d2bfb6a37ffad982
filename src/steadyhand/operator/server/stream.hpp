#pragma once

#include <array>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/role.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace boost::asio::ssl {
class context;
}

namespace steadyhand {

/// The bytes of one connection, with TLS or without, as one type: Beast's HTTP and WebSocket above it are compiled
/// once. What Asio calls an AsyncReadStream and AsyncWriteStream; one operation of each kind at a time.
class Stream {
 public:
  using error_code = boost::system::error_code;
  using Socket = boost::asio::ip::tcp::socket;
  using executor_type = Socket::executor_type;
  using Done = std::function<void(error_code, std::size_t bytes)>;

  /// @param tls nullptr: without
  Stream(Socket socket, boost::asio::ssl::context* tls);

  bool encrypted() const { return transport_->encrypted(); }
  executor_type get_executor() { return socket().get_executor(); }
  /// As TCP has it.
  Socket& socket() { return transport_->socket(); }
  /// Before anything else.
  void handshake(Done done) { transport_->handshake(std::move(done)); }
  /// From now on a write completes at once, and its bytes are sent in the background: Beast answers pings while it
  /// reads, and must continue to read from a peer that reads nothing. @param taken called whenever all bytes have been
  /// sent
  void write_behind(std::function<void()> taken);
  /// Bytes that have not gone out, and since when none has.
  std::size_t waiting_bytes() const { return transport_->waiting.size() + transport_->going.size(); }
  std::chrono::steady_clock::duration waiting_for() const;
  /// After all that was written; later writes are discarded.
  void write_last(std::string_view bytes);
  /// No more will be written; what was is delivered.
  void finish();
  /// At once: pending operations end. A peer that takes nothing gets a reset: the kernel would keep its connection for
  /// minutes.
  void cut();
  /// Called with the size of all that is read from here on.
  void on_read(std::function<void(std::size_t bytes)> call) { on_read_ = std::move(call); }

  template <typename Buffers, typename Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return boost::asio::async_initiate<Handler, void(error_code, std::size_t)>(
        [this](auto done, const auto& to) {
          auto kept = keep(std::move(done));
          transport_->read(gather<boost::asio::mutable_buffer>(to), [this, kept](error_code error, std::size_t bytes) {
            if (on_read_) on_read_(bytes);
            (*kept)(error, bytes);
          });
        },
        handler, buffers);
  }
  template <typename Buffers, typename Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    return boost::asio::async_initiate<Handler, void(error_code, std::size_t)>(
        [this](auto done, const auto& from) {
          const auto pieces = gather<boost::asio::const_buffer>(from);
          auto kept = keep(std::move(done));
          if (!transport_->is_behind) {
            transport_->is_writing = true;
            return transport_->write(pieces, [kept, transport = transport_](error_code error, std::size_t bytes) {
              transport->is_writing = false;
              (*kept)(error, bytes);
            });
          }
          const std::size_t bytes = transport_->put(pieces);
          boost::asio::post(get_executor(), [kept, bytes] { (*kept)(error_code(), bytes); });
        },
        handler, buffers);
  }

 private:
  template <typename Buffer>
  using Pieces = std::array<Buffer, 8>;  // what is beyond these waits for the next call

  struct Transport : std::enable_shared_from_this<Transport> {
    virtual ~Transport() = default;
    virtual bool encrypted() const = 0;
    virtual Socket& socket() = 0;
    virtual void handshake(Done done) = 0;
    virtual void read(const Pieces<boost::asio::mutable_buffer>& to, Done done) = 0;
    virtual void write(const Pieces<boost::asio::const_buffer>& from, Done done) = 0;

    /// Behind what waits. @return its size
    std::size_t put(const Pieces<boost::asio::const_buffer>& from);
    void send();

    bool is_writing = false, is_behind = false, is_last = false;
    std::string waiting, going;  ///< `going` is being written
    std::chrono::steady_clock::time_point progress;
    std::function<void()> taken;
  };
  template <typename Layer>
  class TransportOver;

  /// std::function wants what it holds to be copied, handlers may only be moved.
  template <typename Handler>
  static auto keep(Handler handler) {
    return std::make_shared<Handler>(std::move(handler));
  }
  template <typename Buffer, typename Buffers>
  static Pieces<Buffer> gather(const Buffers& buffers) {
    Pieces<Buffer> pieces;
    auto next = boost::asio::buffer_sequence_begin(buffers);
    const auto end = boost::asio::buffer_sequence_end(buffers);
    for (std::size_t i = 0; next != end && i < pieces.size(); ++next) {
      if (Buffer piece(*next); piece.size() > 0) pieces[i++] = piece;
    }
    return pieces;
  }

  std::shared_ptr<Transport> transport_;
  std::function<void(std::size_t)> on_read_;
};

/// How Beast ends a connection in good order, and at once.
template <typename Handler>
void async_teardown(boost::beast::role_type, Stream& stream, Handler&& handler) {
  stream.finish();
  boost::asio::post(stream.get_executor(), [done = std::forward<Handler>(handler)]() mutable { done({}); });
}
void teardown(boost::beast::role_type, Stream& stream, boost::system::error_code& error);
void beast_close_socket(Stream& stream);

}  // namespace steadyhand

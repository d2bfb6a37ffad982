#include "steadyhand/operator/server/websocket_client.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <utility>

#include "steadyhand/operator/server/peer_user.hpp"

namespace steadyhand {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;

constexpr Time kFarewell = std::chrono::milliseconds(200);  // for a client that is sent away to read the reason
constexpr std::size_t kMaxQueued = 64;                      // messages other than states
constexpr std::ptrdiff_t kMostPictures = 4;                 // waiting frames of one camera
constexpr int kClientBuffer = 32 * 1024;  // bytes the kernel may hold: some ten states, not minutes of them
/// Bytes that a client may send without a message or control frame in them. Beast reads over frames that hold nothing.
constexpr std::size_t kMaxHollow = 4 * kMaxClientMessage;
/// Bytes of answers to its pings that a client may leave unread.
constexpr std::size_t kMaxUnread = 4 * kMaxClientMessage;

/// A client of the hub: at most one message is on its way; behind it wait a bounded queue of messages, the newest
/// state, and a few frames. Its messages are read even if it reads nothing, until its socket is closed: it may ask for
/// a stop.
class WebSocketClient final : public Outbox, public std::enable_shared_from_this<WebSocketClient> {
 public:
  WebSocketClient(Stream stream, ConnectionsShared& shared)
      : socket_(std::move(stream)), farewell_(socket_.get_executor()), shared_(shared) {}
  ~WebSocketClient() override { leave(); }

  void start(const Address& address, HttpRequest request) {
    id_ = shared_.hub->join(*this, address, shared_.now());
    if (id_ == 0) return turn_away(request.version());
    error_code ignored;
    auto& tcp = socket_.next_layer().socket();
    tcp.set_option(asio::socket_base::send_buffer_size(kClientBuffer), ignored);
    tcp.set_option(asio::ip::tcp::no_delay(true), ignored);
    socket_.set_option(websocket::stream_base::timeout{shared_.timeout, shared_.timeout, true});
    socket_.read_message_max(kMaxClientMessage);
    socket_.auto_fragment(false);
    // Not by shared pointers: the socket is a member, and they would keep it for good.
    socket_.control_callback([this](websocket::frame_type kind, beast::string_view payload) {
      hollow_ = 0;
      shared_.hub->receive_frame(id_, shared_.now());
      if (kind == websocket::frame_type::ping) unread_ += 2 + payload.size();
      if (unread_ > kMaxUnread) close();
    });
    socket_.next_layer().write_behind([weak = weak_from_this()] {
      const auto self = weak.lock();
      if (!self) return;
      self->unread_ = 0;
      self->write();
    });
    socket_.next_layer().on_read([this](std::size_t bytes) {
      hollow_ += bytes;
      if (hollow_ > kMaxHollow) close();
    });
    request_ = std::move(request);
    writing_ = true;
    socket_.async_accept(request_, [self = shared_from_this()](error_code error) {
      self->writing_ = false;
      if (error) return self->end();
      self->read();
      self->write();
    });
  }

  void send(std::shared_ptr<const std::string> message) override {
    if (closing_) return;
    if (queue_.size() >= kMaxQueued || stuck()) return drop();
    queue_.push_back(std::move(message));
    write();
  }

  bool send_state(std::shared_ptr<const std::string> message) override {
    if (closing_) return false;
    if (stuck()) {
      drop();
      return false;
    }
    const bool replaced = state_ != nullptr;
    state_ = std::move(message);
    write();
    return replaced;
  }

  bool send_picture(std::shared_ptr<const std::string> message, int camera, bool is_key) override {
    if (closing_) return false;
    if (stuck()) {
      drop();
      return false;
    }
    const auto of_camera = [camera](const Picture& picture) { return picture.camera == camera; };
    if (is_key) std::erase_if(pictures_, of_camera);
    if (std::count_if(pictures_.begin(), pictures_.end(), of_camera) >= kMostPictures) return false;
    pictures_.push_back({camera, std::move(message)});
    write();
    return true;
  }

  /// Closes soon, even if the client reads nothing.
  void close() override {
    if (closing_) return;
    closing_ = true;
    state_ = nullptr;
    pictures_.clear();
    farewell_.expires_after(kFarewell);
    farewell_.async_wait([weak = weak_from_this()](error_code cancelled) {
      if (const auto self = weak.lock(); self && !cancelled) self->end();
    });
    write();
  }

  bool of_this_user() override { return peer_user(socket_.next_layer().socket()) == geteuid(); }

 private:
  void read() {
    socket_.async_read(input_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->end();
      self->hollow_ = 0;
      const auto data = self->input_.cdata();
      self->shared_.hub->receive(self->id_, {static_cast<const char*>(data.data()), data.size()}, self->shared_.now());
      self->input_.consume(self->input_.size());
      self->read();
    });
  }

  void write() {
    if (writing_ || ended_ || socket_.next_layer().waiting_bytes() > 0) return;
    bool is_text = true;
    if (!queue_.empty()) {
      output_ = std::move(queue_.front());
      queue_.pop_front();
    } else if (state_) {
      output_ = std::exchange(state_, nullptr);
    } else if (!pictures_.empty()) {
      output_ = std::move(pictures_.front().message);
      pictures_.pop_front();
      is_text = false;
    } else {
      if (closing_) say_goodbye();
      return;
    }
    writing_ = true;
    socket_.text(is_text);
    socket_.async_write(asio::buffer(*output_), [self = shared_from_this()](error_code error, std::size_t) {
      self->writing_ = false;
      if (error) return self->end();
      self->write();
    });
  }

  /// The frame that closes a WebSocket. Not Beast's: after that it reads no messages, and a stop would be lost. The
  /// socket is closed when the client answers it or disconnects, or when `farewell_` is due.
  void say_goodbye() {
    const auto code = static_cast<std::uint16_t>(shared_.ending ? websocket::close_code::going_away
                                                                : websocket::close_code::policy_error);
    const char frame[] = {'\x88', 2, static_cast<char>(code >> 8), static_cast<char>(code & 0xff)};
    socket_.next_layer().write_last({frame, sizeof frame});
  }

  /// Beast's timeout is for a client that does not send; this one is for a client that does not read.
  bool stuck() const { return socket_.next_layer().waiting_for() > shared_.timeout; }

  void turn_away(unsigned version) {
    ended_ = true;
    full_ = {http::status::service_unavailable, version};
    full_.keep_alive(false);
    full_.prepare_payload();
    http::async_write(socket_.next_layer(), full_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->socket_.next_layer().finish();
    });
  }

  /// A client that reads nothing: no farewell would reach it. Not at once, for the hub may be in the middle of its
  /// list.
  void drop() {
    closing_ = true;
    queue_.clear();
    pictures_.clear();
    asio::post(socket_.get_executor(), [self = shared_from_this()] { self->end(); });
  }

  void end() {
    closing_ = ended_ = true;
    farewell_.cancel();
    socket_.next_layer().cut();
    leave();
  }

  void leave() {
    if (id_ != 0) shared_.hub->leave(std::exchange(id_, 0), shared_.now());
  }

  websocket::stream<Stream, false> socket_;  // without compression: messages are small and often
  asio::steady_timer farewell_;
  ConnectionsShared& shared_;
  std::uint64_t id_ = 0;  // number in the hub; 0: not joined
  HttpRequest request_;
  http::response<http::empty_body> full_;
  beast::flat_buffer input_;
  std::shared_ptr<const std::string> output_;  // under way
  std::deque<std::shared_ptr<const std::string>> queue_;
  std::shared_ptr<const std::string> state_;
  struct Picture {
    int camera;
    std::shared_ptr<const std::string> message;
  };
  std::deque<Picture> pictures_;
  std::size_t hollow_ = 0;  // bytes since the last message or control frame
  std::size_t unread_ = 0;  // bytes of answers to pings since it took all that it was sent
  bool writing_ = false, closing_ = false, ended_ = false;
};

}  // namespace

void serve_websocket(Stream stream, ConnectionsShared& shared, const Address& address, HttpRequest request) {
  std::make_shared<WebSocketClient>(std::move(stream), shared)->start(address, std::move(request));
}

}  // namespace steadyhand

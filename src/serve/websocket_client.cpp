#include <unistd.h>

#include <array>
#include <boost/asio/post.hpp>
#include <deque>
#include <utility>

#include "serve/connection.hpp"
#include "serve/frames.hpp"
#include "serve/peer_user.hpp"

namespace steadyhand {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr Time kFarewell = std::chrono::milliseconds(200);  // for one that is thrown out to hear why
constexpr std::size_t kMaxQueued = 64;                      // messages other than states
constexpr int kSendBuffer = 32 * 1024;  // bytes the kernel may hold: some ten states, not minutes of them

/// A client of the hub: at most one write is under way; behind it wait a bounded queue of messages and the newest
/// state.
class WebSocketClient final : public Outbox, public std::enable_shared_from_this<WebSocketClient> {
 public:
  WebSocketClient(std::unique_ptr<Stream> stream, Desk& desk)
      : stream_(std::move(stream)), timer_(stream_->socket().get_executor()), desk_(desk), heard_(desk.now()) {}
  ~WebSocketClient() override { leave(); }

  void start(const Address& address, const HttpRequest& request, std::string_view rest) {
    error_code ignored;
    stream_->socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    stream_->socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    id_ = desk_.hub->join(*this, address, desk_.now());
    if (id_ == 0) {
      output_ = answer_head(HttpStatus::kUnavailable, {{"Content-Length", "0"}, {"Connection", "close"}});
      return stream_->write(output_, {}, [self = shared_from_this()](std::size_t good) {
        if (good) self->stream_->finish();
      });
    }
    control_ = answer_head(HttpStatus::kSwitchingProtocols,
                           {{"Upgrade", "websocket"},
                            {"Connection", "Upgrade"},
                            {"Sec-WebSocket-Accept", accept_key(*request.find("sec-websocket-key"))}});
    write();
    watch();
    take(rest);
    read();
  }

  void send(std::shared_ptr<const std::string> message) override {
    if (closing_) return;
    if (queue_.size() >= kMaxQueued) return drop();
    queue_.push_back(std::move(message));
    write();
  }

  bool send_state(std::shared_ptr<const std::string> message) override {
    if (closing_) return false;
    const bool replaced = state_ != nullptr;
    state_ = std::move(message);
    write();
    return replaced;
  }

  void close() override { close(CloseCode::kPolicy); }
  bool of_this_user() override { return peer_user(stream_->socket()) == geteuid(); }

 private:
  void read() {
    stream_->read(input_.data(), input_.size(), [self = shared_from_this()](std::size_t bytes) {
      if (bytes == 0) return self->end();
      self->heard_ = self->desk_.now();
      self->take({self->input_.data(), bytes});
      if (!self->deaf_) self->read();
    });
  }

  void take(std::string_view bytes) {
    using Kind = FrameEvent::Kind;
    while (!bytes.empty() && !deaf_) {
      const FrameEvent event = reader_.next(bytes);
      switch (event.kind) {
        case Kind::kNone:
          break;
        case Kind::kMessage:
          desk_.hub->receive(id_, event.payload, desk_.now());
          break;
        case Kind::kPing:
          if (!closing_) answer_ping(event.payload);
          [[fallthrough]];
        case Kind::kPart:
        case Kind::kPong:
          desk_.hub->receive_frame(id_, desk_.now());
          break;
        case Kind::kClose:
        case Kind::kBroken:
          deaf_ = true;
          leave();
          close(event.code);
          break;
      }
    }
  }

  /// A ping that is not answered yet gives way to the next one.
  void answer_ping(std::string_view payload) {
    pong_.clear();
    append_frame_head(pong_, Opcode::kPong, payload.size());
    pong_ += payload;
    write();
  }

  /// What waits, in one piece: first what the protocol needs, then messages in their order, then the newest state.
  void write() {
    if (writing_) return;
    output_.clear();
    output_ += std::exchange(control_, {});
    output_ += std::exchange(pong_, {});
    for (; !queue_.empty(); queue_.pop_front()) append(*queue_.front());
    if (const auto state = std::exchange(state_, nullptr)) append(*state);
    output_ += std::exchange(farewell_, {});
    if (output_.empty()) {
      if (closing_ && deaf_) stream_->finish();
      return;
    }
    writing_ = true;
    written_ = desk_.now();
    stream_->write(output_, {}, [self = shared_from_this()](std::size_t bytes) {
      self->writing_ = false;
      if (bytes == 0) return self->end();
      self->write();
    });
  }

  void append(const std::string& message) {
    append_frame_head(output_, Opcode::kText, message.size());
    output_ += message;
  }

  /// Until it answers, what a client sends is read for nothing: not for long, and whether it reads or not.
  void close(CloseCode code) {
    if (closing_) return;
    closing_ = true;
    state_ = nullptr;
    append_frame_head(farewell_, Opcode::kClose, 2);
    farewell_ += static_cast<char>(static_cast<int>(code) >> 8);
    farewell_ += static_cast<char>(static_cast<int>(code) & 0xff);
    write();
    timer_.expires_after(kFarewell);
    timer_.async_wait([weak = weak_from_this()](error_code cancelled) {
      if (const auto self = weak.lock(); self && !cancelled) self->end();
    });
  }

  /// Ends the connection of a client that says or takes nothing.
  void watch() {
    timer_.expires_after(desk_.patience / 15);
    timer_.async_wait([weak = weak_from_this()](error_code cancelled) {
      const auto self = weak.lock();
      if (!self || cancelled || self->closing_) return;
      const Time now = self->desk_.now();
      const Time silence = now - self->heard_;
      if (silence > self->desk_.patience || (self->writing_ && now - self->written_ > self->desk_.patience))
        return self->end();
      if (silence > self->desk_.patience / 2 && self->control_.empty()) {
        append_frame_head(self->control_, Opcode::kPing, 0);
        self->write();
      }
      self->watch();
    });
  }

  /// A client that reads nothing: no farewell would reach it. Not at once, for the hub may be in the middle of its
  /// list.
  void drop() {
    closing_ = true;
    queue_.clear();
    asio::post(stream_->socket().get_executor(), [self = shared_from_this()] { self->end(); });
  }

  void end() {
    closing_ = deaf_ = true;
    timer_.cancel();
    stream_->cut();
    leave();
  }

  void leave() {
    if (id_ != 0) desk_.hub->leave(std::exchange(id_, 0), desk_.now());
  }

  std::unique_ptr<Stream> stream_;
  asio::steady_timer timer_;
  Desk& desk_;
  std::uint64_t id_ = 0;  // of the hub; 0: not joined
  FrameReader reader_{kMaxClientMessage};
  std::array<char, 4096> input_;
  std::string output_, control_, pong_, farewell_;  // under way; waiting
  std::deque<std::shared_ptr<const std::string>> queue_;
  std::shared_ptr<const std::string> state_;
  Time heard_, written_{0};
  bool writing_ = false, closing_ = false, deaf_ = false;
};

}  // namespace

void serve_websocket(std::unique_ptr<Stream> stream, Desk& desk, const Address& address, const HttpRequest& request,
                     std::string_view rest) {
  std::make_shared<WebSocketClient>(std::move(stream), desk)->start(address, request, rest);
}

}  // namespace steadyhand

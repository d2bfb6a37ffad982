#include "serve/connection.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <deque>
#include <optional>
#include <utility>

namespace steadyhand {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;
using PlainStream = beast::tcp_stream;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;

constexpr auto kPatience = std::chrono::seconds(15);        // with a peer that says or takes nothing
constexpr auto kFarewell = std::chrono::milliseconds(200);  // for one that is thrown out to hear why
constexpr std::size_t kMaxQueued = 64;                      // messages other than states
constexpr int kSendBuffer = 32 * 1024;  // bytes the kernel may hold: some ten states, not minutes of them
constexpr std::uint32_t kMaxHeader = 8 * 1024;

/// Counts a connection for as long as it lives.
class Ticket {
 public:
  explicit Ticket(Desk& desk) : desk_(&desk) { ++desk_->connections; }
  Ticket(Ticket&& other) noexcept : desk_(std::exchange(other.desk_, nullptr)) {}
  Ticket& operator=(Ticket&&) = delete;
  ~Ticket() {
    if (desk_) --desk_->connections;
  }

 private:
  Desk* desk_;
};

/// A client of the hub: at most one write is under way; behind it wait a bounded queue of messages and the newest
/// state.
template <typename Stream>
class WebSocketClient final : public Outbox, public std::enable_shared_from_this<WebSocketClient<Stream>> {
 public:
  WebSocketClient(Stream stream, Desk& desk, Ticket ticket)
      : socket_(std::move(stream)), farewell_(socket_.get_executor()), desk_(desk), ticket_(std::move(ticket)) {}
  ~WebSocketClient() override { leave(); }

  void start(const http::request<http::empty_body>& request) {
    auto& tcp = beast::get_lowest_layer(socket_);
    tcp.expires_never();  // the WebSocket has timeouts of its own
    error_code ignored;
    tcp.socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    tcp.socket().set_option(asio::ip::tcp::no_delay(true), ignored);
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = kPatience;
    timeout.idle_timeout = kPatience;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.read_message_max(kMaxClientMessage);
    socket_.text(true);
    socket_.async_accept(request, [self = this->shared_from_this()](error_code error) {
      if (error) return;
      const auto peer = beast::get_lowest_layer(self->socket_).socket().remote_endpoint(error).address();
      const Address address{peer.is_loopback() ? "loopback" : peer.to_string(), peer.is_loopback()};
      self->id_ = self->desk_.hub->join(*self, address, self->desk_.now());
      if (self->id_ != 0) self->read();
    });
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

  void close() override {
    closing_ = true;
    state_ = nullptr;
    write();
  }

 private:
  void read() {
    socket_.async_read(buffer_, [self = this->shared_from_this()](error_code error, std::size_t) {
      if (error) return self->leave();
      const auto data = self->buffer_.cdata();
      self->desk_.hub->receive(self->id_, {static_cast<const char*>(data.data()), data.size()}, self->desk_.now());
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void write() {
    if (writing_) return;
    if (!queue_.empty()) {
      in_flight_ = std::move(queue_.front());
      queue_.pop_front();
    } else if (state_) {
      in_flight_ = std::exchange(state_, nullptr);
    } else {
      if (closing_ && !closed_) {
        closed_ = true;
        // Until it answers, what a client sends is read for nothing: not for long.
        farewell_.expires_after(kFarewell);
        farewell_.async_wait([self = this->shared_from_this()](error_code error) {
          if (!error) beast::get_lowest_layer(self->socket_).close();
        });
        socket_.async_close(websocket::close_code::policy_error,
                            [self = this->shared_from_this()](error_code) { self->farewell_.cancel(); });
      }
      return;
    }
    writing_ = true;
    socket_.async_write(asio::buffer(*in_flight_), [self = this->shared_from_this()](error_code error, std::size_t) {
      self->writing_ = false;
      if (error) return self->leave();
      self->write();
    });
  }

  /// A client that reads nothing: no farewell would reach it. Not at once, for the hub may be in the middle of its
  /// list.
  void drop() {
    closing_ = true;
    queue_.clear();
    asio::post(socket_.get_executor(), [self = this->shared_from_this()] {
      beast::get_lowest_layer(self->socket_).close();
      self->leave();
    });
  }

  void leave() {
    closing_ = true;
    if (id_ != 0) desk_.hub->leave(std::exchange(id_, 0), desk_.now());
  }

  websocket::stream<Stream> socket_;
  asio::steady_timer farewell_;
  Desk& desk_;
  Ticket ticket_;
  beast::flat_buffer buffer_;
  std::uint64_t id_ = 0;  // of the hub; 0: not joined
  std::deque<std::shared_ptr<const std::string>> queue_;
  std::shared_ptr<const std::string> state_, in_flight_;
  bool writing_ = false, closing_ = false, closed_ = false;
};

/// Requests one after another on one connection.
template <typename Stream>
class HttpConnection : public std::enable_shared_from_this<HttpConnection<Stream>> {
 public:
  static constexpr bool kTls = std::is_same_v<Stream, TlsStream>;

  HttpConnection(Stream stream, Desk& desk) : stream_(std::move(stream)), desk_(desk), ticket_(desk) {}

  void start() {
    beast::get_lowest_layer(stream_).expires_after(kPatience);
    if constexpr (kTls) {
      stream_.async_handshake(asio::ssl::stream_base::server, [self = this->shared_from_this()](error_code error) {
        if (!error) self->read();
      });
    } else {
      read();
    }
  }

 private:
  using Response = http::response<http::span_body<const char>>;

  void read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    parser_->body_limit(0);
    beast::get_lowest_layer(stream_).expires_after(kPatience);
    http::async_read(stream_, buffer_, *parser_, [self = this->shared_from_this()](error_code error, std::size_t) {
      if (error == http::error::end_of_stream) return self->finish();
      if (!error) self->answer();
    });
  }

  void answer() {
    const auto& request = parser_->get();
    const std::string_view host = view(request[http::field::host]);
    if (!host_allowed(host, desk_.hosts)) {
      return respond(http::status::misdirected_request, "This server does not go by that name.\n");
    }
    if (websocket::is_upgrade(request)) return upgrade(host);
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return respond(http::status::method_not_allowed, "Only GET and HEAD are answered.\n");
    }
    const std::string_view path = view(request.target()).substr(0, view(request.target()).find_first_of("?#"));
    if (desk_.fetch && (path == "/sessions" || path.substr(0, 10) == "/sessions/")) return fetch(std::string(path));
    const SiteFile* file = desk_.site->find(path);
    if (!file) return respond(http::status::not_found, "There is no such page.\n");
    respond(http::status::ok, file->body, {file->type, file->gzipped, false});
  }

  void fetch(const std::string& path) {
    if (desk_.waiting.size() >= ServerCallbacks::kMaxFetches) {
      return respond(http::status::service_unavailable, "Busy with other requests; try again.\n");
    }
    const std::uint64_t number = ++desk_.last_fetch;
    desk_.waiting[number] = [self = this->shared_from_this()](Result<FreshPage> page) {
      self->fresh_ = page ? std::move(page->body) : page.error().message + "\n";
      if (!page) return self->respond(http::status::not_found, self->fresh_);
      self->respond(http::status::ok, self->fresh_, {page->type, false, page->document});
    };
    desk_.fetch(path, number);
  }

  void upgrade(std::string_view host) {
    const auto& request = parser_->get();
    const auto origin = request.find(http::field::origin);
    const bool welcome =
        origin == request.end() ? desk_.accept_missing_origin : origin_allowed(view(origin->value()), host, kTls);
    if (!welcome) return respond(http::status::forbidden, "Only pages of this server may connect.\n");
    if (request.target() != "/live") return respond(http::status::not_found, "The WebSocket is at /live.\n");
    if (static_cast<int>(desk_.hub->clients()) >= desk_.max_clients) {
      return respond(http::status::service_unavailable, "Too many clients.\n");
    }
    auto client = std::make_shared<WebSocketClient<Stream>>(std::move(stream_), desk_, std::move(ticket_));
    client->start(http::request<http::empty_body>(parser_->release()));
  }

  struct Kind {
    std::string_view type = "text/plain; charset=utf-8";
    bool gzipped = false;
    bool document = false;
  };

  /// body must outlive the answer: a literal, a file of the site, or fresh_.
  void respond(http::status status, std::string_view body, const Kind& kind = {}) {
    const auto& request = parser_->get();
    response_.emplace(status, request.version());
    auto& r = *response_;
    r.set(http::field::content_type, beast::string_view(kind.type.data(), kind.type.size()));
    if (kind.gzipped) r.set(http::field::content_encoding, "gzip");
    r.set(http::field::cache_control, "no-cache");
    r.set("X-Content-Type-Options", "nosniff");
    r.set("Referrer-Policy", "no-referrer");
    r.set("Cross-Origin-Opener-Policy", "same-origin");
    r.set("Cross-Origin-Resource-Policy", "same-origin");
    const std::string host(status == http::status::misdirected_request ? "" : view(request[http::field::host]));
    // A document keeps its scripts, but as a page of nobody's: it may neither ask this server nor read what it keeps.
    r.set("Content-Security-Policy",
          kind.document
              ? "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
                "sandbox allow-scripts allow-downloads; frame-ancestors 'none'"
              : "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
                "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; "
                "connect-src 'self'" +
                    (host.empty() ? "" : (kTls ? " wss://" : " ws://") + host));
    r.body() = {body.data(), body.size()};
    r.prepare_payload();
    r.keep_alive(request.keep_alive());
    if (request.method() == http::verb::head) {
      head_.emplace(r.base());
      head_->content_length(body.size());
      send(*head_);
    } else {
      send(r);
    }
  }

  template <typename Message>
  void send(Message& message) {
    beast::get_lowest_layer(stream_).expires_after(kPatience);
    http::async_write(stream_, message,
                      [self = this->shared_from_this(), keep = message.keep_alive()](error_code error, std::size_t) {
                        if (error) return;
                        if (keep) return self->read();
                        self->finish();
                      });
  }

  void finish() {
    error_code ignored;
    beast::get_lowest_layer(stream_).socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
  }

  static std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

  Stream stream_;
  Desk& desk_;
  Ticket ticket_;
  beast::flat_buffer buffer_{kMaxHeader + 1024};
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<Response> response_;
  std::string fresh_;  // body of a page that was made for this request
  std::optional<http::response<http::empty_body>> head_;
};

}  // namespace

void serve_connection(asio::ip::tcp::socket socket, Desk& desk, asio::ssl::context* tls) {
  // Files are small and few: four connections for each client that may be there.
  if (desk.connections >= 4 * desk.max_clients) return;
  if (tls) {
    std::make_shared<HttpConnection<TlsStream>>(TlsStream(PlainStream(std::move(socket)), *tls), desk)->start();
  } else {
    std::make_shared<HttpConnection<PlainStream>>(PlainStream(std::move(socket)), desk)->start();
  }
}

}  // namespace steadyhand

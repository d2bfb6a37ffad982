#include "steadyhand/operator/server/connection.hpp"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <utility>

#include "steadyhand/operator/server/websocket_client.hpp"

namespace steadyhand {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::uint32_t kMaxHeader = 8 * 1024;  // bytes
constexpr std::size_t kPiece = 64 * 1024;       // bytes of an answer that are in hand at once
constexpr int kSendBuffer = 256 * 1024;         // bytes of answers that the kernel may hold, for one connection

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

/// Type of a body.
struct Kind {
  std::string_view type = "text/plain; charset=utf-8";
  bool gzipped = false;
  bool document = false;
};

/// Requests one after another on one connection.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(Stream stream, ConnectionsShared& shared, const Listener& listener, Address address)
      : stream_(std::move(stream)),
        timer_(stream_->get_executor()),
        shared_(shared),
        listener_(listener),
        address_(std::move(address)) {}
  ~HttpConnection() {
    close_file();
    shared_.visitors.erase(visitor_);
  }

  void start() {
    visitor_ = ++shared_.last_visitor;
    // Not by a shared pointer: it must not live because it is listed.
    shared_.visitors[visitor_] = {address_, shared_.now(), [this] { end(); }, false};
    restart_timer();
    error_code ignored;
    stream_->socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
    stream_->socket().set_option(tcp::no_delay(true), ignored);  // headers and body are written one after the other
    stream_->handshake([self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->read();
    });
  }

 private:
  /// For as long as one request, or a piece of its answer, may take.
  void restart_timer() {
    timer_.expires_after(shared_.timeout);
    timer_.async_wait([weak = weak_from_this()](error_code cancelled) {
      const auto self = weak.lock();
      // It may have been set again while this call was on its way.
      if (self && !cancelled && self->timer_.expiry() <= asio::steady_timer::clock_type::now()) self->end();
    });
  }

  void end() {
    timer_.cancel();
    if (stream_) stream_->cut();
  }

  void read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    parser_->body_limit(0);
    http::async_read(*stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error == http::error::end_of_stream) return self->stream_->finish();
      if (!error) self->answer();
    });
  }

  void answer() {
    const auto& request = parser_->get();
    const std::string_view host = view(request[http::field::host]);
    if (!host_allowed(host, listener_.hosts)) {
      return respond(http::status::misdirected_request, "This server does not go by that name.\n");
    }
    if (beast::websocket::is_upgrade(request)) return upgrade(host);
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return respond(http::status::method_not_allowed, "Only GET and HEAD are answered.\n");
    }
    const std::string_view path = view(request.target()).substr(0, view(request.target()).find_first_of("?#"));
    if (shared_.fetch && (path == "/sessions" || path.substr(0, 10) == "/sessions/")) return fetch(std::string(path));
    const SiteFile* file = shared_.site->find(path);
    if (!file) return respond(http::status::not_found, "There is no such page.\n");
    respond(http::status::ok, file->body, {file->type, file->gzipped, false});
  }

  /// Recordings show people: only paired clients read them.
  void fetch(const std::string& path) {
    const std::optional<Hub::Reader> reader = this->reader();
    if (!reader) {
      return respond(
          http::status::unauthorized,
          "Only paired clients see recordings: enter the code that the terminal shows at the page, then open "
          "this again from its list.\n");
    }
    if (!shared_.has_place(address_, reader->in_control)) {
      return respond(http::status::service_unavailable, "Busy with other requests; try again.\n");
    }
    const auto visitor = shared_.visitors.find(visitor_);
    if (visitor == shared_.visitors.end()) return;  // it was cut off
    visitor->second.reads = true;
    cookie_ = reader->key;
    timer_.cancel();
    const std::uint64_t number = ++shared_.last_fetch;
    shared_.waiting[number] = [self = shared_from_this()](Result<FreshPage> page) { self->show(std::move(page)); };
    shared_.fetch(path, number);
  }

  /// Scripts and the page's own requests show the token. A link cannot: it brings the cookie of an earlier answer.
  std::optional<Hub::Reader> reader() const {
    const auto& request = parser_->get();
    constexpr std::string_view kBearer = "Bearer ";
    const std::string_view shown = view(request[http::field::authorization]);
    if (shown.substr(0, kBearer.size()) == kBearer) return shared_.hub->reader(shown.substr(kBearer.size()));
    return shared_.hub->reader(cookie_of(view(request[http::field::cookie]), cookie_name()));
  }

  /// Browsers give a cookie to every port of a host; each program there has its own.
  std::string cookie_name() const {
    const std::string_view host = view(parser_->get()[http::field::host]);
    return "steadyhand-" + std::string(host.substr(std::min(host.find(':') + 1, host.size())));
  }

  void show(Result<FreshPage> page) {
    if (!page) {
      fresh_.body = page.error().message + "\n";
      return respond(http::status::not_found, fresh_.body);
    }
    fresh_ = *std::move(page);
    respond(http::status::ok, fresh_.body, {fresh_.type, false, fresh_.document});
  }

  void upgrade(std::string_view host) {
    const auto& request = parser_->get();
    const auto origin = request.find(http::field::origin);
    const bool welcome = origin == request.end() ? shared_.accept_missing_origin
                                                 : origin_allowed(view(origin->value()), host, stream_->encrypted());
    if (!welcome) return respond(http::status::forbidden, "Only pages of this server may connect.\n");
    if (request.target() != "/live") return respond(http::status::not_found, "The WebSocket is at /live.\n");
    timer_.cancel();
    serve_websocket(*std::exchange(stream_, std::nullopt), shared_, address_, parser_->release());
  }

  /// body must outlive the answer: a literal, a file of the site, or that of fresh_, whose file goes in its place.
  void respond(http::status status, std::string_view body, const Kind& kind = {}) {
    const auto& request = parser_->get();
    head_.emplace(status, request.version());
    auto& r = *head_;
    r.set(http::field::content_type, beast::string_view(kind.type.data(), kind.type.size()));
    if (kind.gzipped) r.set(http::field::content_encoding, "gzip");
    r.set(http::field::cache_control, cookie_.empty() ? "no-cache" : "no-store");
    if (!cookie_.empty()) r.set(http::field::set_cookie, cookie());
    if (status == http::status::unauthorized) r.set(http::field::www_authenticate, "Bearer");
    r.set("X-Content-Type-Options", "nosniff");
    r.set("Referrer-Policy", "no-referrer");
    r.set("Cross-Origin-Opener-Policy", "same-origin");
    r.set("Cross-Origin-Resource-Policy", "same-origin");
    r.set("Content-Security-Policy", policy(status, kind));
    r.keep_alive(request.keep_alive());
    const std::uint64_t size = fresh_.file ? fresh_.size : body.size();
    r.content_length(size);
    body_ = body;
    left_ = request.method() == http::verb::head ? 0 : size;
    restart_timer();
    http::async_write(*stream_, r, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->send_more();
    });
  }

  /// Permits reading recordings, and nothing else, until the browser or this program ends.
  std::string cookie() const {
    return cookie_name() + "=" + cookie_ + "; Path=/sessions; HttpOnly; SameSite=Strict" +
           (stream_->encrypted() ? "; Secure" : "");
  }

  /// A document keeps its scripts, but has an origin of no site: it can neither send requests to this server nor read
  /// the page's storage.
  std::string policy(http::status status, const Kind& kind) const {
    if (kind.document) {
      return "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
             "sandbox allow-scripts allow-downloads; frame-ancestors 'none'";
    }
    const std::string host(status == http::status::misdirected_request ? "" : view(parser_->get()[http::field::host]));
    return "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
           "img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors "
           "'none'; "
           "connect-src 'self'" +
           (host.empty() ? "" : (stream_->encrypted() ? " wss://" : " ws://") + host);
  }

  /// A piece of the body, so that the timer is about progress: an answer may take as long as its bytes are taken.
  void send_more() {
    restart_timer();
    if (left_ == 0) return finish();
    if (fresh_.file) return read_piece();
    send_piece({body_.data() + (body_.size() - left_), std::min<std::size_t>(left_, kPiece)});
  }

  void send_piece(asio::const_buffer piece) {
    asio::async_write(*stream_, piece, [self = shared_from_this()](error_code error, std::size_t bytes) {
      if (error) return;
      self->left_ -= bytes;
      self->send_more();
    });
  }

  /// On the disk's thread, as a slow disk must not delay a stop. Nothing else uses file and piece meanwhile.
  void read_piece() {
    piece_.resize(std::min<std::size_t>(left_, kPiece));
    asio::post(*shared_.disk, [self = shared_from_this(), executor = stream_->get_executor()]() mutable {
      const auto at = static_cast<off_t>(self->fresh_.size - self->left_);
      const ssize_t read = ::pread(fileno(self->fresh_.file.get()), self->piece_.data(), self->piece_.size(), at);
      asio::post(executor, [self = std::move(self), read] {
        if (read <= 0) return self->end();  // cut short meanwhile: the promised size cannot be sent
        self->send_piece({self->piece_.data(), static_cast<std::size_t>(read)});
      });
    });
  }

  /// On the disk's thread: closing a file without a name deletes it.
  void close_file() {
    if (fresh_.file && shared_.disk) asio::post(*shared_.disk, [file = std::move(fresh_.file)] {});
  }

  void finish() {
    close_file();
    fresh_ = {};
    cookie_.clear();
    if (const auto visitor = shared_.visitors.find(visitor_); visitor != shared_.visitors.end())
      visitor->second.reads = false;
    if (head_->keep_alive()) return read();
    stream_->finish();
  }

  std::optional<Stream> stream_;  // until a WebSocket takes it over
  asio::steady_timer timer_;
  ConnectionsShared& shared_;
  const Listener& listener_;
  Address address_;
  std::uint64_t visitor_ = 0;
  beast::flat_buffer buffer_{kMaxHeader + 1024};
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<http::response<http::empty_body>> head_;
  std::string_view body_;
  FreshPage fresh_;         // made for this request
  std::string cookie_;      // value of the cookie that the answer sets; empty: none
  std::uint64_t left_ = 0;  // bytes of the body that are to be sent
  std::vector<char> piece_;
};

}  // namespace

bool ConnectionsShared::has_place(const Address& address, bool in_control) const {
  int all = 0, here = 0;
  for (const auto& [id, visitor] : visitors) {
    all += visitor.reads;
    here += visitor.reads && visitor.address.text == address.text;
  }
  using Most = ServerCallbacks;
  return in_control ? all < Most::kMaxFetches + Most::kReservedFetches
                    : all < Most::kMaxFetches && here < Most::kMaxFetchesEach;
}

void serve_connection(asio::ip::tcp::socket socket, ConnectionsShared& shared, const Listener& listener) {
  error_code gone;
  const auto peer = socket.remote_endpoint(gone).address();
  if (gone) return;
  const Address address{peer.is_loopback() ? "loopback" : peer.to_string(), peer.is_loopback()};
  if (shared.visitors.size() >= shared.max_visitors) {
    std::vector<Guest> guests;
    for (const auto& [id, visitor] : shared.visitors) {
      if (!visitor.reads) guests.push_back({id, visitor.address, visitor.since});
    }
    const auto found = shared.visitors.find(*who_leaves(guests, address));
    const auto cut = std::move(found->second.cut);
    shared.visitors.erase(found);
    cut();
  }
  std::make_shared<HttpConnection>(Stream(std::move(socket), listener.tls), shared, listener, address)->start();
}

}  // namespace steadyhand

#include "steadyhand/serve/connection.hpp"

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <optional>
#include <utility>

#include "steadyhand/serve/websocket_client.hpp"

namespace steadyhand {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;

constexpr std::uint32_t kMaxHeader = 8 * 1024;  // bytes

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

/// What a body is.
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
  ~HttpConnection() { shared_.visitors.erase(visitor_); }

  void start() {
    visitor_ = ++shared_.last_visitor;
    // Not by a shared pointer: it must not live because it is listed.
    shared_.visitors[visitor_] = {address_, shared_.now(), [this] { end(); }};
    restart_timer();
    stream_->handshake([self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->read();
    });
  }

 private:
  using Response = http::response<http::span_body<const char>>;

  /// For as long as one request, or its answer, may take.
  void restart_timer() {
    timer_.expires_after(shared_.timeout);
    timer_.async_wait([weak = weak_from_this()](error_code cancelled) {
      const auto self = weak.lock();
      // It may have been set anew while this call was on its way.
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

  void fetch(const std::string& path) {
    if (shared_.waiting.size() >= ServerCallbacks::kMaxFetches) {
      return respond(http::status::service_unavailable, "Busy with other requests; try again.\n");
    }
    timer_.cancel();
    const std::uint64_t number = ++shared_.last_fetch;
    shared_.waiting[number] = [self = shared_from_this()](Result<FreshPage> page) {
      self->fresh_ = page ? std::move(page->body) : page.error().message + "\n";
      if (!page) return self->respond(http::status::not_found, self->fresh_);
      self->respond(http::status::ok, self->fresh_, {page->type, false, page->document});
    };
    shared_.fetch(path, number);
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
              : "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
                "img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors "
                "'none'; "
                "connect-src 'self'" +
                    (host.empty() ? "" : (stream_->encrypted() ? " wss://" : " ws://") + host));
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
    restart_timer();
    http::async_write(*stream_, message,
                      [self = shared_from_this(), keep = message.keep_alive()](error_code error, std::size_t) {
                        if (error) return;
                        self->restart_timer();
                        if (keep) return self->read();
                        self->stream_->finish();
                      });
  }

  std::optional<Stream> stream_;  // until a WebSocket goes on with it
  asio::steady_timer timer_;
  ConnectionsShared& shared_;
  const Listener& listener_;
  Address address_;
  std::uint64_t visitor_ = 0;
  beast::flat_buffer buffer_{kMaxHeader + 1024};
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<Response> response_;
  std::string fresh_;  // body of a page that was made for this request
  std::optional<http::response<http::empty_body>> head_;
};

}  // namespace

void serve_connection(asio::ip::tcp::socket socket, ConnectionsShared& shared, const Listener& listener) {
  error_code gone;
  const auto peer = socket.remote_endpoint(gone).address();
  if (gone) return;
  const Address address{peer.is_loopback() ? "loopback" : peer.to_string(), peer.is_loopback()};
  if (shared.visitors.size() >= shared.max_visitors) {
    std::vector<Guest> guests;
    for (const auto& [id, visitor] : shared.visitors) guests.push_back({id, visitor.address, visitor.since});
    const auto found = shared.visitors.find(*who_leaves(guests, address));
    const auto cut = std::move(found->second.cut);
    shared.visitors.erase(found);
    cut();
  }
  std::make_shared<HttpConnection>(Stream(std::move(socket), listener.tls), shared, listener, address)->start();
}

}  // namespace steadyhand

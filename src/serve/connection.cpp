#include "serve/connection.hpp"

#include <array>
#include <optional>
#include <utility>

namespace steadyhand {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

/// What a body is.
struct Kind {
  std::string_view type = "text/plain; charset=utf-8";
  bool gzipped = false;
  bool document = false;
};

/// Requests one after another on one connection.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(std::unique_ptr<Stream> stream, Desk& desk, Address address)
      : stream_(std::move(stream)),
        timer_(stream_->socket().get_executor()),
        desk_(desk),
        address_(std::move(address)) {}
  ~HttpConnection() { desk_.visitors.erase(visitor_); }

  void start() {
    visitor_ = ++desk_.last_visitor;
    // Not by a shared pointer: it must not live because it is listed.
    desk_.visitors[visitor_] = {address_, desk_.now(), [this] { end(); }};
    be_patient();
    stream_->handshake([self = shared_from_this()](std::size_t good) {
      if (good) self->read();
    });
  }

 private:
  /// For as long as one request, or its answer, may take.
  void be_patient() {
    timer_.expires_after(desk_.patience);
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
    const std::size_t end = input_.find("\r\n\r\n");
    if (end != std::string::npos && end + 4 <= kMaxRequestHead) return answer(end + 4);
    if (input_.size() >= kMaxRequestHead) return;
    stream_->read(room_.data(), room_.size(), [self = shared_from_this()](std::size_t bytes) {
      if (bytes == 0) return;
      self->input_.append(self->room_.data(), bytes);
      self->read();
    });
  }

  void answer(std::size_t size) {
    auto request = parse_request(std::string_view(input_).substr(0, size));
    input_.erase(0, size);
    if (!request) {
      request_ = {};
      return respond(HttpStatus::kBadRequest, "This is no request that this server answers.\n");
    }
    request_ = *std::move(request);
    if (!host_allowed(request_.host(), desk_.hosts)) {
      return respond(HttpStatus::kMisdirected, "This server does not go by that name.\n");
    }
    if (request_.wants_websocket()) return upgrade();
    if (request_.method != "GET" && request_.method != "HEAD") {
      return respond(HttpStatus::kMethodNotAllowed, "Only GET and HEAD are answered.\n");
    }
    const std::string path = request_.target.substr(0, request_.target.find_first_of("?#"));
    if (desk_.fetch && (path == "/sessions" || path.substr(0, 10) == "/sessions/")) return fetch(path);
    const SiteFile* file = desk_.site->find(path);
    if (!file) return respond(HttpStatus::kNotFound, "There is no such page.\n");
    respond(HttpStatus::kOk, file->body, {file->type, file->gzipped, false});
  }

  void fetch(const std::string& path) {
    if (desk_.waiting.size() >= ServerCallbacks::kMaxFetches) {
      return respond(HttpStatus::kUnavailable, "Busy with other requests; try again.\n");
    }
    timer_.cancel();
    const std::uint64_t number = ++desk_.last_fetch;
    desk_.waiting[number] = [self = shared_from_this()](Result<FreshPage> page) {
      self->fresh_ = page ? std::move(page->body) : page.error().message + "\n";
      if (!page) return self->respond(HttpStatus::kNotFound, self->fresh_);
      self->respond(HttpStatus::kOk, self->fresh_, {page->type, false, page->document});
    };
    desk_.fetch(path, number);
  }

  void upgrade() {
    const std::string* origin = request_.find("origin");
    const bool welcome =
        origin ? origin_allowed(*origin, request_.host(), stream_->encrypted()) : desk_.accept_missing_origin;
    if (!welcome) return respond(HttpStatus::kForbidden, "Only pages of this server may connect.\n");
    if (request_.target != "/live") return respond(HttpStatus::kNotFound, "The WebSocket is at /live.\n");
    const std::string* version = request_.find("sec-websocket-version");
    const std::string* key = request_.find("sec-websocket-key");
    if (request_.method != "GET" || !key || key->size() != 24) {
      return respond(HttpStatus::kBadRequest, "This is no WebSocket's request.\n");
    }
    if (!version || *version != "13") {
      return respond(HttpStatus::kUpgradeRequired, "WebSocket's version is 13.\n");
    }
    timer_.cancel();
    serve_websocket(std::move(stream_), desk_, address_, request_, input_);
  }

  /// body must outlive the answer: a literal, a file of the site, or fresh_.
  void respond(HttpStatus status, std::string_view body, const Kind& kind = {}) {
    const std::string host(status == HttpStatus::kMisdirected ? "" : request_.host());
    // A document keeps its scripts, but as a page of nobody's: it may neither ask this server nor read what it keeps.
    const std::string policy =
        kind.document
            ? "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
              "sandbox allow-scripts allow-downloads; frame-ancestors 'none'"
            : "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
              "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; "
              "connect-src 'self'" +
                  (host.empty() ? "" : (stream_->encrypted() ? " wss://" : " ws://") + host);
    std::vector<std::pair<std::string_view, std::string>> fields = {
        {"Content-Type", std::string(kind.type)},
        {"Content-Length", std::to_string(body.size())},
        {"Cache-Control", "no-cache"},
        {"X-Content-Type-Options", "nosniff"},
        {"Referrer-Policy", "no-referrer"},
        {"Cross-Origin-Opener-Policy", "same-origin"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Content-Security-Policy", policy},
        {"Connection", request_.keep_alive ? "keep-alive" : "close"},
    };
    if (kind.gzipped) fields.push_back({"Content-Encoding", "gzip"});
    if (status == HttpStatus::kUpgradeRequired) fields.push_back({"Sec-WebSocket-Version", "13"});
    head_ = answer_head(status, fields);
    be_patient();
    if (request_.method == "HEAD") body = {};
    stream_->write(head_, body, [self = shared_from_this()](std::size_t good) {
      if (!good) return;
      self->be_patient();
      if (self->request_.keep_alive) return self->read();
      self->stream_->finish();
    });
  }

  std::unique_ptr<Stream> stream_;
  asio::steady_timer timer_;
  Desk& desk_;
  Address address_;
  std::uint64_t visitor_ = 0;
  std::array<char, 4096> room_;
  std::string input_;  // what was read and not answered yet
  HttpRequest request_;
  std::string head_, fresh_;  // of the answer; body of a page that was made for it
};

}  // namespace

void serve_connection(asio::ip::tcp::socket socket, Desk& desk, asio::ssl::context* tls) {
  error_code gone;
  const auto peer = socket.remote_endpoint(gone).address();
  if (gone) return;
  const Address address{peer.is_loopback() ? "loopback" : peer.to_string(), peer.is_loopback()};
  if (desk.visitors.size() >= desk.max_visitors) {
    std::vector<Guest> guests;
    for (const auto& [id, visitor] : desk.visitors) guests.push_back({id, visitor.address, visitor.since});
    const auto found = desk.visitors.find(*who_leaves(guests, address));
    const auto cut = std::move(found->second.cut);
    desk.visitors.erase(found);
    cut();
  }
  std::make_shared<HttpConnection>(make_stream(std::move(socket), tls), desk, address)->start();
}

}  // namespace steadyhand

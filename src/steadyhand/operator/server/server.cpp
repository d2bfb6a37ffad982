#include "steadyhand/operator/server/server.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "steadyhand/core/attempt.hpp"
#include "steadyhand/core/latest_value.hpp"
#include "steadyhand/operator/server/certificate.hpp"
#include "steadyhand/operator/server/connection.hpp"
#include "steadyhand/operator/server/picture_inlet.hpp"

namespace steadyhand {

namespace asio = boost::asio;
namespace ssl = asio::ssl;
using asio::ip::tcp;
using boost::system::error_code;

struct Server::Impl {
  /// The way back for answers from other threads, which may outlive the server.
  struct Mailbox {
    std::mutex mutex;
    asio::io_context* io = nullptr;  // nullptr: the server has ended
  };

  Impl(const ServerSettings& s, ServerFacts f, ServerCallbacks c)
      : settings(s),
        facts(std::move(f)),
        callbacks(std::move(c)),
        hub(facts, callbacks, s.max_rate_hz, s.max_clients) {}

  Status listen(tcp::acceptor& acceptor, const tcp::endpoint& endpoint) {
    error_code error;
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (!error) return Done{};
    const std::string where = fmt::format("{}:{}", endpoint.address().to_string(), endpoint.port());
    if (error == asio::error::address_in_use) {
      return Error{fmt::format("port {} is taken: does steadyhand run already? Otherwise choose another port", where)};
    }
    return Error{fmt::format("cannot serve at {}: {}", where, error.message())};
  }

  Status prepare_tls() {
    auto folder = settings.state_folder.empty() ? state_folder() : Result<std::filesystem::path>(settings.state_folder);
    if (!folder) return folder.error();
    auto certificate = load_or_make_certificate(*folder, at_lan.hosts);
    if (!certificate) return certificate.error();
    fingerprint = certificate->fingerprint;
    tls.emplace(ssl::context::tls_server);
    error_code error;
    tls->set_options(ssl::context::default_workarounds | ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1, error);
    if (!error) tls->use_certificate(asio::buffer(certificate->certificate_pem), ssl::context::pem, error);
    if (!error) tls->use_private_key(asio::buffer(certificate->key_pem), ssl::context::pem, error);
    if (error) return Error{"OpenSSL refuses the certificate for HTTPS: " + error.message()};
    return Done{};
  }

  void accept(tcp::acceptor& acceptor, const Listener& listener) {
    acceptor.async_accept([this, &acceptor, &listener](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) {
        accept(acceptor, listener);  // first, so that others can connect even if the rest throws
        return serve_connection(std::move(socket), shared, listener);
      }
      // Out of file descriptors, most likely: trying again at once would spin.
      auto pause = std::make_shared<asio::steady_timer>(io, std::chrono::milliseconds(100));
      pause->async_wait([this, &acceptor, &listener, pause](error_code) { accept(acceptor, listener); });
    });
  }

  /// Until the end, or until a handler throws.
  void run() {
    const Status ran = attempt([this] { io.run(); });
    if (!ran && callbacks.on_failure) callbacks.on_failure(ran.error().message);
  }

  void tick() {
    timer.expires_after(std::chrono::milliseconds(100));
    timer.async_wait([this](error_code error) {
      if (error) return;
      tick();  // first, so that it continues even if the rest throws
      if (callbacks.on_tick) callbacks.on_tick();
      hub.tick(callbacks.now());
      count();
    });
  }

  void send_newest() {
    waiting.store(false, std::memory_order_release);
    if (newest.read(view)) hub.broadcast_state(view);
    count();
  }

  void count() {
    const std::lock_guard lock(mutex);
    counters = {hub.clients(),        hub.samples,        hub.samples_dropped,
                hub.refused_messages, hub.states_skipped, hub.pictures_skipped};
  }

  Status open_pictures() {
    if (facts.cameras.empty()) return Done{};
    auto made = PictureInlet::make(facts.cameras.size());
    if (!made) return made.error();
    pictures = *std::move(made);
    error_code error;
    picture_waits.assign(::dup(pictures->descriptor()), error);
    if (error) return Error{"cannot show cameras at the page: " + error.message()};
    await_pictures();
    return Done{};
  }

  void await_pictures() {
    picture_waits.async_wait(asio::posix::stream_descriptor::wait_read, [this](error_code error) {
      if (error) return;
      pictures->hear();
      await_pictures();
      for (PictureInlet::Message each; pictures->take(each);)
        hub.broadcast_picture(each.camera, each.is_key, each.text);
    });
  }

  std::vector<std::string> make_urls() const {
    std::vector<std::string> all = {fmt::format("http://127.0.0.1:{}/#code={}", port, hub.code())};
    if (!settings.lan) return all;
    for (const std::string& address : lan_addresses()) {
      all.push_back(fmt::format("https://{}:{}/#code={}", address, lan_port, hub.code()));
    }
    return all;
  }

  void tell_pairing() {
    auto all = make_urls();
    {
      const std::lock_guard lock(mutex);
      urls = all;
    }
    if (on_pairing) on_pairing(all);
  }

  void offer_fetching() {
    mailbox->io = &io;
    shared.fetch = [this](const std::string& path, std::uint64_t number) {
      callbacks.on_fetch(path, [this, mailbox = mailbox, number](Result<FreshPage> page) {
        const std::lock_guard lock(mailbox->mutex);
        if (!mailbox->io) return;
        asio::post(*mailbox->io, [this, number, page = std::move(page)]() mutable {
          const auto found = shared.waiting.find(number);
          if (found == shared.waiting.end()) return;
          const ConnectionsShared::Answer answer = std::move(found->second);
          shared.waiting.erase(found);
          answer(std::move(page));
        });
      });
    };
  }

  Status start() {
    if (!settings.page_folder.empty()) {
      auto loaded = Site::load(settings.page_folder);
      if (!loaded) return loaded.error();
      site = std::move(*loaded);
    } else {
      site = Site::embedded();
    }
    for (const auto& [path, body] : settings.files) site.add(path, body);
    if (Status s = hub.prepare(); !s) return s;
    shared.hub = &hub;
    shared.site = &site;
    shared.now = callbacks.now;
    shared.timeout = settings.timeout;
    shared.accept_missing_origin = settings.accept_non_browser_clients;
    shared.max_visitors = 3 * static_cast<std::size_t>(std::max(settings.max_clients, 1)) +
                          ServerCallbacks::kMaxFetches + ServerCallbacks::kReservedFetches;
    shared.disk = &disk;
    asio::post(disk, [] { ::pthread_setname_np(::pthread_self(), "disk"); });
    if (callbacks.on_fetch) offer_fetching();
    if (Status s = open_pictures(); !s) return s;
    if (Status s = listen(local, {asio::ip::address_v4::loopback(), settings.port}); !s) return s;
    port = local.local_endpoint().port();
    if (settings.lan) {
      at_lan.hosts = at_loopback.hosts;
      for (const std::string& name : lan_addresses()) at_lan.hosts.push_back(name);
      for (const std::string& name : host_names()) at_lan.hosts.push_back(name);
      if (Status s = prepare_tls(); !s) return s;
      at_lan.tls = &*tls;
      if (Status s = listen(lan, {asio::ip::address_v4::any(), settings.lan_port}); !s) return s;
      lan_port = lan.local_endpoint().port();
      accept(lan, at_lan);
    }
    urls = make_urls();
    accept(local, at_loopback);
    tick();
    thread = std::thread([this] {
      if (callbacks.on_thread) (void)attempt(callbacks.on_thread);
      while (!io.stopped()) run();
    });
    return Done{};
  }

  /// Reports the end to every client that still listens.
  void say_farewell() {
    constexpr std::chrono::milliseconds kSoon{50};
    const auto told = std::make_shared<std::promise<std::size_t>>();
    std::future<std::size_t> clients = told->get_future();
    asio::post(io, [this, told] {
      shared.ending = true;
      told->set_value(hub.say_farewell());
    });
    if (clients.wait_for(kSoon) == std::future_status::ready && clients.get() > 0) std::this_thread::sleep_for(kSoon);
  }

  ~Impl() {
    if (thread.joinable()) say_farewell();
    io.stop();
    if (thread.joinable()) thread.join();
    {
      const std::lock_guard lock(mailbox->mutex);
      mailbox->io = nullptr;
    }
    shared.disk = nullptr;
    shared.waiting.clear();
    hub.shut_down();
  }

  ServerSettings settings;
  ServerFacts facts;
  ServerCallbacks callbacks;  // as the hub sees them: on_pairing goes through tell_pairing
  std::function<void(const std::vector<std::string>&)> on_pairing;
  Site site;
  Hub hub;
  ConnectionsShared shared;
  std::optional<ssl::context> tls;
  Listener at_loopback{{"127.0.0.1", "localhost"}, nullptr}, at_lan;
  const std::shared_ptr<Mailbox> mailbox = std::make_shared<Mailbox>();
  std::string fingerprint;
  std::uint16_t port = 0, lan_port = 0;
  std::shared_ptr<PictureInlet> pictures;  // null: no cameras
  LatestValue<OperatorView> newest;
  OperatorView view;  // the server thread's
  std::atomic<bool> waiting{false};
  mutable std::mutex mutex;  // guards the following, between the server's thread and the session's
  std::vector<std::string> urls;
  ServerCounters counters;
  // Last: their handlers own connections, which leave the hub when they are destroyed.
  asio::io_context io{1};
  tcp::acceptor local{io}, lan{io};
  asio::steady_timer timer{io};
  asio::posix::stream_descriptor picture_waits{io};
  asio::thread_pool disk{1};  // ends before the members that get its results
  std::thread thread;
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::~Server() = default;

Result<std::unique_ptr<Server>> Server::start(const ServerSettings& settings, ServerFacts facts,
                                              ServerCallbacks callbacks) {
  auto impl = std::make_unique<Impl>(settings, std::move(facts), std::move(callbacks));
  impl->on_pairing = std::exchange(impl->callbacks.on_pairing, [p = impl.get()](const auto&) { p->tell_pairing(); });
  if (Status status = impl->start(); !status) return status.error();
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

void Server::publish(const OperatorView& view) {
  impl_->newest.write(view);
  if (!impl_->waiting.exchange(true, std::memory_order_acq_rel)) {
    asio::post(impl_->io, [p = impl_.get()] { p->send_newest(); });
  }
}

std::function<void(const VideoPacket&)> Server::pictures() const {
  if (!impl_->pictures) return {};
  return [inlet = impl_->pictures](const VideoPacket& packet) { inlet->put(packet); };
}

std::vector<std::string> Server::urls() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->urls;
}

const std::string& Server::fingerprint() const { return impl_->fingerprint; }

ServerCounters Server::counters() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->counters;
}

std::string Server::local_url() const { return fmt::format("http://127.0.0.1:{}/#code={}", impl_->port, kLocalCode); }
std::uint16_t Server::port() const { return impl_->port; }
std::uint16_t Server::lan_port() const { return impl_->lan_port; }

}  // namespace steadyhand

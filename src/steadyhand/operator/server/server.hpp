#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/operator/protocol/facts.hpp"

/// The operator's way in: a page over HTTP, and one WebSocket per client that carries docs/reference/protocol.md.
namespace steadyhand {

struct ServerSettings {
  std::uint16_t port = 8642;  ///< of loopback, plain HTTP; 0: any free one
  /// Also serve every interface of this machine over HTTPS, at `lan_port`.
  bool lan = false;
  std::uint16_t lan_port = 8643;       ///< 0: any free one
  std::filesystem::path state_folder;  ///< where the certificate is kept; empty: state_folder() of certificate.hpp
  std::filesystem::path page_folder;   ///< serve this folder's files; empty: the page in the program itself
  std::map<std::string, std::string> files;  ///< for the page, in addition to its own, by path ("/arms/fr3.glb")
  int max_clients = 96;                      ///< at once; one that is not paired makes room for the next
  double max_rate_hz = 250.0;                ///< messages of one client; more are discarded, many more close it
  bool accept_non_browser_clients = true;    ///< those that send no Origin header, such as scripts
  Time timeout = std::chrono::seconds(15);   ///< for a peer that sends nothing or reads nothing
};

/// Counted since the start.
struct ServerCounters {
  std::uint64_t clients = 0;           ///< connected now
  std::uint64_t samples = 0;           ///< handed to on_sample
  std::uint64_t samples_dropped = 0;   ///< old, out of order, or without control
  std::uint64_t refused_messages = 0;  ///< malformed, not permitted, or too many
  std::uint64_t states_skipped = 0;    ///< not sent because the client had not taken the one before
  std::uint64_t pictures_skipped = 0;  ///< camera frames, likewise
};

/// Runs on one thread. The newest value wins in both directions: no client can make the session wait.
class Server {
 public:
  /// Binds, makes the certificate when one is needed, and serves. Errors: a port that is taken, a certificate that
  /// cannot be made or read, a page folder without index.html.
  static Result<std::unique_ptr<Server>> start(const ServerSettings& settings, ServerFacts facts,
                                               ServerCallbacks callbacks);
  /// Closes every connection and joins the thread; no callback runs afterwards.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Sends it to every client that has taken the one before. From one thread at a time; does not block.
  void publish(const OperatorView& view);

  /// The function that sends frames of ServerFacts::cameras to the clients that watch them; for each camera from one
  /// thread at a time. It does not block. After the server's end a call does nothing. Empty: there are no cameras.
  std::function<void(const VideoPacket& packet)> pictures() const;

  /// Addresses that pair with the code that is valid now: loopback first, then the LAN's. Any thread.
  std::vector<std::string> urls() const;
  /// An address that pairs only programs of the user who runs this one, on this machine: others may read it.
  std::string local_url() const;
  /// SHA-256 of the LAN's certificate, "AB:CD:..."; empty without `lan`.
  const std::string& fingerprint() const;
  ServerCounters counters() const;
  std::uint16_t port() const;      ///< of loopback
  std::uint16_t lan_port() const;  ///< 0 without `lan`

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace steadyhand

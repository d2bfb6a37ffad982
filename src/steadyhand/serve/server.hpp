#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/serve/operator.hpp"

/// The operator's way in: a page over HTTP, and one WebSocket per client that carries docs/protocol.md.
namespace steadyhand {

struct ServerSettings {
  std::uint16_t port = 8642;  ///< of loopback, plain HTTP; 0: any free one
  /// Also serve every interface of this machine over HTTPS, at `lan_port`.
  bool lan = false;
  std::uint16_t lan_port = 8643;       ///< 0: any free one
  std::filesystem::path state_folder;  ///< where the certificate is kept; empty: state_folder() of certificate.hpp
  std::filesystem::path page_folder;   ///< serve this folder's files; empty: the page in the program itself
  std::map<std::string, std::string> files;  ///< that the page has beside its own, by path ("/arms/fr3.glb")
  int max_clients = 96;                      ///< at once; one that is not paired makes room for the next
  double max_rate_hz = 250.0;                ///< messages of one client; more are discarded, many more close it
  bool accept_non_browser_clients = true;    ///< those that send no Origin header, such as scripts
  Time timeout = std::chrono::seconds(15);   ///< with a peer that says or takes nothing
};

/// What a client is told once, when it connects.
struct ServerFacts {
  /// An objective, whose weight OperatorRequest::Kind::kWeight may set.
  struct Term {
    std::string name, label, unit;  ///< unit: of a weight
    int count = 1;                  ///< of its weights
    double min = 0.0, max = 1.0;    ///< among which a page lets its operator choose
    bool logarithmic = false;       ///< by factors from min on, and 0 below
    bool offered = true;            ///< to the operator
  };
  struct Profile {
    std::string name, label;
    std::vector<double> weights;  ///< of each term the first
  };
  /// As the arm simulates it, m; radius and height are inside.
  struct Glass {
    double radius = 0.0, height = 0.0, fill = 0.0;
  };
  std::string version;  ///< of the program
  std::string cell;     ///< JSON as cell_json() makes it
  std::string robot;    ///< JSON as `steadyhand describe` prints it
  Glass glass;
  std::vector<Term> terms;
  std::vector<Profile> profiles;
  std::vector<std::string> recordings;  ///< built-in hands that OperatorRequest::Kind::kPlayback takes
};

/// A page that is made when it is asked for.
struct FreshPage {
  std::string body;
  std::string type;       ///< Content-Type
  bool document = false;  ///< with scripts and styles of its own inside; shown without rights on this server
};

/// What the server tells the session; on_thread, on_pairing and on_fetch may be empty, the others not. All but `now`
/// are called on the server's thread only, one at a time; none may block.
struct ServerCallbacks {
  /// The session's clock. @pre monotonic
  std::function<Time()> now;
  /// Runs first on the server's thread, to set its priority; may be empty.
  std::function<void()> on_thread;
  /// Ten times a second, as long as the server's thread goes on; may be empty.
  std::function<void()> on_tick;
  /// Something on the server's thread threw, where nothing should; it goes on. May be empty.
  std::function<void(const std::string& what)> on_failure;
  /// The lease holder's hand. `stamp.hand`: when it was there, `stamp.made`: when the message arrived, both of the
  /// session's clock. Finite, in order, at most 250 ms old; one that lets go later counts as of its arrival.
  std::function<void(const OperatorSample&)> on_sample;
  /// kStop comes from any client, everything else from the lease holder. Who asked is told what could not be done.
  std::function<Status(const OperatorRequest&)> on_request;
  /// Another client commands from now on; 0: nobody does. The arm must disengage.
  std::function<void(std::uint64_t client)> on_lease;
  /// A code was used up: these addresses carry the next one. The loopback's comes first.
  std::function<void(const std::vector<std::string>& urls)> on_pairing;
  /// Somebody asks for `path`, "/sessions" or something below it, unchecked. The answer may come later and from any
  /// thread, even after the server's end; an error is answered as 404 with its message. At most kMaxFetches at a time.
  std::function<void(const std::string& path, std::function<void(Result<FreshPage>)> answer)> on_fetch;
  static constexpr int kMaxFetches = 8;
};

/// Counted since the start.
struct ServerCounters {
  std::uint64_t clients = 0;           ///< connected now
  std::uint64_t samples = 0;           ///< handed to on_sample
  std::uint64_t samples_dropped = 0;   ///< old, out of order, or without the lease
  std::uint64_t refused_messages = 0;  ///< malformed, not permitted, or too many
  std::uint64_t states_skipped = 0;    ///< not sent because the client had not taken the one before
};

/// One thread of its own. Newest wins in both directions: no client can make the session wait.
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

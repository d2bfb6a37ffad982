#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "serve/access.hpp"
#include "serve/client_clock.hpp"
#include "serve/messages.hpp"
#include "serve/server.hpp"

namespace steadyhand {

/// The way back to one client.
class Outbox {
 public:
  virtual ~Outbox() = default;
  /// Delivered in order, as long as the client keeps up.
  virtual void send(std::shared_ptr<const std::string> message) = 0;
  /// The newest state; it replaces one that has not been sent yet. True if it did.
  virtual bool send_state(std::shared_ptr<const std::string> message) = 0;
  /// After what was sent before. No further message of this client reaches the hub.
  virtual void close() = 0;
};

/// Who is connected, who is paired, who commands, and what their messages mean; knows no sockets. All on one thread.
///
/// Lease: a paired client takes it when nobody has it, or when it is the same client (the same token) on a new
/// connection. It ends when it is given back, when its connection ends, or after kLeaseSilence without a message.
class Hub {
 public:
  static constexpr Time kLeaseSilence = std::chrono::seconds(3);
  /// A sample that is older than this when it arrives is dropped.
  static constexpr Time kOldest = std::chrono::milliseconds(250);
  static constexpr int kMaxStrikes = 20;  ///< malformed messages that a client may send before it is closed

  /// Both must outlive the hub.
  Hub(const ServerFacts& facts, const ServerCallbacks& callbacks, double max_rate_hz);
  /// Error: no random numbers to be had.
  Status prepare() { return pairing_.renew(); }

  /// A client's number, never 0. The outbox must live until leave().
  std::uint64_t join(Outbox& outbox, Time now);
  void leave(std::uint64_t client);
  /// Any bytes at all.
  void receive(std::uint64_t client, std::string_view text, Time now);
  /// Ends the lease of a client that fell silent. Several times a second.
  void tick(Time now);
  void broadcast_state(const SessionSnapshot& snapshot);
  /// Forgets every client without a word or a callback.
  void shut_down();

  const std::string& code() const { return pairing_.code(); }
  std::uint64_t holder() const { return holder_; }
  std::size_t clients() const { return clients_.size(); }

  std::uint64_t samples = 0, samples_dropped = 0, refused_messages = 0, states_skipped = 0;

 private:
  struct Client {
    Outbox* outbox = nullptr;
    bool greeted = false;
    bool closed = false;
    std::string token;  ///< empty: not paired
    Time last_message{0};
    ClientClock clock;
    std::uint64_t last_sequence = 0;
    double last_t = 0.0;
    bool any_sample = false;
    int strikes = 0;
    double allowance = 0.0;  ///< messages that it may send at once
    Time allowance_at{0};
    int excess = 0;  ///< messages above the allowance without a pause
    std::optional<Time> complained;
  };

  void handle(std::uint64_t id, Client& client, const HelloMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const PairMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const LeaseMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const SampleMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const RequestMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const PingMessage& message, Time now);
  bool within_rate(Client& client, Time now);
  void give_lease(std::uint64_t id);
  void tell_lease();
  void refuse(Client& client, Refusal refusal, std::string_view message);
  void complain(Client& client, Refusal refusal, std::string_view message, Time now);
  void close(Client& client);
  void send(Client& client, std::string message);

  const ServerFacts& facts_;
  const ServerCallbacks& callbacks_;
  double max_rate_hz_;
  Pairing pairing_;
  std::map<std::uint64_t, Client> clients_;
  std::uint64_t last_id_ = 0;
  std::uint64_t holder_ = 0;
};

}  // namespace steadyhand

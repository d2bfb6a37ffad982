#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/operator/protocol/access.hpp"
#include "steadyhand/operator/protocol/client_clock.hpp"
#include "steadyhand/operator/protocol/facts.hpp"
#include "steadyhand/operator/protocol/guests.hpp"
#include "steadyhand/operator/protocol/page_messages.hpp"

namespace steadyhand {

/// The way back to one client.
class Outbox {
 public:
  virtual ~Outbox() = default;
  /// Delivered in order, as long as the client keeps up.
  virtual void send(std::shared_ptr<const std::string> message) = 0;
  /// The newest state; it replaces one that has not been sent yet. True if it did.
  virtual bool send_state(std::shared_ptr<const std::string> message) = 0;
  /// A camera frame, sent if nothing else waits; a key frame replaces the frames of its camera that have not been sent.
  /// False: the client is behind, or takes no frames, and this one is dropped.
  virtual bool send_picture(std::shared_ptr<const std::string>, int /*camera*/, bool /*is_key*/) { return false; }
  /// After the messages that were sent before, but soon. Until the socket is closed, messages of the client still reach
  /// the hub: stops count.
  virtual void close() = 0;
  /// Whether the client is a program of the same user on this machine.
  virtual bool of_this_user() = 0;
};

/// The connected and paired clients, the one in control, and the meaning of messages; knows no sockets. One thread.
///
/// Control (the lease): a paired client takes it when no client has it, or from another connection with the same token.
/// It ends when it is given back, when its connection ends, or after kLeaseSilence without a message. Others may ask
/// for it: the holder answers, or they get it once the arm was not engaged for kAskTimeout.
class Hub {
 public:
  static constexpr Time kLeaseSilence = std::chrono::seconds(3);
  static constexpr Time kAskTimeout = std::chrono::seconds(10);
  /// A sample that is older than this when it arrives is dropped, unless it releases the arm.
  static constexpr Time kOldest = std::chrono::milliseconds(250);
  /// A policy's target that was made from an older state is dropped.
  static constexpr Time kOldestObservation = std::chrono::milliseconds(500);
  static constexpr int kMaxStrikes = 20;  ///< malformed messages that a client may send before it is closed
  static constexpr int kFreeCodes = 10;   ///< wrong codes of a connection before each has to wait for kCodeDelay
  static constexpr Time kCodeDelay = std::chrono::seconds(1);

  /// Both must outlive the hub. @param max_rate_hz messages of a client, for each tool of the robot
  Hub(const ServerFacts& facts, const ServerCallbacks& callbacks, double max_rate_hz, int max_clients);
  /// Error: no random numbers to be had.
  Status prepare() { return pairing_.renew(); }

  /// A client's number, or 0 if every place is kept; otherwise another client may have to leave for it. The outbox must
  /// live until leave().
  std::uint64_t join(Outbox& outbox, const Address& address, Time now);
  void leave(std::uint64_t client, Time now);
  /// Any bytes; a stop counts even from a client that was sent away.
  void receive(std::uint64_t client, std::string_view text, Time now);
  /// A frame that is no message, such as a ping of the transport: it counts, too.
  void receive_frame(std::uint64_t client, Time now);
  /// Timeouts: control of a client that stopped sending ends, and the one that asked gets it. Call several times a
  /// second.
  void tick(Time now);
  void broadcast_state(const OperatorView& view);
  /// To the clients that watch this camera. A client that is behind gets none before the next key frame.
  void broadcast_picture(int camera, bool is_key, const std::shared_ptr<const std::string>& message);
  /// Closes every connection. @return how many there were
  std::size_t say_farewell();
  /// Forgets every client without a message or a callback.
  void shut_down();

  /// A client that may read recordings.
  struct Reader {
    std::string key;          ///< sent by its browser instead of its token: Pairing::reading_key
    bool in_control = false;  ///< it has control
  };
  /// @param secret a token or its reading key. None: it is not known
  std::optional<Reader> reader(std::string_view secret) const;

  const std::string& code() const { return pairing_.code(); }
  std::uint64_t holder() const { return holder_; }
  std::size_t clients() const { return clients_.size(); }

  std::uint64_t samples = 0, samples_dropped = 0, refused_messages = 0, states_skipped = 0;
  std::uint64_t pictures_skipped = 0;

 private:
  struct Client {
    Outbox* outbox = nullptr;
    Address address;
    bool greeted = false;
    bool closed = false;
    std::string token;  ///< empty: not paired
    Time useful{0};     ///< when it last greeted, paired or stopped
    Time last_message{0};
    ClientClock clock;
    /// The newest forwarded sample of a hand.
    struct Newest {
      std::uint64_t sequence = 0;
      Time hand{0};
    };
    PerTool<std::optional<Newest>> newest;  ///< none: since it has control it sent none
    int strikes = 0;
    double allowance = 0.0;  ///< messages that it may send at once
    Time allowance_at{0};
    int excess = 0;  ///< messages above the allowance without a pause
    std::optional<Time> complained;
    int wrong_codes = 0;
    Time next_code{0};                ///< no code of it is checked before
    std::optional<std::string> code;  ///< waits for next_code
    enum class Watch : std::uint8_t { kNot, kFromKey, kAll };
    std::vector<Watch> watches;  ///< for each camera; empty: none
    Time ask_after{0};           ///< the holder refused it: until then it need not ask again
  };

  void handle(std::uint64_t id, Client& client, const HelloMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const PairMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const TakeMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const ReleaseMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const AskMessage& message, Time now);
  bool takes(std::uint64_t id, Client& client, Time now);
  void handle(std::uint64_t id, Client& client, const AnswerMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const SampleMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const RequestMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const PingMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const StudyMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const ReplyMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const PolicyMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const TargetMessage& message, Time now);
  void handle(std::uint64_t id, Client& client, const WatchMessage& message, Time now);
  void stop(std::uint64_t id, Time now);
  void tell_stop(std::uint64_t id, Time now);
  void tell_study(std::string content);
  bool sets_condition(std::uint64_t id, const OperatorRequest& request, Time now) const;
  bool make_room(const Address& newcomer, Time now);
  bool within_rate(Client& client, Time now);
  void pair(std::uint64_t id, Client& client, const std::string& code, Time now);
  Result<std::string> admit(Client& client);
  bool may_take(std::uint64_t id, const Client& client) const;
  void ask(std::uint64_t id, Client& client, Time now);
  void give_lease(std::uint64_t id, Time now);
  void end_asking(Time now);
  void watch_asking(Time now);
  bool led(Time now) const;
  LeaseMessage lease_of(std::uint64_t id, const Client& client, Time now) const;
  void tell_lease(Time now);
  /// False: the robot has no such tool; the client gets an error.
  bool has_tool(Client& client, int tool, Time now);
  void refuse(Client& client, Refusal refusal, std::string_view message);
  void complain(Client& client, Refusal refusal, std::string_view message, Time now);
  void close(Client& client);
  void send(Client& client, std::string message);

  const ServerFacts& facts_;
  std::shared_ptr<const std::string> cell_;  ///< the newest sent to clients; null: that of the facts
  std::shared_ptr<const std::vector<std::string>> cameras_ended_;  ///< the newest sent to clients
  const ServerCallbacks& callbacks_;
  double max_rate_hz_;
  std::size_t max_clients_;
  Pairing pairing_;
  std::map<std::uint64_t, Client> clients_;
  std::uint64_t last_id_ = 0;
  std::uint64_t holder_ = 0;
  std::uint64_t asker_ = 0;         ///< client that asks for control; 0: none
  std::uint64_t policy_ = 0;        ///< the client that is a policy; 0: none
  std::uint64_t study_leader_ = 0;  ///< 0: there is no study
  std::string study_;               ///< what its pages show; empty: nothing
  std::optional<Time> idle_since_;  ///< while a client asks: since when the arm is not engaged; none: it is
  std::optional<Time> stop_told_;   ///< when a stop was last reported to all clients
  bool arm_led_ = false;            ///< the newest state has the arm controlled
  Time last_grip_ = Time::min();    ///< when the holder's closed clutch last arrived
};

}  // namespace steadyhand

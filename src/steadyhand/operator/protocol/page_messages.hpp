#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/operator/protocol/facts.hpp"
#include "steadyhand/operator/protocol/policy_hand.hpp"

/// The words of docs/reference/protocol.md: JSON text to structs and back. web/protocol/schema.json says the same to
/// machines.
namespace steadyhand {

/// Of docs/reference/protocol.md. A client of another version is refused.
constexpr int kProtocolVersion = 2;
/// Bytes of the longest message that a client may send.
constexpr std::size_t kMaxClientMessage = 2048;

/// First message of every client.
struct HelloMessage {
  int version = 0;
  std::string token;  ///< of an earlier `paired`; empty: has none
};
struct PairMessage {
  std::string code;
};
/// Take or give back the lease, or ask its holder for it.
struct LeaseMessage {
  enum class Wish { kTake, kRelease, kAsk };
  Wish wish = Wish::kTake;
};
/// Of the holder to who asks for the lease.
struct AnswerMessage {
  bool grant = false;
};
struct SampleMessage {
  std::uint64_t sequence = 0;  ///< grows with every sample
  double t = 0.0;              ///< s, the client's clock, when the hand was there
  OperatorSample sample;       ///< without its stamp
};
struct RequestMessage {
  OperatorRequest request;
};
struct PingMessage {
  double t = 0.0;      ///< s, the client's clock, now
  double echo = -1.0;  ///< s, `now_s` of the newest state that the client has; negative: none
  double held = 0.0;   ///< s, since the client got that state
};
/// What the program that leads a user study has pages show. JSON that only they read; "null": the study is over.
struct StudyMessage {
  std::string content;
};
/// What a participant answers, for that program.
struct ReplyMessage {
  std::string content;
};
/// The client is a policy: it says where the tool is to be, whenever it has its turn.
struct PolicyMessage {
  PolicyInfo policy;
};
struct TargetMessage {
  double of = 0.0;  ///< s, `now_s` of the state that it was made of
  PolicyTarget target;
};
/// Of which cameras the client wants to see pictures from now on.
struct WatchMessage {
  static constexpr std::size_t kMost = 32;  ///< cameras of one client
  std::vector<std::string> cameras;
};
using ClientMessage =
    std::variant<HelloMessage, PairMessage, LeaseMessage, AnswerMessage, SampleMessage, RequestMessage, PingMessage,
                 StudyMessage, ReplyMessage, PolicyMessage, TargetMessage, WatchMessage>;

/// Errors: not JSON, an unknown type, a member that is missing, unknown, of the wrong kind, not finite or out of range.
/// The message names it. Never throws, whatever the bytes.
Result<ClientMessage> parse_client_message(std::string_view text);

/// Why a client's message was not obeyed.
enum class Refusal { kMalformed, kVersion, kUnpaired, kCode, kNoLease, kTaken, kTooMany, kFull, kLate, kUnknown };

/// @param cell what stands around the arm now, as ServerFacts::cell
std::string welcome_message(const ServerFacts& facts, std::string_view cell, std::uint64_t client);
/// It has changed.
std::string cell_message(std::string_view cell);
/// @param ended as OperatorView::cameras_ended
std::string cameras_message(const std::vector<std::string>& ended);
/// A picture for who watches its camera: not JSON, see docs/reference/protocol.md.
std::string picture_message(const VideoPacket& packet);
std::string paired_message(std::string_view token);
std::string study_message(std::string_view content);
/// To everybody: this client asked for a stop.
std::string stopped_message(std::uint64_t client);
std::string reply_message(std::string_view content, std::uint64_t client);
/// The lease as one client sees it.
struct LeaseView {
  std::uint64_t holder = 0;  ///< 0: nobody
  bool yours = false;
  bool takeable = false;    ///< `take` would give it to this client
  std::uint64_t asker = 0;  ///< 0: nobody asks for it
  std::optional<Time>
      left;  ///< until the asker gets it, if nothing leads the arm; none: nobody asks, or something does
};
std::string lease_message(const LeaseView& lease);
std::string pong_message(double t, Time now);
std::string error_message(Refusal refusal, std::string_view message);
/// Numbers that are not finite become null. Allocates only the result.
std::string state_message(const OperatorView& view);

}  // namespace steadyhand

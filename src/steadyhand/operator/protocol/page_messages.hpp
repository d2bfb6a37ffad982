#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "steadyhand/core/describe.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/operator/protocol/facts.hpp"
#include "steadyhand/operator/protocol/policy_hand.hpp"

/// The messages of docs/reference/protocol.md. Each is described next to its struct; from these descriptions come its
/// JSON, read and written, web/protocol/schema.json (and from it the tables of that page) and web/src/protocol.ts.
namespace steadyhand {

/// Version of docs/reference/protocol.md. A client of another version is refused.
constexpr int kProtocolVersion = 3;
/// Bytes of the longest message that a client may send.
constexpr std::size_t kMaxClientMessage = 2048;

/// First message of every client.
struct HelloMessage {
  static constexpr std::string_view kType = "hello";
  int version = 0;
  std::string token;  ///< from an earlier `paired`; empty: none
};
template <typename V>
void describe(V& v, HelloMessage& m) {
  v.type("HelloMessage", "first message. Another version is answered with error `version` and closed");
  v.add("version", "", "", m.version, within(0, 1e6));
  v.add("token", "", "from an earlier `paired`", m.token, sized(0, 64).or_absent());
}

struct PairMessage {
  static constexpr std::string_view kType = "pair";
  std::string code;
};
template <typename V>
void describe(V& v, PairMessage& m) {
  v.type("PairMessage", "answered with `paired` or error `code`");
  v.add("code", "", "", m.code, sized(0, 64));
}

struct TakeMessage {
  static constexpr std::string_view kType = "take";
};
template <typename V>
void describe(V& v, TakeMessage&) {
  v.type("TakeMessage", "takes control. Refused with `unpaired` or `taken`");
}

struct ReleaseMessage {
  static constexpr std::string_view kType = "release";
};
template <typename V>
void describe(V& v, ReleaseMessage&) {
  v.type("ReleaseMessage", "releases control; also withdraws an `ask`");
}

/// Asks the client in control for control.
struct AskMessage {
  static constexpr std::string_view kType = "ask";
};
template <typename V>
void describe(V& v, AskMessage&) {
  v.type("AskMessage",
         "asks the client that has control for it; if `take` would succeed, does the same. Refused with `unpaired` or "
         "`taken` (another client asks already, or this one was refused just now)");
}

/// From the client in control to the client that asks for it.
struct AnswerMessage {
  static constexpr std::string_view kType = "answer";
  bool grant = false;
};
template <typename V>
void describe(V& v, AnswerMessage& m) {
  v.type("AnswerMessage",
         "the holder's answer to `ask`: true gives control, false keeps it; then the asking client gets `taken`");
  v.add("grant", "", "", m.grant);
}

struct SampleMessage {
  static constexpr std::string_view kType = "sample";
  std::uint64_t sequence = 0;  ///< grows with every sample
  double t = 0.0;              ///< s, the client's clock, when the hand was there
  OperatorSample sample;       ///< without its stamp
};
template <typename V>
void describe(V& v, SampleMessage& m) {
  v.type("SampleMessage", "the hand in the operator's frame");
  v.add("sequence", "", "grows with each", m.sequence);
  v.add("t_s", "s", "the client's clock when the hand was there", m.t, within(-kLongest, kLongest));
  v.add("p", "m", "", m.sample.X_operator_hand.p, within(-kFarthest, kFarthest));
  v.add("q", "", "", m.sample.X_operator_hand.q);
  v.add("clutch", "", "the operator holds the arm engaged", m.sample.clutch);
  v.add("tracked", "", "the device knows the pose", m.sample.tracked);
  v.add("emulated", "", "WebXR's `emulatedPosition`", m.sample.emulated);
  v.add("lead_s", "s", "time by which the pose was predicted", m.sample.look_ahead, within(0.0, 0.1).or_absent());
  v.add("gripper", "", "0 open to 1 closed; absent: as it is", m.sample.gripper, within(0.0, 1.0));
  v.add("tool", "", "which of the robot's tools this hand moves; absent: 0", m.sample.tool,
        within(0, kMaxTools - 1).or_absent());
}

struct RequestMessage {
  static constexpr std::string_view kType = "request";
  OperatorRequest request;
};
template <typename V>
void describe(V& v, RequestMessage& m) {
  v.type("RequestMessage", "what the operator asks for");
  describe(v, m.request);
}

/// Content that a user study's program shows on pages; back to clients, too.
struct StudyMessage {
  static constexpr std::string_view kType = "study";
  RawJson<> content;  ///< read by pages only; "null": the study is over
};
template <typename V>
void describe(V& v, StudyMessage& m) {
  v.type("StudyMessage",
         "content that every page shows, `null` when the study is over: from one program at a time, of the same user "
         "on the same machine; and from the server at each change and to clients that connect later");
  v.add("content", "", "", m.content, known_as("StudyContent").or_null());
}

/// A participant's answer to that program.
struct ReplyMessage {
  static constexpr std::string_view kType = "reply";
  RawJson<> content;
};
template <typename V>
void describe(V& v, ReplyMessage& m) {
  v.type("ReplyMessage", "a paired client's answer, `{key, value}`, to the program that runs the study");
  v.add("content", "", "", m.content, known_as("StudyReply"));
}

/// The client is a policy: it sends targets for the tool when it has its turn.
struct PolicyMessage {
  static constexpr std::string_view kType = "policy";
  PolicyInfo policy;
};
template <typename V>
void describe(V& v, PolicyMessage& m) {
  v.type("PolicyMessage",
         "from one paired client at a time, which then sends where each tool is to be "
         "([policies.md](../how-to/policies.md)). It may move the arm once the client that has control requests it");
  v.add("name", "", "", m.policy.name, sized(1, 64));
  v.add("period_s", "s", "between targets", m.policy.period, within(PolicyHand::kFastest, PolicyHand::kSlowest));
}

struct TargetMessage {
  static constexpr std::string_view kType = "target";
  double of = 0.0;  ///< s, `now_s` of the state that it was made from
  std::optional<Vector3> p;
  std::optional<Quaternion> q;
  std::optional<double> gripper;
  int tool = 0;

  /// NaN where the policy sends no number.
  PolicyTarget target() const;
};
template <typename V>
void describe(V& v, TargetMessage& m) {
  v.type("TargetMessage",
         "from the policy: where a tool is to be, in the base, when its next target is due. Dropped if the state is "
         "more than 0.5 s old");
  v.add("of_s", "s", "`now_s` of the state that it was made of", m.of, within(-kLongest, kLongest));
  v.add("p", "m", "null: it has no numbers", m.p, within(-kFarthest, kFarthest).or_null());
  v.add("q", "", "null, too, then", m.q, kOrNull);
  v.add("gripper", "", "0 open to 1 closed; absent: as it is", m.gripper, within(0.0, 1.0));
  v.add("tool", "", "which of the robot's tools; absent: 0", m.tool, within(0, kMaxTools - 1).or_absent());
  v.check(m.p.has_value() == m.q.has_value(), "'q' must be null where 'p' is, and only there");
}

/// The cameras whose frames the client wants from now on.
struct WatchMessage {
  static constexpr std::string_view kType = "watch";
  std::vector<std::string> cameras;
};
template <typename V>
void describe(V& v, WatchMessage& m) {
  v.type("WatchMessage",
         "from a paired client: the pictures of these come from now on, and of no others; `[]`: none. A name that is "
         "none of `welcome.cameras` is refused with `unknown`, and nothing changes");
  v.add("cameras", "", "names", m.cameras, sized(0, 32));
}

struct PingMessage {
  static constexpr std::string_view kType = "ping";
  double t = 0.0;      ///< s, the client's clock, now
  double echo = -1.0;  ///< s, `now_s` of the newest state that the client has; negative: none
  double held = 0.0;   ///< s, since the client got that state
};
template <typename V>
void describe(V& v, PingMessage& m) {
  v.type("PingMessage", "answered with `pong`");
  v.add("t_s", "s", "the client's clock, now", m.t, within(-kLongest, kLongest));
  v.add("echo_s", "s", "`now_s` of the newest `pong` or `state`", m.echo, within(-kLongest, kLongest).or_absent());
  v.add("held_s", "s", "since that came", m.held, within(0.0, kLongest).or_absent());
}

using ClientMessage =
    std::variant<HelloMessage, PairMessage, TakeMessage, ReleaseMessage, AskMessage, AnswerMessage, SampleMessage,
                 RequestMessage, StudyMessage, ReplyMessage, PolicyMessage, TargetMessage, WatchMessage, PingMessage>;

/// Errors: not JSON, an unknown type, a member that is missing, unknown, of the wrong kind, not finite or out of range.
/// The message names it. Never throws, for any bytes.
Result<ClientMessage> parse_client_message(std::string_view text);

/// Why a client's message was not obeyed.
enum class Refusal { kMalformed, kVersion, kUnpaired, kCode, kNoLease, kTaken, kTooMany, kFull, kLate, kUnknown };
constexpr auto names_of(Refusal) {
  using enum Refusal;
  return named("Refusal",
               {Name{kMalformed, "malformed"}, Name{kVersion, "version"}, Name{kUnpaired, "unpaired"},
                Name{kCode, "code"}, Name{kNoLease, "no_lease"}, Name{kTaken, "taken"}, Name{kTooMany, "too_many"},
                Name{kFull, "full"}, Name{kLate, "late"}, Name{kUnknown, "unknown"}});
}

struct WelcomeMessage {
  static constexpr std::string_view kType = "welcome";
  int version = kProtocolVersion;
  std::uint64_t client = 0;
  ServerFacts facts;
};
template <typename V>
void describe(V& v, WelcomeMessage& m) {
  v.type("WelcomeMessage", "the answer to `hello`");
  v.add("version", "", "the protocol's", m.version);
  v.add("client", "", "your number", m.client);
  describe(v, m.facts);
}

struct CellMessage {
  static constexpr std::string_view kType = "cell";
  RawJson<std::string_view> cell;  ///< as ServerFacts::cell
};
template <typename V>
void describe(V& v, CellMessage& m) {
  v.type("CellMessage", "it has changed");
  v.add("cell", "", "as in `welcome`", m.cell, known_as("Cell"));
}

struct CamerasMessage {
  static constexpr std::string_view kType = "cameras";
  std::vector<std::string> ended;  ///< as OperatorView::cameras_ended
};
template <typename V>
void describe(V& v, CamerasMessage& m) {
  v.type("CamerasMessage", "at each change, and to clients that connect later");
  v.add("ended", "", "for each camera why no more pictures come, `\"\"`: they do", m.ended);
}

/// To the study's leader.
struct RepliedMessage {
  static constexpr std::string_view kType = ReplyMessage::kType;
  std::uint64_t client = 0;
  RawJson<std::string_view> content;
};
template <typename V>
void describe(V& v, RepliedMessage& m) {
  v.type("RepliedMessage", "to the program that runs the study");
  v.add("client", "", "the client that answers", m.client);
  v.add("content", "", "", m.content, known_as("StudyReply"));
}

struct PairedMessage {
  static constexpr std::string_view kType = "paired";
  std::string_view token;
};
template <typename V>
void describe(V& v, PairedMessage& m) {
  v.type("PairedMessage", "");
  v.add("token", "", "for `hello` after a reconnection", m.token);
}

/// Control as one client sees it.
struct LeaseMessage {
  static constexpr std::string_view kType = "lease";
  std::uint64_t holder = 0;  ///< client in control; 0: none
  bool yours = false;
  bool takeable = false;    ///< `take` would give it to this client
  std::uint64_t asker = 0;  ///< client that asks for it; 0: none
  /// Time until the asker gets it if the arm stays idle; none: no client asks, or the arm is engaged.
  std::optional<Time> left;
};
template <typename V>
void describe(V& v, LeaseMessage& m) {
  v.type("LeaseMessage", "at every change");
  v.add("holder", "", "a client's number, 0: none", m.holder);
  v.add("yours", "", "", m.yours);
  v.add("takeable", "", "`take` would give it to you", m.takeable);
  v.add("asker", "", "the client that asks for it, 0: none", m.asker);
  v.add("grant_s", "s",
        "until `asker` gets it, if nothing moves the arm; null: no client asks, or something moves it now", m.left,
        at_least(0.0).or_null().formatted("{:.2f}"));
}

/// To every client: this client asked for a stop.
struct StoppedMessage {
  static constexpr std::string_view kType = "stopped";
  std::uint64_t client = 0;
};
template <typename V>
void describe(V& v, StoppedMessage& m) {
  v.type("StoppedMessage", "a client asked for a stop; to all clients, ten a second at most");
  v.add("client", "", "the client that asked for it", m.client);
}

struct PongMessage {
  static constexpr std::string_view kType = "pong";
  double t = 0.0;  ///< s, of the ping
  Time now{0};
};
template <typename V>
void describe(V& v, PongMessage& m) {
  v.type("PongMessage", "the answer to `ping`");
  v.add("t_s", "s", "from the ping", m.t, Limits{}.formatted("{:.9g}"));
  v.add("now_s", "s", "the session's clock", m.now);
}

struct ErrorMessage {
  static constexpr std::string_view kType = "error";
  Refusal code = Refusal::kUnknown;
  std::string_view message;
};
template <typename V>
void describe(V& v, ErrorMessage& m) {
  v.type("ErrorMessage", "");
  v.add("code", "", "", m.code);
  v.add("message", "", "for people: show it", m.message);
}

/// The server's messages, except camera frames.
using ServerMessage =
    std::variant<WelcomeMessage, OperatorView, CellMessage, CamerasMessage, StudyMessage, RepliedMessage, PairedMessage,
                 LeaseMessage, StoppedMessage, PongMessage, ErrorMessage>;

/// A message as JSON, in six digits. Numbers that are not finite become null. Allocates only the result.
template <typename Message>
std::string to_json(const Message& message) {
  JsonBuffer out;
  JsonOut<BriefStyle> json(out);
  json.json().begin_object();
  json.json().member("type", Message::kType);
  json.members(message);
  json.json().end_object();
  return out;
}

/// A camera frame for the clients that watch it: not JSON, see docs/reference/protocol.md.
std::string picture_message(const VideoPacket& packet);

}  // namespace steadyhand

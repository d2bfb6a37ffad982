#include "steadyhand/desk/messages.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "steadyhand/core/json_writer.hpp"
#include "steadyhand/core/text.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;
using RequestKind = OperatorRequest::Kind;

// A hand that is further away than this, or a clock that far from its zero, is a mistake.
constexpr double kFarthest = 1000.0;   // m
constexpr double kLongest = 1e9;       // s
constexpr double kLargestValue = 1e6;  // of a request: weights, scale, yaw, rate
constexpr double kNormTolerance = 1e-3;
constexpr double kLongestLookAhead = 0.1;  // s

/// Reads an object's members one by one; the first mistake stays, and `finish` refuses members that nobody asked for.
class Reader {
 public:
  explicit Reader(const Json& object) : object_(object) {}

  const Json* member(const char* key, bool required = true) {
    const auto found = object_.find(key);
    if (found == object_.end()) {
      if (required) fail(fmt::format("'{}' is missing", key));
      return nullptr;
    }
    ++used_;
    return &*found;
  }

  double number(const Json& value, const char* key, double low, double high) {
    if (!value.is_number()) {
      fail(fmt::format("'{}' must be a number", key));
      return 0.0;
    }
    const double x = value.get<double>();
    if (!(x >= low && x <= high)) fail(fmt::format("'{}' must be within {:g} and {:g}, not {:g}", key, low, high, x));
    return x;
  }

  double number(const char* key, double low, double high) {
    const Json* value = member(key);
    return value ? number(*value, key, low, high) : 0.0;
  }

  double number_or(const char* key, double low, double high, double otherwise) {
    const Json* value = member(key, false);
    return value ? number(*value, key, low, high) : otherwise;
  }

  std::uint64_t count(const char* key) {
    const Json* value = member(key);
    if (value && !value->is_number_unsigned()) fail(fmt::format("'{}' must be a whole number >= 0", key));
    return value && !error_ ? value->get<std::uint64_t>() : 0;
  }

  bool flag(const char* key) {
    const Json* value = member(key);
    if (value && !value->is_boolean()) fail(fmt::format("'{}' must be true or false", key));
    return value && !error_ && value->get<bool>();
  }

  std::string text(const char* key, std::size_t longest, bool required = true) {
    const Json* value = member(key, required);
    if (value && !value->is_string()) fail(fmt::format("'{}' must be text", key));
    if (!value || error_) return {};
    const auto& text = value->get_ref<const std::string&>();
    if (text.size() > longest) fail(fmt::format("'{}' is longer than {} bytes", key, longest));
    return error_ ? std::string() : text;
  }

  template <std::size_t N>
  std::array<double, N> numbers(const char* key, double bound) {
    std::array<double, N> numbers{};
    const Json* value = member(key);
    if (!value) return numbers;
    if (!value->is_array() || value->size() != N) {
      fail(fmt::format("'{}' must be a list of {} numbers", key, N));
      return numbers;
    }
    for (std::size_t i = 0; i < N; ++i) numbers[i] = number((*value)[i], key, -bound, bound);
    return numbers;
  }

  void fail(std::string message) {
    if (!error_) error_ = Error{std::move(message)};
  }

  /// The member that was read last is to be read once more.
  void again() { used_ -= used_ > 0; }
  bool has(const char* key) const { return object_.contains(key); }
  bool failed() const { return error_.has_value(); }

  /// @param known members that were read elsewhere: `type`
  std::optional<Error> finish(std::size_t known = 1) {
    if (!error_ && used_ + known != object_.size()) {
      error_ =
          Error{fmt::format("{} member(s) that this type of message does not have", object_.size() - used_ - known)};
    }
    return error_;
  }

 private:
  const Json& object_;
  std::size_t used_ = 0;
  std::optional<Error> error_;
};

Pose read_pose(Reader& reader) {
  const auto p = reader.numbers<3>("p", kFarthest);
  const auto q = reader.numbers<4>("q", 2.0);
  const Quaternion orientation(q[3], q[0], q[1], q[2]);
  const double norm = orientation.norm();
  if (!(std::abs(norm - 1.0) <= kNormTolerance)) {
    reader.fail(fmt::format("'q' must be a unit quaternion x, y, z, w; its norm is {:g}", norm));
  }
  return {{p[0], p[1], p[2]}, orientation.normalized()};
}

SampleMessage read_sample(Reader& reader) {
  SampleMessage message;
  message.sequence = reader.count("sequence");
  message.t = reader.number("t_s", -kLongest, kLongest);
  message.sample.X_operator_hand = read_pose(reader);
  message.sample.clutch = reader.flag("clutch");
  message.sample.tracked = reader.flag("tracked");
  message.sample.emulated = reader.flag("emulated");
  if (reader.has("gripper")) message.sample.gripper = reader.number("gripper", 0.0, 1.0);
  message.sample.look_ahead = from_seconds(reader.number_or("lead_s", 0.0, kLongestLookAhead, 0.0));
  return message;
}

/// Numbers, or null where the policy has none.
TargetMessage read_target(Reader& reader) {
  TargetMessage message;
  message.of = reader.number("of_s", -kLongest, kLongest);
  const Json* p = reader.member("p");
  if (p && p->is_null()) {
    const Json* q = reader.member("q");
    if (q && !q->is_null()) reader.fail("'q' must be null where 'p' is");
    message.target.X_base_tool.p.setConstant(std::numeric_limits<double>::quiet_NaN());
  } else {
    reader.again();
    message.target.X_base_tool = read_pose(reader);
  }
  if (reader.has("gripper")) message.target.gripper = reader.number("gripper", 0.0, 1.0);
  return message;
}

PolicyMessage read_policy(Reader& reader) {
  PolicyMessage message;
  message.policy.name = reader.text("name", 64);
  if (!is_name(message.policy.name)) reader.fail("'name' must be text without control characters");
  message.policy.period = reader.number("period_s", PolicyHand::kFastest, PolicyHand::kSlowest);
  return message;
}

struct RequestName {
  const char* name;
  RequestKind kind;
  bool text;   // takes 'text'
  bool value;  // takes 'value'
};

/// Where an object stands and how large it is.
CellObject read_object(const Json& json, const std::string& name, Reader& outer) {
  CellObject object;
  object.name = name;
  Reader reader(json);
  const std::string shape = reader.text("shape", 16);
  const auto size = [&](const char* key) { return reader.number(key, 0.0, kFarthest); };
  if (shape == "sphere") {
    object.shape = Shape::sphere(size("radius"));
  } else if (shape == "capsule" || shape == "cylinder") {
    const double radius = size("radius"), half = 0.5 * size("length");
    object.shape = shape == "capsule" ? Shape::capsule(half, radius) : Shape::cylinder(radius, half);
  } else if (shape == "box") {
    const auto sizes = reader.numbers<3>("size", kFarthest);
    const double rounding = reader.number_or("rounding", 0.0, kFarthest, 0.0);
    object.shape = Shape::box(0.5 * Vector3(sizes[0], sizes[1], sizes[2]) - Vector3::Constant(rounding), rounding);
  } else if (shape == "half_space") {
    object.shape = Shape::half_space();
  } else {
    reader.fail("'shape' must be sphere, capsule, cylinder, box or half_space");
  }
  const Pose pose = read_pose(reader);
  object.origin = Eigen::Translation3d(pose.p) * pose.q;
  if (reader.has("velocity")) {
    const auto velocity = reader.numbers<3>("velocity", kFarthest);
    object.velocity = {velocity[0], velocity[1], velocity[2]};
  }
  object.margin = reader.number_or("margin", 0.0, 1.0, object.margin);
  const Status good = check(object.shape);
  if (!reader.failed() && !good) reader.fail(good.error().message);
  if (auto error = reader.finish(0)) outer.fail("object: " + error->message);
  return object;
}
constexpr RequestName kRequests[] = {
    {"stop", RequestKind::kStop, false, false},      {"reset", RequestKind::kReset, false, false},
    {"profile", RequestKind::kProfile, true, false}, {"weight", RequestKind::kWeight, true, true},
    {"scale", RequestKind::kScale, false, true},     {"yaw", RequestKind::kYaw, false, true},
    {"tilt", RequestKind::kTilt, false, true},       {"fill", RequestKind::kFill, false, true},
    {"rate", RequestKind::kRate, false, true},       {"playback", RequestKind::kPlayback, true, false},
    {"record", RequestKind::kRecord, false, true},   {"object", RequestKind::kObject, true, false},
    {"attach", RequestKind::kAttach, true, false},   {"detach", RequestKind::kDetach, true, false},
    {"label", RequestKind::kLabel, true, false},     {"rename", RequestKind::kRename, true, false},
    {"delete", RequestKind::kDelete, true, false},   {"latency", RequestKind::kLatency, false, true},
    {"episode", RequestKind::kEpisode, true, false}, {"set_up", RequestKind::kSetUp, false, false},
    {"policy", RequestKind::kPolicy, false, true},   {"refill", RequestKind::kRefill, false, false},
};

/// What is said of an episode, beside its kind.
EpisodeMark read_episode(Reader& reader, const std::string& kind) {
  EpisodeMark mark;
  if (const auto known = find_episode_kind(kind)) {
    mark.kind = *known;
  } else {
    reader.fail("'text' must be begin, keep, discard or mark");
  }
  if (reader.has("success")) mark.success = reader.flag("success");
  mark.task = reader.text("task", 256, false);
  mark.notes = reader.text("notes", 1000, false);
  if (!mark.task.empty() && !is_name(mark.task)) reader.fail("'task' must be without control characters");
  return mark;
}

/// JSON that is handed on.
std::string read_content(Reader& reader, bool may_be_null) {
  const Json* content = reader.member("content");
  if (!content) return {};
  if (!content->is_object() && !(may_be_null && content->is_null())) {
    reader.fail(may_be_null ? "'content' must be an object, or null" : "'content' must be an object");
  }
  return content->dump(-1, ' ', false, Json::error_handler_t::replace);
}

RequestMessage read_request(Reader& reader) {
  RequestMessage message;
  const std::string name = reader.text("kind", 32);
  for (const RequestName& known : kRequests) {
    if (name != known.name) continue;
    message.request.kind = known.kind;
    const bool names = known.kind == RequestKind::kLabel || known.kind == RequestKind::kRename;
    const bool of_session = names || known.kind == RequestKind::kDelete;
    if (known.text) message.request.text = reader.text("text", of_session ? 128 : 64);
    if (names) message.request.to = reader.text("to", 128);
    if (known.kind == RequestKind::kLabel && !message.request.to.empty() && !is_name(message.request.to)) {
      reader.fail("'to' must be without control characters");
    }
    if (known.kind == RequestKind::kEpisode) message.request.episode = read_episode(reader, message.request.text);
    if (known.kind == RequestKind::kSetUp) message.request.value = reader.number_or("value", 0.0, kLargestValue, -1.0);
    if (known.value) {
      const bool sign = known.kind == RequestKind::kYaw;
      message.request.value = reader.number("value", sign ? -kLargestValue : 0.0, kLargestValue);
    }
    const bool carries = known.kind == RequestKind::kAttach || known.kind == RequestKind::kDetach;
    if ((carries || known.kind == RequestKind::kObject) && !is_name(message.request.text))
      reader.fail("'text' must be the object's name, without control characters");
    if (known.kind == RequestKind::kObject) {
      const Json* object = reader.member("object");
      if (object && object->is_object()) {
        message.request.object = read_object(*object, message.request.text, reader);
      } else if (object && !object->is_null()) {
        reader.fail("'object' must be an object, or null: no longer there");
      }
    }
    return message;
  }
  reader.fail(
      "'kind' must be one of stop, reset, profile, weight, scale, yaw, "
      "tilt, fill, rate, playback, record, object, attach, detach, label, rename, delete, "
      "latency, episode, set_up, policy, refill");
  return message;
}

template <typename Message>
Result<ClientMessage> finished(Reader& reader, Message message) {
  if (auto error = reader.finish()) return *error;
  return ClientMessage(std::move(message));
}

// ---- what the server says

/// One message.
class Message {
 public:
  explicit Message(std::string_view type) : json_(out_, JsonWriter::Digits::kSix) {
    json_.begin_object();
    json_.member("type", type);
  }
  JsonWriter* operator->() { return &json_; }
  void pose(std::string_view key, const Pose& X) {
    json_.key(key);
    json_.begin_object();
    json_.member("p", X.p);
    json_.member("q", X.q.coeffs());  // x, y, z, w
    json_.end_object();
  }
  void timing(std::string_view key, const TimingSummary& t) {
    json_.key(key);
    json_.begin_object();
    json_.member("p50", t.p50);
    json_.member("p99", t.p99);
    json_.member("p999", t.p999);
    json_.member("max", t.max);
    json_.end_object();
  }
  /// s, in so many digits behind the point: times grow.
  void seconds(std::string_view key, double s, int digits = 6) {
    json_.key(key);
    json_.raw(fmt::format("{:.{}f}", s, digits));
  }
  std::string end() {
    json_.end_object();
    return fmt::to_string(out_);
  }

 private:
  JsonBuffer out_;
  JsonWriter json_;
};

std::string_view name_of(Refusal refusal) {
  switch (refusal) {
    case Refusal::kMalformed:
      return "malformed";
    case Refusal::kVersion:
      return "version";
    case Refusal::kUnpaired:
      return "unpaired";
    case Refusal::kCode:
      return "code";
    case Refusal::kNoLease:
      return "no_lease";
    case Refusal::kTaken:
      return "taken";
    case Refusal::kTooMany:
      return "too_many";
    case Refusal::kFull:
      return "full";
    case Refusal::kLate:
      return "late";
    case Refusal::kUnknown:
      return "unknown";
  }
  return "malformed";
}

}  // namespace

Result<ClientMessage> parse_client_message(std::string_view text) {
  if (text.size() > kMaxClientMessage) return Error{fmt::format("a message has at most {} bytes", kMaxClientMessage)};
  const Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_discarded()) return Error{"not JSON, or a number that no double holds"};
  if (!json.is_object()) return Error{"a message must be a JSON object"};
  const auto type = json.find("type");
  if (type == json.end() || !type->is_string()) return Error{"'type' must be text"};
  const auto& name = type->get_ref<const std::string&>();
  Reader reader(json);
  if (name == "sample") return finished(reader, read_sample(reader));
  if (name == "request") return finished(reader, read_request(reader));
  if (name == "take") return finished(reader, LeaseMessage{LeaseMessage::Wish::kTake});
  if (name == "release") return finished(reader, LeaseMessage{LeaseMessage::Wish::kRelease});
  if (name == "ask") return finished(reader, LeaseMessage{LeaseMessage::Wish::kAsk});
  if (name == "answer") return finished(reader, AnswerMessage{reader.flag("grant")});
  if (name == "pair") return finished(reader, PairMessage{reader.text("code", 64)});
  if (name == "hello") {
    const int version = static_cast<int>(reader.number("version", 0, 1e6));
    // What else another version says cannot be known.
    if (!reader.failed() && version != kProtocolVersion) return ClientMessage(HelloMessage{version, {}});
    return finished(reader, HelloMessage{version, reader.text("token", 64, false)});
  }
  if (name == "ping") {
    const double t = reader.number("t_s", -kLongest, kLongest);
    const double echo = reader.number_or("echo_s", -kLongest, kLongest, -1.0);
    return finished(reader, PingMessage{t, echo, reader.number_or("held_s", 0.0, kLongest, 0.0)});
  }
  if (name == "study") return finished(reader, StudyMessage{read_content(reader, true)});
  if (name == "reply") return finished(reader, ReplyMessage{read_content(reader, false)});
  if (name == "policy") return finished(reader, read_policy(reader));
  if (name == "target") return finished(reader, read_target(reader));
  return Error{
      "'type' must be one of hello, pair, take, release, ask, answer, "
      "sample, request, ping, study, reply, policy, target"};
}

std::string welcome_message(const ServerFacts& facts, std::string_view cell, std::uint64_t client) {
  Message json("welcome");
  json->member("version", kProtocolVersion);
  json->member("client", client);
  json->member("program", facts.version);
  json->key("terms");
  json->begin_array();
  for (const ServerFacts::Term& term : facts.terms) {
    json->begin_object();
    json->member("name", term.name);
    json->member("label", term.label);
    json->member("unit", term.unit);
    json->member("count", term.count);
    json->key("range");
    json->begin_object();
    json->member("min", term.min);
    json->member("max", term.max);
    json->member("logarithmic", term.logarithmic);
    json->end_object();
    json->member("offered", term.offered);
    json->end_object();
  }
  json->end_array();
  json->key("profiles");
  json->begin_array();
  for (std::size_t i = 0; i < facts.profiles.size(); ++i) {
    json->begin_object();
    json->member("index", i);
    json->member("name", facts.profiles[i].name);
    json->member("label", facts.profiles[i].label);
    json->member("weights", facts.profiles[i].weights);
    json->end_object();
  }
  json->end_array();
  json->member("recordings", facts.recordings);
  json->key("glass");
  json->begin_object();
  json->member("radius", facts.glass.radius);
  json->member("height", facts.glass.height);
  json->member("fill", facts.glass.fill);
  json->end_object();
  json->key("task");
  if (facts.task) {
    json->begin_object();
    json->member("name", facts.task->name);
    json->member("instruction", facts.task->instruction);
    json->member("time_limit", facts.task->time_limit);
    json->member("conditions", facts.task->conditions);
    json->member("things", facts.task->things);
    json->end_object();
  } else {
    json->raw("null");
  }
  json->key("cell");
  json->raw(cell.empty() ? "null" : cell);
  json->key("robot");
  json->raw(facts.robot.empty() ? "null" : facts.robot);
  return json.end();
}

std::string cell_message(std::string_view cell) {
  Message json("cell");
  json->key("cell");
  json->raw(cell);
  return json.end();
}

std::string paired_message(std::string_view token) {
  Message json("paired");
  json->member("token", token);
  return json.end();
}

std::string study_message(std::string_view content) {
  Message json("study");
  json->key("content");
  json->raw(content);
  return json.end();
}

std::string reply_message(std::string_view content, std::uint64_t client) {
  Message json("reply");
  json->member("client", client);
  json->key("content");
  json->raw(content);
  return json.end();
}

std::string lease_message(const LeaseView& lease) {
  Message json("lease");
  json->member("holder", lease.holder);
  json->member("yours", lease.yours);
  json->member("takeable", lease.takeable);
  json->member("asker", lease.asker);
  if (lease.left) {
    json.seconds("grant_s", to_seconds(*lease.left), 2);
  } else {
    json->key("grant_s");
    json->raw("null");
  }
  return json.end();
}

std::string pong_message(double t, Time now) {
  Message json("pong");
  json->key("t_s");
  json->raw(fmt::format("{:.9g}", t));
  json.seconds("now_s", to_seconds(now));
  return json.end();
}

std::string error_message(Refusal refusal, std::string_view message) {
  Message json("error");
  json->member("code", name_of(refusal));
  json->member("message", message);
  return json.end();
}

std::string state_message(const OperatorView& s) {
  Message json("state");
  json.seconds("now_s", to_seconds(s.now));
  json->member("state", to_string(s.state));
  json->member("reason", s.reason);
  json->key("constraint");
  json->begin_object();
  json->member("kind", to_string(s.constraint.kind));
  json->member("first", s.constraint.first);
  json->member("second", s.constraint.second);
  json->end_object();
  json->member("q", s.measured.q);
  json->member("dq", s.measured.dq);
  json->member("command", s.command.q);
  json->member("gripper", s.measured.gripper.value_or(std::numeric_limits<double>::quiet_NaN()));
  json->member("gripper_command", s.command.gripper.value_or(std::numeric_limits<double>::quiet_NaN()));
  json.pose("tool", s.X_base_tool);
  json.pose("target", s.target.X_base_tool);
  json->member("engaged", s.target.engaged);
  json->key("leader");
  const bool led = s.state == SupervisionState::kEngaged || s.state == SupervisionState::kHolding;
  json->raw(led ? fmt::format("\"{}\"", to_string(s.target.leader)) : "null");
  json->member("local_acceleration", s.local_acceleration);
  json->member("tracking_error", s.tracking_error);
  json->member("clearance", s.clearance);
  json->member("nearest", s.nearest);
  json->key("path");
  json->begin_array();
  for (int k = 0; k < s.path_nodes && k < static_cast<int>(s.path.size()); ++k) {
    json->value(s.path[static_cast<std::size_t>(k)].p);
  }
  json->end_array();
  json->key("prediction");
  json->begin_array();
  for (int k = 0; k < s.prediction.nodes; ++k) {
    const Vector3& p = s.prediction.p[k];
    const Spread& spread = s.prediction.spread[k];
    json->value(std::array{p.x(), p.y(), p.z(), spread.along, spread.across});
  }
  json->end_array();
  json->key("liquid");
  json->begin_object();
  json->member("tilt", std::array{s.liquid.tilt_x, s.liquid.tilt_y});
  json->member("freeboard", s.liquid.freeboard);
  json->member("spilled", s.liquid.spilled);
  json->member("spilled_share", s.liquid.spilled_share);
  json->member("least_freeboard", s.liquid.least_freeboard);
  json->member("lateral", s.liquid.lateral);
  json->end_object();
  json.timing("solve_us", s.solve_us);
  json.timing("latency_us", s.latency_us);
  json->member("plans", s.plans);
  json->member("cycles", s.cycles);
  json->member("missed_deadlines", s.missed_deadlines);
  json->member("rejected_plans", s.rejected_plans);
  json->member("samples", s.samples);
  json->member("planner_rate_hz", s.planner_rate_hz);
  json->member("recording", s.recording);
  const auto decided = [&](const std::optional<bool>& success) {
    json->key("success");
    json->raw(!success ? "null" : *success ? "true" : "false");
  };
  json->key("task");
  if (s.task) {
    json->begin_object();
    json->member("time", s.task->time);
    json->member("held", s.task->held);
    json->member("spilled", s.task->spilled);
    decided(s.task->success);
    json->key("things");
    json->begin_array();
    for (int i = 0; i < s.scene.things; ++i) {
      const Pose& at = s.scene.thing[static_cast<std::size_t>(i)].X_base_thing;
      json->value(std::array{at.p.x(), at.p.y(), at.p.z(), at.q.x(), at.q.y(), at.q.z(), at.q.w()});
    }
    json->end_array();
    json->end_object();
  } else {
    json->raw("null");
  }
  json->key("episode");
  json->begin_object();
  json->member("running", s.episode.running);
  json->member("number", s.episode.number);
  json->member("time", s.episode.time);
  json->member("kept", s.episode.kept);
  json->member("discarded", s.episode.discarded);
  decided(s.episode.success);
  json->end_object();
  json->key("controls");
  json->begin_object();
  json->member("profile", s.controls.profile);
  json->member("playback", s.controls.playback);
  json->member("policy", s.controls.policy);
  json->member("policy_turn", s.controls.policy_turn);
  json->member("weights", std::span(s.controls.weights).first(static_cast<std::size_t>(s.controls.objectives)));
  json->member("scale", s.controls.scale);
  json->member("yaw", s.controls.yaw);
  json->member("tilt", s.controls.tilt);
  json->member("fill", s.controls.fill);
  json->member("no_spill", s.controls.no_spill);
  json->member("latency", s.controls.latency);
  json->end_object();
  return json.end();
}

}  // namespace steadyhand

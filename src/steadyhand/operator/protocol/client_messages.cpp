#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "steadyhand/core/text.hpp"
#include "steadyhand/operator/protocol/page_messages.hpp"

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

  /// Without control characters: it may be shown on a terminal, or become a name.
  std::string text(const char* key, std::size_t longest, bool required = true) {
    std::string text = prose(key, longest, required);
    if (!text.empty() && !is_name(text)) fail(fmt::format("'{}' must be without control characters", key));
    return text;
  }

  /// What people wrote, of as many lines as they like.
  std::string prose(const char* key, std::size_t longest, bool required = true) {
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
  if (!is_name(message.policy.name)) reader.fail("'name' must not be empty");
  message.policy.period = reader.number("period_s", PolicyHand::kFastest, PolicyHand::kSlowest);
  return message;
}

WatchMessage read_watch(Reader& reader) {
  WatchMessage message;
  const Json* names = reader.member("cameras");
  const bool is_list = names && names->is_array() && names->size() <= WatchMessage::kMost &&
                       std::all_of(names->begin(), names->end(), [](const Json& name) { return name.is_string(); });
  if (is_list) {
    message.cameras = names->get<std::vector<std::string>>();
  } else {
    reader.fail(fmt::format("'cameras' must be a list of at most {} names", WatchMessage::kMost));
  }
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
  if (const auto known = find_name<EpisodeMark::Kind>(kind)) {
    mark.kind = *known;
  } else {
    reader.fail("'text' must be begin, keep, discard or mark");
  }
  if (reader.has("success")) mark.success = reader.flag("success");
  mark.task = reader.text("task", 256, false);
  mark.notes = reader.prose("notes", 1000, false);
  return mark;
}

/// Other members of a stop are ignored: a mistake there must not keep the arm moving.
bool is_stop(const Json& json) {
  const auto is = [&](const char* key, const char* value) {
    const auto found = json.find(key);
    return found != json.end() && *found == value;
  };
  return is("type", "request") && is("kind", "stop");
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
    if (known.kind == RequestKind::kEpisode) message.request.episode = read_episode(reader, message.request.text);
    if (known.kind == RequestKind::kSetUp) message.request.value = reader.number_or("value", 0.0, kLargestValue, -1.0);
    if (known.value) {
      const bool sign = known.kind == RequestKind::kYaw;
      message.request.value = reader.number("value", sign ? -kLargestValue : 0.0, kLargestValue);
    }
    const bool carries = known.kind == RequestKind::kAttach || known.kind == RequestKind::kDetach;
    if ((carries || known.kind == RequestKind::kObject) && !is_name(message.request.text))
      reader.fail("'text' must be the object's name");
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

}  // namespace

Result<ClientMessage> parse_client_message(std::string_view text) {
  if (text.size() > kMaxClientMessage) return Error{fmt::format("a message has at most {} bytes", kMaxClientMessage)};
  const Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_discarded()) return Error{"not JSON, or a number that no double holds"};
  if (!json.is_object()) return Error{"a message must be a JSON object"};
  const auto type = json.find("type");
  if (type == json.end() || !type->is_string()) return Error{"'type' must be text"};
  const auto& name = type->get_ref<const std::string&>();
  if (is_stop(json)) return ClientMessage(RequestMessage{});
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
  if (name == "watch") return finished(reader, read_watch(reader));
  if (name == "policy") return finished(reader, read_policy(reader));
  if (name == "target") return finished(reader, read_target(reader));
  return Error{
      "'type' must be one of hello, pair, take, release, ask, answer, "
      "sample, request, ping, study, reply, policy, target, watch"};
}

}  // namespace steadyhand

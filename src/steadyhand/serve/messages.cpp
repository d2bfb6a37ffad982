#include "steadyhand/serve/messages.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

namespace steadyhand {
namespace {

using Json = nlohmann::json;
using Kind = OperatorRequest::Kind;

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

  bool failed() const { return error_.has_value(); }

  /// `type` counts as used.
  std::optional<Error> finish() {
    if (!error_ && used_ + 1 != object_.size()) {
      error_ = Error{fmt::format("{} member(s) that this type of message does not have", object_.size() - used_ - 1)};
    }
    return error_;
  }

 private:
  const Json& object_;
  std::size_t used_ = 0;
  std::optional<Error> error_;
};

SampleMessage read_sample(Reader& reader) {
  SampleMessage message;
  message.sequence = reader.count("sequence");
  message.t = reader.number("t_s", -kLongest, kLongest);
  const auto p = reader.numbers<3>("p", kFarthest);
  const auto q = reader.numbers<4>("q", 2.0);
  message.sample.X_operator_hand.p = {p[0], p[1], p[2]};
  const Quaternion orientation(q[3], q[0], q[1], q[2]);
  const double norm = orientation.norm();
  if (!(std::abs(norm - 1.0) <= kNormTolerance)) {
    reader.fail(fmt::format("'q' must be a unit quaternion x, y, z, w; its norm is {:g}", norm));
  }
  message.sample.X_operator_hand.q = orientation.normalized();
  message.sample.clutch = reader.flag("clutch");
  message.sample.tracked = reader.flag("tracked");
  message.sample.emulated = reader.flag("emulated");
  message.sample.look_ahead = from_seconds(reader.number_or("lead_s", 0.0, kLongestLookAhead, 0.0));
  return message;
}

struct RequestName {
  const char* name;
  Kind kind;
  bool text;   // takes 'text'
  bool value;  // takes 'value'
};
constexpr RequestName kRequests[] = {
    {"stop", Kind::kStop, false, false},      {"reset", Kind::kReset, false, false},
    {"profile", Kind::kProfile, true, false}, {"weight", Kind::kWeight, true, true},
    {"scale", Kind::kScale, false, true},     {"yaw", Kind::kYaw, false, true},
    {"rate", Kind::kRate, false, true},       {"playback", Kind::kPlayback, true, false},
    {"record", Kind::kRecord, false, true},
};

RequestMessage read_request(Reader& reader) {
  RequestMessage message;
  const std::string name = reader.text("kind", 32);
  for (const RequestName& known : kRequests) {
    if (name != known.name) continue;
    message.request.kind = known.kind;
    if (known.text) message.request.text = reader.text("text", 64);
    if (known.value) {
      const bool sign = known.kind == Kind::kYaw;
      message.request.value = reader.number("value", sign ? -kLargestValue : 0.0, kLargestValue);
    }
    return message;
  }
  reader.fail("'kind' must be one of stop, reset, profile, weight, scale, yaw, rate, playback, record");
  return message;
}

template <typename Message>
Result<ClientMessage> finished(Reader& reader, Message message) {
  if (auto error = reader.finish()) return *error;
  return ClientMessage(std::move(message));
}

// ---- what the server says

using Buffer = fmt::memory_buffer;

void append(Buffer& out, std::string_view text) { out.append(text.data(), text.data() + text.size()); }

void append_number(Buffer& out, double value) {
  if (std::isfinite(value)) {
    fmt::format_to(std::back_inserter(out), "{:.6g}", value);
  } else {
    append(out, "null");
  }
}

template <typename Vector>
void append_vector(Buffer& out, const Vector& v) {
  out.push_back('[');
  for (int i = 0; i < static_cast<int>(v.size()); ++i) {
    if (i > 0) out.push_back(',');
    append_number(out, v[i]);
  }
  out.push_back(']');
}

void append_key(Buffer& out, std::string_view key) {
  append(out, ",\"");
  append(out, key);
  append(out, "\":");
}

template <typename Vector>
void append_vector(Buffer& out, std::string_view key, const Vector& v) {
  append_key(out, key);
  append_vector(out, v);
}

void append_number(Buffer& out, std::string_view key, double value) {
  append_key(out, key);
  append_number(out, value);
}

void append_count(Buffer& out, std::string_view key, std::uint64_t value) {
  append_key(out, key);
  fmt::format_to(std::back_inserter(out), "{}", value);
}

void append_flag(Buffer& out, std::string_view key, bool value) {
  append_key(out, key);
  append(out, value ? "true" : "false");
}

void append_text(Buffer& out, std::string_view key, std::string_view text) {
  append_key(out, key);
  // dump() quotes, escapes, and replaces bytes that are not UTF-8.
  append(out, Json(text).dump(-1, ' ', false, Json::error_handler_t::replace));
}

void append_pose(Buffer& out, std::string_view key, const Pose& X) {
  append_key(out, key);
  append(out, "{\"p\":");
  append_vector(out, X.p);
  append(out, ",\"q\":");
  append_vector(out, X.q.coeffs());  // x, y, z, w
  out.push_back('}');
}

void append_timing(Buffer& out, std::string_view key, const TimingSummary& t) {
  append_key(out, key);
  append(out, "{\"p50\":");
  append_number(out, t.p50);
  append_number(out, "p99", t.p99);
  append_number(out, "p999", t.p999);
  append_number(out, "max", t.max);
  out.push_back('}');
}

void append_time(Buffer& out, std::string_view key, Time t) {
  append_key(out, key);
  fmt::format_to(std::back_inserter(out), "{:.6f}", to_seconds(t));
}

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

std::string finish(Buffer& out) {
  out.push_back('}');
  return {out.data(), out.size()};
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
  return Error{"'type' must be one of hello, pair, take, release, ask, answer, sample, request, ping"};
}

std::string welcome_message(const ServerFacts& facts, std::uint64_t client) {
  Buffer out;
  append(out, "{\"type\":\"welcome\"");
  append_count(out, "version", kProtocolVersion);
  append_count(out, "client", client);
  append_text(out, "program", facts.version);
  append(out, ",\"terms\":[");
  for (std::size_t i = 0; i < facts.terms.size(); ++i) {
    const auto& term = facts.terms[i];
    append(out, i > 0 ? ",{\"count\":" : "{\"count\":");
    fmt::format_to(std::back_inserter(out), "{}", term.count);
    append_text(out, "name", term.name);
    append_text(out, "label", term.label);
    append_text(out, "unit", term.unit);
    append(out, ",\"range\":{\"min\":");
    append_number(out, term.min);
    append_number(out, "max", term.max);
    append_flag(out, "logarithmic", term.logarithmic);
    out.push_back('}');
    append_flag(out, "offered", term.offered);
    out.push_back('}');
  }
  append(out, "],\"profiles\":[");
  for (std::size_t i = 0; i < facts.profiles.size(); ++i) {
    const auto& profile = facts.profiles[i];
    append(out, i > 0 ? ",{\"index\":" : "{\"index\":");
    fmt::format_to(std::back_inserter(out), "{}", i);
    append_text(out, "name", profile.name);
    append_text(out, "label", profile.label);
    append_vector(out, "weights", profile.weights);
    out.push_back('}');
  }
  append(out, "],\"recordings\":");
  append(out, Json(facts.recordings).dump(-1, ' ', false, Json::error_handler_t::replace));
  append(out, ",\"glass\":");
  append(out, Json{{"radius", facts.glass.radius}, {"height", facts.glass.height}, {"fill", facts.glass.fill}}.dump());
  append(out, ",\"robot\":");
  append(out, facts.robot.empty() ? "null" : facts.robot);
  return finish(out);
}

std::string paired_message(std::string_view token) {
  return fmt::format("{{\"type\":\"paired\",\"token\":\"{}\"}}", token);
}

std::string lease_message(const LeaseView& lease) {
  const std::string left = lease.left ? fmt::format("{:.2f}", to_seconds(*lease.left)) : "null";
  return fmt::format("{{\"type\":\"lease\",\"holder\":{},\"yours\":{},\"takeable\":{},\"asker\":{},\"grant_s\":{}}}",
                     lease.holder, lease.yours, lease.takeable, lease.asker, left);
}

std::string pong_message(double t, Time now) {
  return fmt::format("{{\"type\":\"pong\",\"t_s\":{:.9g},\"now_s\":{:.6f}}}", t, to_seconds(now));
}

std::string error_message(Refusal refusal, std::string_view message) {
  Buffer out;
  append(out, "{\"type\":\"error\"");
  append_text(out, "code", name_of(refusal));
  append_text(out, "message", message);
  return finish(out);
}

std::string state_message(const SessionSnapshot& s) {
  Buffer out;
  append(out, "{\"type\":\"state\"");
  append_time(out, "now_s", s.now);
  append_text(out, "state", to_string(s.state));
  append_text(out, "reason", s.reason);
  append(out, ",\"constraint\":{\"kind\":\"");
  append(out, to_string(s.constraint.kind));
  fmt::format_to(std::back_inserter(out), "\",\"first\":{},\"second\":{}}}", s.constraint.first, s.constraint.second);
  append_vector(out, "q", s.measured.q);
  append_vector(out, "dq", s.measured.dq);
  append_vector(out, "command", s.command.q);
  append_pose(out, "tool", s.X_base_tool);
  append_pose(out, "target", s.target.X_base_tool);
  append_flag(out, "engaged", s.target.engaged);
  append_vector(out, "local_acceleration", s.local_acceleration);
  append_number(out, "tracking_error", s.tracking_error);
  append_number(out, "clearance", s.clearance);
  append_vector(out, "nearest", s.nearest);
  append_key(out, "path");
  out.push_back('[');
  for (int k = 0; k < s.path_nodes && k < static_cast<int>(s.path.size()); ++k) {
    if (k > 0) out.push_back(',');
    append_vector(out, s.path[static_cast<std::size_t>(k)].p);
  }
  append(out, "],\"liquid\":{\"tilt\":[");
  append_number(out, s.liquid.tilt_x);
  out.push_back(',');
  append_number(out, s.liquid.tilt_y);
  out.push_back(']');
  append_number(out, "freeboard", s.liquid.freeboard);
  append_flag(out, "spilled", s.liquid.spilled);
  out.push_back('}');
  append_timing(out, "solve_us", s.solve_us);
  append_timing(out, "latency_us", s.latency_us);
  append_count(out, "plans", s.plans);
  append_count(out, "cycles", s.cycles);
  append_count(out, "missed_deadlines", s.missed_deadlines);
  append_count(out, "rejected_plans", s.rejected_plans);
  append_count(out, "samples", s.samples);
  append_number(out, "planner_rate_hz", s.planner_rate_hz);
  append_flag(out, "recording", s.recording);
  fmt::format_to(std::back_inserter(out), ",\"controls\":{{\"profile\":{},\"playback\":{}", s.controls.profile,
                 s.controls.playback);
  append_vector(out, "weights", std::span(s.controls.weights).first(std::size_t(s.controls.objectives)));
  append_number(out, "scale", s.controls.scale);
  append_number(out, "yaw", s.controls.yaw);
  out.push_back('}');
  return finish(out);
}

}  // namespace steadyhand

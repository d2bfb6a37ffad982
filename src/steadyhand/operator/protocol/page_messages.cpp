#include "steadyhand/operator/protocol/page_messages.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "steadyhand/core/json_writer.hpp"

namespace steadyhand {
namespace {

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
    return std::move(out_);
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
  json->key("cameras");
  json->begin_array();
  for (const CameraInfo& camera : facts.cameras) {
    json->begin_object();
    json->member("name", camera.name);
    json->member("width", camera.width);
    json->member("height", camera.height);
    json->member("rate_hz", camera.rate_hz);
    json->end_object();
  }
  json->end_array();
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

std::string cameras_message(const std::vector<std::string>& ended) {
  Message json("cameras");
  json->member("ended", ended);
  return json.end();
}

std::string picture_message(const VideoPacket& packet) {
  static_assert(std::endian::native == std::endian::little, "numbers of a picture's head are little-endian");
  constexpr std::size_t kHead = 16;
  const auto camera = static_cast<std::uint16_t>(packet.camera);
  const double exposed = to_seconds(packet.stamp.hand);
  std::string message(kHead, '\0');
  message[0] = 1;  // what follows is a picture
  message[1] = packet.is_key ? 1 : 0;
  std::memcpy(&message[2], &camera, sizeof(camera));
  std::memcpy(&message[8], &exposed, sizeof(exposed));
  return message += packet.data;
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

std::string stopped_message(std::uint64_t client) {
  Message json("stopped");
  json->member("client", client);
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
  json->member("reason_code", to_string(s.cause.code));
  json->member("reason_leader", to_string(s.cause.leader));
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
  json->member("planner_rate_automatic", s.planner_rate_automatic);
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
  json->member("lost", s.episode.lost);
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

#include "steadyhand/files/record/json_messages.hpp"

#include <cstdint>

#include "steadyhand/core/base64.hpp"
#include "steadyhand/files/record/cell_json.hpp"

namespace steadyhand {
namespace {

/// Foxglove's time: whole seconds (floored) and the nanoseconds on top.
void write_time(JsonWriter& json, std::string_view key, Time t) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t nanoseconds = (t.count() % kSecond + kSecond) % kSecond;
  json.key(key);
  json.begin_object();
  json.member("sec", (t.count() - nanoseconds) / kSecond);
  json.member("nsec", nanoseconds);
  json.end_object();
}

template <typename Vector>
void write_members(JsonWriter& json, const Vector& v) {
  json.member("x", v.x());
  json.member("y", v.y());
  json.member("z", v.z());
}

void write_pose(JsonWriter& json, const Vector3& p, const Quaternion& q) {
  json.begin_object();
  json.key("position");
  json.begin_object();
  write_members(json, p);
  json.end_object();
  json.key("orientation");
  json.begin_object();
  write_members(json, q);
  json.member("w", q.w());
  json.end_object();
  json.end_object();
}

void write_pose(JsonWriter& json, std::string_view key, const Pose& X) {
  json.key(key);
  write_pose(json, X.p, X.q);
}

/// One message.
class Message {
 public:
  explicit Message(JsonBuffer& out) : json_(out) { json_.begin_object(); }
  Message(JsonBuffer& out, Time t) : Message(out) { write_time(json_, "timestamp", t); }
  Message(JsonBuffer& out, Time t, std::string_view frame) : Message(out, t) { json_.member("frame_id", frame); }
  ~Message() { json_.end_object(); }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  JsonWriter* operator->() { return &json_; }
  JsonWriter& operator*() { return json_; }

 private:
  JsonWriter json_;
};

}  // namespace

void append_json(JsonBuffer& out, const OperatorSample& sample) {
  Message json(out, sample.stamp.hand, sample.leader == Leader::kPolicy ? "base" : "operator");
  write_pose(*json, "pose", sample.X_operator_hand);
  json->member("clutch", sample.clutch);
  json->member("tracked", sample.tracked);
  json->member("emulated", sample.emulated);
  json->member("lead_s", to_seconds(sample.look_ahead));
  if (sample.gripper) json->member("gripper", *sample.gripper);
  json->member("leader", to_string(sample.leader));
  json->member("intervention", sample.intervention);
}

void append_json(JsonBuffer& out, const Target& target) {
  Message json(out, target.stamp.hand, "base");
  write_pose(*json, "pose", target.X_base_tool);
  json->member("engaged", target.engaged);
  json->member("leader", to_string(target.leader));
}

void append_json(JsonBuffer& out, const Reference& reference) {
  Message json(out, reference.start, "base");
  json->key("poses");
  json->begin_array();
  for (int k = 0; k < reference.nodes; ++k) write_pose(*json, reference.p[k], Quaternion(reference.R[k]));
  json->end_array();
  json->member("dt_s", reference.dt);
  for (const auto& [key, part] : {std::pair("along_m", &Spread::along), std::pair("across_m", &Spread::across)}) {
    json->key(key);
    json->begin_array();
    for (int k = 0; k < reference.nodes; ++k) json->value(reference.spread[k].*part);
    json->end_array();
  }
}

void append_json(JsonBuffer& out, const Plan& plan, std::span<const Pose> path) {
  const int n = plan.joints;
  Message json(out, plan.start, "base");
  json->key("poses");
  json->begin_array();
  for (const Pose& X : path) write_pose(*json, X.p, X.q);
  json->end_array();
  json->member("dt_s", plan.dt);
  json->member("origin", to_string(plan.origin));
  json->key("nodes");
  json->begin_array();
  for (int k = 0; k <= plan.intervals; ++k) {
    json->begin_object();
    json->member("q", plan.x[k].head(n));
    json->member("dq", plan.x[k].tail(n));
    if (k < plan.intervals) json->member("ddq", plan.u[k]);
    json->end_object();
  }
  json->end_array();
}

void append_json(JsonBuffer& out, const JointCommand& command) {
  Message json(out, command.stamp.made);
  json->member("q", command.q);
  json->member("dq", command.dq);
  json->member("ddq", command.ddq);
  if (command.gripper) json->member("gripper", *command.gripper);
}

void append_json(JsonBuffer& out, const JointState& state) {
  Message json(out, state.stamp.made);
  json->member("q", state.q);
  json->member("dq", state.dq);
  if (state.gripper) json->member("gripper", *state.gripper);
}

void append_json(JsonBuffer& out, const PlanStep& step, const RunNames& names) {
  Message json(out, from_seconds(step.t_s));
  write_pose(*json, "target", step.X_base_target);
  write_pose(*json, "planned", step.X_base_planned);
  json->member("q", step.q);
  json->member("dq", step.dq);
  json->member("ddq", step.ddq);
  json->key("local_acceleration");
  json->begin_object();
  write_members(*json, step.local_acceleration);
  json->end_object();
  json->member("objective", step.objective);
  json->key("shares");
  json->begin_object();
  for (std::size_t i = 0; i < names.terms.size(); ++i) json->member(names.terms[i], step.shares[i]);
  json->end_object();
  json->member("iterations", step.iterations);
  json->member("status", to_string(step.status));
  json->member("solve_time_us", step.solve_time_us);
  json->member("smallest_sphere_distance_m", step.smallest_sphere_distance_m);
  json->member("engaged", step.engaged);
  json->key("object_distances_m");
  json->begin_object();
  for (const auto& [name, distance] : step.object_distances) json->member(name, distance);
  json->end_object();
}

void append_json(JsonBuffer& out, const SupervisionChange& change) {
  Message json(out, change.at);
  json->member("from", to_string(change.from));
  json->member("to", to_string(change.to));
  json->member("reason", change.reason);
  json->member("is_failure", change.is_failure);
}

void append_json(JsonBuffer& out, const SettingsChange& change) {
  Message json(out, change.at);
  json->key("weights");
  json->begin_object();
  for (const auto& [name, values] : change.weights) json->member(name, values);
  json->end_object();
  json->member("scale", change.scale);
  json->member("yaw", change.yaw);
  if (change.tilt) json->member("tilt", *change.tilt);
  if (change.no_spill) json->member("no_spill", *change.no_spill);
  if (change.fill) json->member("fill", *change.fill);
  if (change.latency) json->member("latency", *change.latency);
  if (!change.prediction.empty()) json->member("prediction", change.prediction);
  if (!change.profile.empty()) json->member("profile", change.profile);
}

void append_json(JsonBuffer& out, Time at, const LiquidState& liquid) {
  Message json(out, at);
  json->member("tilt_x", liquid.tilt_x);
  json->member("tilt_y", liquid.tilt_y);
  json->member("freeboard", liquid.freeboard);
  json->member("spilled", liquid.spilled);
  json->member("spilled_share", liquid.spilled_share);
  json->member("lateral", liquid.lateral);
}

void append_json(JsonBuffer& out, Time at, const ActiveConstraint& constraint) {
  Message json(out, at);
  json->member("kind", to_string(constraint.kind));
  json->member("first", constraint.first);
  json->member("second", constraint.second);
}

void append_json(JsonBuffer& out, Time at, const Cell& cell) {
  Message json(out, at);
  json->key("cell");
  json->raw(cell_json(cell));
}

void append_json(JsonBuffer& out, const SessionStatistics& s) {
  Message json(out, s.now);
  const auto timing = [&](std::string_view key, const TimingSummary& us) {
    json->key(key);
    json->begin_object();
    json->member("p50", us.p50);
    json->member("p99", us.p99);
    json->member("p999", us.p999);
    json->member("max", us.max);
    json->end_object();
  };
  timing("latency", s.latency_us);
  timing("solve", s.solve_us);
  timing("wake", s.wake_us);
  json->member("samples", s.samples);
  json->member("plans", s.plans);
  json->member("rejected_plans", s.rejected_plans);
  json->member("cycles", s.cycles);
  json->member("missed_deadlines", s.missed_deadlines);
  json->member("planner_rate_hz", s.planner_rate_hz);
}

void append_json(JsonBuffer& out, const EpisodeMark& mark) {
  Message json(out, mark.at);
  json->member("episode", mark.episode);
  json->member("kind", to_string(mark.kind));
  if (mark.success) json->member("success", *mark.success);
  if (!mark.task.empty()) json->member("task", mark.task);
  if (!mark.notes.empty()) json->member("notes", mark.notes);
}

void append_json(JsonBuffer& out, const SceneLook& look) {
  Message json(out, look.scene.at);
  json->member("reset", look.scene.reset);
  json->key("things");
  json->begin_array();
  for (int i = 0; i < look.scene.things; ++i) {
    const ThingState& thing = look.scene.thing[i];
    json->begin_object();
    write_pose(*json, "pose", thing.X_base_thing);
    json->member("velocity", thing.velocity);
    json->member("turning", thing.turning);
    json->member("touches", thing.touches);
    json->end_object();
  }
  json->end_array();
  json->member("time_s", look.progress.time);
  json->member("held", look.progress.held);
  json->member("spilled_share", look.progress.spilled);
  if (look.progress.success) json->member("success", *look.progress.success);
}

void append_json(JsonBuffer& out, const VideoPacket& picture, std::string_view camera) {
  Message json(out, picture.stamp.hand, camera);
  json->member("data", to_base64(picture.data));
  json->member("format", "h264");
}

}  // namespace steadyhand

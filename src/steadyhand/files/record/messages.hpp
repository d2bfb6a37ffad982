#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <ranges>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/video.hpp"
#include "steadyhand/files/record/episode_mark.hpp"
#include "steadyhand/files/record/message_style.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/files/record/settings_change.hpp"
#include "steadyhand/files/record/statistics.hpp"
#include "steadyhand/files/record/step.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/session/supervise/supervision.hpp"

/// The messages of a recording, each described once: its schema, how it is written and how it is read. Where one of
/// Foxglove's well-known schemas fits, it carries that name, so that viewers draw it; our further values are
/// further members. If topics share a schema, a member that only one of them has is described so.
namespace steadyhand {

/// A struct as recordings have it.
template <typename T>
struct Message {
  T* value = &example();

 private:
  static T& example() {  // which schemas are made of
    static T one{};
    return one;
  }
};

template <typename T>
Message(T*) -> Message<T>;

/// For a value that is only written.
template <typename T>
Message<T> message_of(const T& value) {
  return {const_cast<T*>(&value)};
}

/// Robots with one tool, and older recordings, do not have this member.
template <typename V>
void add_tool(V& v, int& tool, std::string_view what) {
  std::optional<int> second;
  if (tool != 0) second = tool;
  v.add("tool", "", what, second, within(0, kMaxTools - 1));
  if constexpr (kReads<V>) tool = second.value_or(0);
}

// ---- /operator_sample and /target

template <typename V>
void describe(V& v, Message<OperatorSample>& m) {
  v.type("foxglove.PoseInFrame", "A timestamped pose for an object or reference frame in 3D space");
  OperatorSample& s = *m.value;
  double lead = to_seconds(s.look_ahead);
  v.add("timestamp", "", "Timestamp of pose", s.stamp.hand);
  if constexpr (!kReads<V>) {
    const std::string_view frame = s.leader == Leader::kPolicy ? "base" : "operator";
    v.add("frame_id", "", "Frame of reference for pose position and orientation", frame);
  }
  v.add("pose", "", "Pose in 3D space", s.X_operator_hand);
  v.add("clutch", "", "/operator_sample: the clutch is closed", s.clutch);
  v.add("tracked", "", "/operator_sample: the device has a valid pose", s.tracked);
  v.add("emulated", "", "/operator_sample: the device guesses its position", s.emulated);
  v.add("lead_s", "s", "/operator_sample: by which the device predicted the pose", lead, kOrAbsent);
  v.add("gripper", "", "/operator_sample: 0 open to 1 closed, if the operator sets it", s.gripper);
  v.add("leader", "", "source of the hand: person, recording (playback) or policy (poses in the base)", s.leader,
        kOrAbsent);
  v.add("intervention", "", "/operator_sample: a person controls the arm during a policy's turn", s.intervention,
        kOrAbsent);
  add_tool(v, s.tool, "index of the tool that the hand moves; absent: 0");
  if constexpr (kReads<V>) s.look_ahead = from_seconds(lead);
}

template <typename V>
void describe(V& v, Message<Target>& m) {
  v.type("foxglove.PoseInFrame", "A timestamped pose for an object or reference frame in 3D space");
  Target& t = *m.value;
  v.add("timestamp", "", "Timestamp of pose", t.stamp.hand);
  v.add("frame_id", "", "Frame of reference for pose position and orientation", std::string_view("base"));
  v.add("pose", "", "Pose in 3D space", t.X_base_tool);
  v.add("engaged", "", "/target: the arm is to follow", t.engaged);
  v.add("leader", "", "source of the hand: person, recording (playback) or policy (poses in the base)", t.leader);
  add_tool(v, t.tool, "index of the tool that the hand moves; absent: 0");
}

// ---- /reference and /plan

/// The second tool of /reference or /plan.
struct SecondPoses {
  std::vector<Pose> poses;
  std::optional<std::vector<double>> along, across;
};
template <typename V>
void describe(V& v, SecondPoses& second) {
  v.add("poses", "", "", second.poses);
  v.add("along_m", "m", "", second.along);
  v.add("across_m", "m", "", second.across);
}
inline constexpr std::string_view kSecondTool = "the same of the second tool; absent: the robot has one";

struct ReferenceMessage {
  Message<const Reference> reference;
  int tool_count = 1;  ///< of the robot
};
template <typename V>
void describe(V& v, ReferenceMessage& m) {
  v.type("foxglove.PosesInFrame", "An array of timestamped poses for an object or reference frame in 3D space");
  const Reference& r = *m.reference.value;
  const auto nodes = [&r](auto value) { return std::views::iota(0, r.nodes) | std::views::transform(value); };
  v.add("timestamp", "", "Timestamp of pose", r.start);
  v.add("frame_id", "", "Frame of reference for pose position and orientation", std::string_view("base"));
  v.add("poses", "", "Poses in 3D space",
        nodes([&r](int k) { return Pose{r.tools[0].p[k], Quaternion(r.tools[0].R[k])}; }));
  v.add("dt_s", "s",
        "time from one pose to the next; the first pose of /plan is at timestamp, that of /reference dt_s later", r.dt);
  v.add("along_m", "m", "/reference: standard deviations of the poses' positions along the hand's path; 0: not known",
        nodes([&r](int k) { return r.tools[0].spread[k].along; }));
  v.add("across_m", "m", "/reference: likewise, in each direction across it",
        nodes([&r](int k) { return r.tools[0].spread[k].across; }));
  std::optional<SecondPoses> second;
  if (m.tool_count > 1) {
    SecondPoses& poses = second.emplace(SecondPoses{{}, {{}}, {{}}});
    for (int k = 0; k < r.nodes; ++k) {
      poses.poses.push_back({r.tools[1].p[k], Quaternion(r.tools[1].R[k])});
      poses.along->push_back(r.tools[1].spread[k].along);
      poses.across->push_back(r.tools[1].spread[k].across);
    }
  }
  v.add("second_tool", "", kSecondTool, second);
}

/// The joints at a node.
struct PlanNode {
  JointVector q, dq;
  std::optional<JointVector> ddq;
};
template <typename V>
void describe(V& v, PlanNode& node) {
  v.add("q", "rad (m)", "", node.q);
  v.add("dq", "rad/s (m/s)", "", node.dq);
  v.add("ddq", "rad/s^2 (m/s^2)", "until the next node; the last node has none", node.ddq);
}

struct PlanMessage {
  Message<const Plan> plan;
  ToolPaths paths;  ///< X_base_tool at its nodes, so that a viewer can draw it; may be empty
};
template <typename V>
void describe(V& v, PlanMessage& m) {
  v.type("foxglove.PosesInFrame", "An array of timestamped poses for an object or reference frame in 3D space");
  const Plan& plan = *m.plan.value;
  const auto node = [&plan](int k) {
    const int n = plan.joints;
    return PlanNode{plan.x[k].head(n), plan.x[k].tail(n), k < plan.intervals ? std::optional(plan.u[k]) : std::nullopt};
  };
  v.add("timestamp", "", "Timestamp of pose", plan.start);
  v.add("frame_id", "", "Frame of reference for pose position and orientation", std::string_view("base"));
  v.add("poses", "", "Poses in 3D space", m.paths[0]);
  v.add("dt_s", "s",
        "time from one pose to the next; the first pose of /plan is at timestamp, that of /reference dt_s later",
        plan.dt);
  v.add("origin", "", "/plan: solved, feasible or previous", to_string(plan.origin));
  v.add("nodes", "", "/plan: the joints at the poses",
        std::views::iota(0, plan.intervals + 1) | std::views::transform(node));
  std::optional<SecondPoses> second;
  if (!m.paths[1].empty()) second = SecondPoses{m.paths[1], {}, {}};
  v.add("second_tool", "", kSecondTool, second);
}

// ---- /joint_command, /joint_state

template <typename V>
void describe(V& v, Message<JointCommand>& m) {
  v.type("steadyhand.JointCommand", "Joint command to the arm");
  JointCommand& c = *m.value;
  v.add("timestamp", "", "when the arm is to be there", c.stamp.made);
  v.add("q", "rad (m)", "", c.q);
  v.add("dq", "rad/s (m/s)", "", c.dq);
  v.add("ddq", "rad/s^2 (m/s^2)", "", c.ddq);
  v.add("gripper", "", "0 open to 1 closed; absent for arms without a gripper", c.gripper[0]);
  v.add("second_gripper", "", "that of the second tool; absent: it is none", c.gripper[1]);
}

template <typename V>
void describe(V& v, Message<JointState>& m) {
  v.type("steadyhand.JointState", "Measured state of the arm");
  JointState& s = *m.value;
  v.add("timestamp", "", "when it was measured", s.stamp.made);
  v.add("q", "rad (m)", "", s.q);
  v.add("dq", "rad/s (m/s)", "", s.dq);
  v.add("gripper", "", "0 open to 1 closed; absent for arms without a gripper", s.gripper[0]);
  v.add("second_gripper", "", "that of the second tool; absent: it is none", s.gripper[1]);
}

// ---- /plan_step

template <typename V>
void describe(V& v, ToolStep& tool) {
  Coordinates acceleration{tool.local_acceleration};
  v.add("target", "", "", tool.X_base_target);
  v.add("planned", "", "", tool.X_base_planned);
  v.add("local_acceleration", "m/s^2", "", acceleration);
  v.add("engaged", "", "", tool.engaged);
  if constexpr (kReads<V>) tool.local_acceleration = acceleration.v;
}

struct StepMessage {
  PlanStep step;
  std::vector<std::pair<std::string, double>> shares;  ///< by name of the term
};
template <typename V>
void describe(V& v, StepMessage& m) {
  v.type("steadyhand.PlanStep", "Result of one planning step");
  PlanStep& s = m.step;
  Time at = from_seconds(s.t_s);
  ToolStep& first = s.tools[0];
  Coordinates acceleration{first.local_acceleration};
  v.add("timestamp", "", "start of the plan", at);
  v.add("target", "", "newest target, controlled frame in base", first.X_base_target);
  v.add("planned", "", "controlled frame in base at the start of the plan", first.X_base_planned);
  v.add("q", "rad (m)", "", s.q);
  v.add("dq", "rad/s (m/s)", "", s.dq);
  v.add("ddq", "rad/s^2 (m/s^2)", "", s.ddq);
  v.add("local_acceleration", "m/s^2", "specific force, tool frame; [0, 0, 9.81] at rest and upright", acceleration);
  v.add("objective", "", "value of the objective", s.objective);
  v.add("shares", "", "contribution of each term to the objective", m.shares);
  v.add("iterations", "", "", s.iterations);
  v.add("status", "", "solved, feasible or previous", s.status);
  v.add("solve_time_us", "us", "wall clock", s.solve_time_us);
  v.add("smallest_sphere_distance_m", "m", "surface to surface, over all pairs and nodes",
        s.smallest_sphere_distance_m);
  v.add("engaged", "", "the arm followed the hand", first.engaged);
  v.add("object_distances_m", "m",
        "distance of each obstacle, without its margin, to the bodies that must not touch it; null: all may",
        s.object_distances, kOrAbsent);
  std::optional<ToolStep> second;
  if (s.tool_count > 1) second = s.tools[1];
  v.add("second_tool", "", kSecondTool, second);
  std::optional<double> between;
  if (std::isfinite(s.distance_between_arms_m)) between = s.distance_between_arms_m;
  v.add("distance_between_arms_m", "m", "surface to surface, over all pairs of bodies on different arms and all nodes",
        between);
  if constexpr (kReads<V>) {
    if (between) s.distance_between_arms_m = *between;
    s.t_s = to_seconds(at);
    first.local_acceleration = acceleration.v;
    s.tool_count = second ? 2 : 1;
    if (second) s.tools[1] = *second;
  }
}

// ---- of live sessions

/// /supervision
struct StateChange {
  Time at{0};
  std::string from, to, reason;
  bool is_failure = false;
  std::optional<ReasonCode> code = std::nullopt;  ///< none: of a recording from before there was one
  int tool = 0;                                   ///< that follows the hand
};
template <typename V>
void describe(V& v, StateChange& c) {
  v.type("steadyhand.Supervision", "Change of the supervision's state");
  v.add("timestamp", "", "when", c.at);
  v.add("from", "", "idle, ready, engaged, holding, stopping or fault", c.from);
  v.add("to", "", "idle, ready, engaged, holding, stopping or fault", c.to);
  v.add("reason", "", "why, for people", c.reason);
  v.add("is_failure", "", "the arm stops without a request", c.is_failure, kOrAbsent);
  v.add("code", "", "the event that `reason` puts in words", c.code);
  add_tool(v, c.tool, "index of the tool; changes of the whole robot come for each; absent: 0");
}

/// /operator_settings
template <typename V>
void describe(V& v, Message<SettingsChange>& m) {
  v.type("steadyhand.OperatorSettings", "Settings of the operator, from this time on");
  SettingsChange& c = *m.value;
  v.add("timestamp", "", "since when", c.at);
  v.add("weights", "", "weights of each term of the objective", c.weights);
  v.add("scale", "", "motion of the tool for each metre of the hand", c.scale);
  v.add("yaw", "rad", "rotation of the operator's axes about the base's z", c.yaw);
  v.add("tilt", "rad", "how far the glass may lean with the hand", c.tilt);
  v.add("no_spill", "", "plans spill nothing", c.no_spill);
  v.add("fill", "m", "height of the liquid in the glass", c.fill);
  v.add("latency", "s", "added on purpose between the hand's gate and the planner", c.latency);
  v.add("prediction", "", "prediction of the hand for the planner", c.prediction, kOrAbsent);
  v.add("profile", "", "profile that set these values first", c.profile, kOrAbsent);
  if constexpr (kReads<V>) {
    v.check(c.scale > 0.0 && std::isfinite(c.scale) && std::isfinite(c.yaw),
            fmt::format("scale is {} and yaw {}; both must be finite, the scale above 0", c.scale, c.yaw));
  }
}

/// /liquid
struct LiquidMessage {
  Time at{0};
  LiquidState liquid;
  int tool = 0;  ///< that holds the glass
};
template <typename V>
void describe(V& v, LiquidMessage& m) {
  v.type("steadyhand.Liquid", "The liquid's surface in the glass, simulated from the measured motion");
  LiquidState& l = m.liquid;
  v.add("timestamp", "", "when", m.at);
  v.add("tilt_x", "rad", "tilt of the surface's normal about the glass's x axis", l.tilt_x);
  v.add("tilt_y", "rad", "tilt about its y axis", l.tilt_y);
  v.add("freeboard", "m", "height from the surface's highest point to the rim; negative: over the rim", l.freeboard);
  v.add("spilled", "", "liquid has gone over the rim", l.spilled);
  v.add("spilled_share", "", "share of the liquid that was spilled", l.spilled_share, kOrAbsent);
  v.add("lateral", "m/s^2", "lateral specific force, the largest of the last 20 ms", l.lateral, kOrAbsent);
  add_tool(v, m.tool, "index of the tool that holds the glass; absent: 0");
}

/// /active_constraint. `kind` by its name, "none" where nothing holds the arm back.
struct LimitChange {
  Time at{0};
  std::string kind;
  int first = -1, second = -1;
};
template <typename V>
void describe(V& v, LimitChange& c) {
  v.type("steadyhand.ActiveConstraint", "Active limit, from this time on");
  v.add("timestamp", "", "since when", c.at);
  v.add("kind", "", "none, position, velocity, acceleration, self_collision, reach or obstacle", c.kind);
  v.add("first", "", "joint, or (first) body", c.first);
  v.add("second", "", "second body of the pair, or object of the cell", c.second);
}

/// /cell
struct CellLook {
  Time at{0};
  CellText cell;
};
template <typename V>
void describe(V& v, CellLook& m) {
  v.type("steadyhand.Cell", "Obstacles, from this time on");
  v.add("timestamp", "", "since when; moving objects are at their positions then", m.at);
  v.add("cell", "", "see docs/how-to/add-a-table.md", m.cell);
}

/// /statistics
template <typename V>
void describe(V& v, Message<TimingSummary>& m) {
  v.add("p50", "us", "median", m.value->p50);
  v.add("p99", "us", "", m.value->p99);
  v.add("p999", "us", "", m.value->p999);
  v.add("max", "us", "", m.value->max);
}
template <typename V>
void describe(V& v, Message<SessionStatistics>& m) {
  v.type("steadyhand.Statistics", "Counts since the session started");
  SessionStatistics& s = *m.value;
  Message<TimingSummary> latency{&s.latency_us}, solve{&s.solve_us}, wake{&s.wake_us};
  v.add("timestamp", "", "when", s.now);
  v.add("latency", "", "time from a hand sample to the first command made from it", latency);
  v.add("solve", "", "time of a solve with its check", solve);
  v.add("wake", "", "delay of the start of control cycles", wake);
  v.add("samples", "", "samples of the hand", s.samples);
  v.add("plans", "", "plans that were followed", s.plans);
  v.add("rejected_plans", "", "plans that were late, or failed their check", s.rejected_plans);
  v.add("cycles", "", "control cycles", s.cycles);
  v.add("missed_deadlines", "", "missed control cycles", s.missed_deadlines);
  v.add("planner_rate_hz", "Hz", "plans per second", s.planner_rate_hz);
}

/// /episode
template <typename V>
void describe(V& v, Message<EpisodeMark>& m) {
  v.type("steadyhand.Episode", "A mark of an episode; the last one counts");
  EpisodeMark& e = *m.value;
  v.add("timestamp", "", "when", e.at);
  v.add("episode", "", "its number in the session, from 1", e.episode);
  v.add("kind", "", "begin, keep, discard or mark", e.kind);
  v.add("success", "", "whether the task succeeded; absent: unchanged or unknown", e.success);
  v.add("task", "", "the task in words; absent: unchanged", e.task, kOrAbsent);
  v.add("notes", "", "for people; absent: unchanged", e.notes, kOrAbsent);
}

/// /scene
template <typename V>
void describe(V& v, ThingState& t) {
  v.add("pose", "", "in the base's frame", t.X_base_thing);
  v.add("velocity", "m/s", "base frame", t.velocity);
  v.add("turning", "rad/s", "base frame", t.turning);
  v.add("touches", "", "a bit for each object that it is in contact with", t.touches);
}
template <typename V>
void describe(V& v, Message<SceneLook>& m) {
  v.type("steadyhand.Scene", "A simulated scene, and the progress of its task");
  SceneState& scene = m.value->scene;
  TaskProgress& progress = m.value->progress;
  std::vector<ThingState> things(scene.thing.begin(), scene.thing.begin() + scene.things);
  v.add("timestamp", "", "when", scene.at);
  v.add("reset", "", "number of earlier setups of the scene", scene.reset);
  v.add("things", "", "objects that metadata 'task' names, in that order", things, sized(0, kMaxThings));
  v.add("time_s", "s", "time since the scene was set up, or until the task was decided", progress.time);
  v.add("held", "", "a bit for each condition of the task that holds", progress.held);
  v.add("spilled_share", "", "share of the liquid that was spilled since the scene was set up", progress.spilled);
  v.add("success", "", "result, once it is decided", progress.success);
  if constexpr (kReads<V>) {
    scene.things = static_cast<int>(std::min(things.size(), scene.thing.size()));
    std::copy_n(things.begin(), scene.things, scene.thing.begin());
  }
}

/// /camera/NAME
struct PictureMessage {
  Message<const VideoPacket> picture;
  std::string_view camera;  ///< its name
};
template <typename V>
void describe(V& v, PictureMessage& m) {
  v.type("foxglove.CompressedVideo", "A camera frame");
  const VideoPacket& picture = *m.picture.value;
  v.add("timestamp", "", "when it was exposed", picture.stamp.hand);
  v.add("frame_id", "", "the camera's name", m.camera);
  v.add("data", "", "H.264 as an Annex B byte stream, one picture, none of which waits for later ones",
        Base64{picture.data});
  v.add("format", "", "h264", std::string_view("h264"));
}

}  // namespace steadyhand

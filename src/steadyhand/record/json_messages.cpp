#include "steadyhand/record/json_messages.hpp"

#include <cmath>
#include <cstdint>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "steadyhand/core/live.hpp"

namespace steadyhand {
namespace {

void append(JsonBuffer& out, std::string_view text) { out.append(text.data(), text.data() + text.size()); }

void append_key(JsonBuffer& out, std::string_view key) {
  out.push_back('"');
  append(out, key);
  append(out, "\":");
}

/// Foxglove's time: whole seconds (floored) and the nanoseconds on top.
void append_time(JsonBuffer& out, std::string_view key, Time t) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t nanoseconds = (t.count() % kSecond + kSecond) % kSecond;
  append_key(out, key);
  fmt::format_to(std::back_inserter(out), "{{\"sec\":{},\"nsec\":{}}}", (t.count() - nanoseconds) / kSecond,
                 nanoseconds);
}

void append_vector(JsonBuffer& out, const Vector3& v) {
  append(out, "{\"x\":");
  append_number(out, v.x());
  append(out, ",\"y\":");
  append_number(out, v.y());
  append(out, ",\"z\":");
  append_number(out, v.z());
  out.push_back('}');
}

void append_pose(JsonBuffer& out, const Vector3& p, const Quaternion& q) {
  append(out, "{\"position\":");
  append_vector(out, p);
  append(out, ",\"orientation\":{\"x\":");
  append_number(out, q.x());
  append(out, ",\"y\":");
  append_number(out, q.y());
  append(out, ",\"z\":");
  append_number(out, q.z());
  append(out, ",\"w\":");
  append_number(out, q.w());
  append(out, "}}");
}

/// "[" item(0) "," ... "]".
template <typename Item>
void append_array(JsonBuffer& out, int count, Item&& item) {
  out.push_back('[');
  for (int i = 0; i < count; ++i) {
    if (i > 0) out.push_back(',');
    item(i);
  }
  out.push_back(']');
}

template <typename Vector>
void append_numbers(JsonBuffer& out, std::string_view key, const Vector& values) {
  append_key(out, key);
  append_array(out, static_cast<int>(values.size()), [&](int i) { append_number(out, values[i]); });
}

void append_flag(JsonBuffer& out, std::string_view key, bool value) {
  append_key(out, key);
  append(out, value ? "true" : "false");
}

void append_header(JsonBuffer& out, Time t, std::string_view frame) {
  out.push_back('{');
  append_time(out, "timestamp", t);
  append(out, ",\"frame_id\":\"");
  append(out, frame);
  append(out, "\",");
}

}  // namespace

void append_number(JsonBuffer& out, double value) {
  if (std::isfinite(value)) {
    fmt::format_to(std::back_inserter(out), "{}", value);
  } else {
    append(out, "null");
  }
}

void append_text(JsonBuffer& out, std::string_view text) {
  // dump() quotes, escapes, and replaces bytes that are not UTF-8.
  append(out, nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

void append_json(JsonBuffer& out, const OperatorSample& sample) {
  append_header(out, sample.stamp.hand, "operator");
  append_key(out, "pose");
  append_pose(out, sample.X_operator_hand.p, sample.X_operator_hand.q);
  out.push_back(',');
  append_flag(out, "clutch", sample.clutch);
  out.push_back(',');
  append_flag(out, "tracked", sample.tracked);
  out.push_back(',');
  append_flag(out, "emulated", sample.emulated);
  out.push_back(',');
  append_key(out, "lead_s");
  append_number(out, to_seconds(sample.look_ahead));
  out.push_back('}');
}

void append_json(JsonBuffer& out, const Target& target) {
  append_header(out, target.stamp.hand, "base");
  append_key(out, "pose");
  append_pose(out, target.X_base_tool.p, target.X_base_tool.q);
  out.push_back(',');
  append_flag(out, "engaged", target.engaged);
  out.push_back('}');
}

void append_json(JsonBuffer& out, const Reference& reference) {
  append_header(out, reference.start, "base");
  append_key(out, "poses");
  append_array(out, reference.nodes, [&](int k) { append_pose(out, reference.p[k], Quaternion(reference.R[k])); });
  append(out, ",\"dt_s\":");
  append_number(out, reference.dt);
  out.push_back('}');
}

void append_json(JsonBuffer& out, const Plan& plan, std::span<const Pose> path) {
  const int n = plan.joints;
  append_header(out, plan.start, "base");
  append_key(out, "poses");
  append_array(out, static_cast<int>(path.size()), [&](int k) { append_pose(out, path[k].p, path[k].q); });
  append(out, ",\"dt_s\":");
  append_number(out, plan.dt);
  append(out, ",\"origin\":\"");
  append(out, to_string(plan.origin));
  append(out, "\",\"nodes\":");
  append_array(out, plan.intervals + 1, [&](int k) {
    out.push_back('{');
    append_numbers(out, "q", plan.x[k].head(n));
    out.push_back(',');
    append_numbers(out, "dq", plan.x[k].tail(n));
    if (k < plan.intervals) {
      out.push_back(',');
      append_numbers(out, "ddq", plan.u[k]);
    }
    out.push_back('}');
  });
  out.push_back('}');
}

void append_json(JsonBuffer& out, const JointCommand& command) {
  out.push_back('{');
  append_time(out, "timestamp", command.stamp.made);
  out.push_back(',');
  append_numbers(out, "q", command.q);
  out.push_back(',');
  append_numbers(out, "dq", command.dq);
  out.push_back(',');
  append_numbers(out, "ddq", command.ddq);
  out.push_back('}');
}

void append_json(JsonBuffer& out, const JointState& state) {
  out.push_back('{');
  append_time(out, "timestamp", state.stamp.made);
  out.push_back(',');
  append_numbers(out, "q", state.q);
  out.push_back(',');
  append_numbers(out, "dq", state.dq);
  out.push_back('}');
}

void append_json(JsonBuffer& out, const PlanStep& step, const RunNames& names) {
  out.push_back('{');
  append_time(out, "timestamp", from_seconds(step.t_s));
  append(out, ",\"target\":");
  append_pose(out, step.X_base_target.p, step.X_base_target.q);
  append(out, ",\"planned\":");
  append_pose(out, step.X_base_planned.p, step.X_base_planned.q);
  out.push_back(',');
  append_numbers(out, "q", step.q);
  out.push_back(',');
  append_numbers(out, "dq", step.dq);
  out.push_back(',');
  append_numbers(out, "ddq", step.ddq);
  append(out, ",\"local_acceleration\":");
  append_vector(out, step.local_acceleration);
  append(out, ",\"objective\":");
  append_number(out, step.objective);
  append(out, ",\"shares\":{");
  for (std::size_t i = 0; i < names.terms.size(); ++i) {
    if (i > 0) out.push_back(',');
    append_text(out, names.terms[i]);
    out.push_back(':');
    append_number(out, step.shares[i]);
  }
  fmt::format_to(std::back_inserter(out), "}},\"iterations\":{},\"status\":\"{}\",\"solve_time_us\":", step.iterations,
                 to_string(step.status));
  append_number(out, step.solve_time_us);
  append(out, ",\"smallest_sphere_distance_m\":");
  append_number(out, step.smallest_sphere_distance_m);
  out.push_back(',');
  append_flag(out, "engaged", step.engaged);
  out.push_back('}');
}

void append_json(JsonBuffer& out, const SupervisionChange& change) {
  out.push_back('{');
  append_time(out, "timestamp", change.at);
  append(out, ",\"from\":");
  append_text(out, to_string(change.from));
  append(out, ",\"to\":");
  append_text(out, to_string(change.to));
  append(out, ",\"reason\":");
  append_text(out, change.reason);
  out.push_back(',');
  append_flag(out, "is_failure", change.is_failure);
  out.push_back('}');
}

void append_json(JsonBuffer& out, const SettingsChange& change) {
  out.push_back('{');
  append_time(out, "timestamp", change.at);
  append(out, ",\"weights\":");
  char before = '{';
  for (const auto& [name, values] : change.weights) {
    out.push_back(std::exchange(before, ','));
    append_numbers(out, name, Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values)));
  }
  append(out, change.weights.empty() ? "{},\"scale\":" : "},\"scale\":");
  append_number(out, change.scale);
  append(out, ",\"yaw\":");
  append_number(out, change.yaw);
  out.push_back('}');
}

void append_json(JsonBuffer& out, Time at, const LiquidState& liquid) {
  out.push_back('{');
  append_time(out, "timestamp", at);
  append(out, ",\"tilt_x\":");
  append_number(out, liquid.tilt_x);
  append(out, ",\"tilt_y\":");
  append_number(out, liquid.tilt_y);
  append(out, ",\"freeboard\":");
  append_number(out, liquid.freeboard);
  out.push_back(',');
  append_flag(out, "spilled", liquid.spilled);
  out.push_back('}');
}

void append_json(JsonBuffer& out, Time at, const ActiveConstraint& constraint) {
  out.push_back('{');
  append_time(out, "timestamp", at);
  append(out, ",\"kind\":");
  append_text(out, to_string(constraint.kind));
  fmt::format_to(std::back_inserter(out), ",\"first\":{},\"second\":{}}}", constraint.first, constraint.second);
}

void append_json(JsonBuffer& out, const SessionSnapshot& snapshot) {
  const auto timing = [&](std::string_view key, const TimingSummary& us) {
    append_key(out, key);
    append(out, "{\"p50\":");
    append_number(out, us.p50);
    append(out, ",\"p99\":");
    append_number(out, us.p99);
    append(out, ",\"p999\":");
    append_number(out, us.p999);
    append(out, ",\"max\":");
    append_number(out, us.max);
    append(out, "},");
  };
  out.push_back('{');
  append_time(out, "timestamp", snapshot.now);
  out.push_back(',');
  timing("latency", snapshot.latency_us);
  timing("solve", snapshot.solve_us);
  timing("wake", snapshot.wake_us);
  fmt::format_to(std::back_inserter(out),
                 "\"samples\":{},\"plans\":{},\"rejected_plans\":{},\"cycles\":{},\"missed_deadlines\":{},"
                 "\"planner_rate_hz\":",
                 snapshot.samples, snapshot.plans, snapshot.rejected_plans, snapshot.cycles, snapshot.missed_deadlines);
  append_number(out, snapshot.planner_rate_hz);
  out.push_back('}');
}

}  // namespace steadyhand

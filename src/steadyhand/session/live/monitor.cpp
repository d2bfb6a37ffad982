#include "steadyhand/session/live/monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

/// Tolerances for rounding, also at the change from one plan to the next: of commands, their differences, and
/// distances. Much smaller than the tolerances of planner and control loop.
constexpr double kPosition = 3e-6, kSpeed = 1e-3, kAcceleration = 1e-2;  // rad, rad/s, rad/s^2 (m...)
constexpr double kOverlap = 1e-5;                                        // m
constexpr double kMeasured = 0.02;  // share of the speed limit, for errors of measurement

/// By how much a value exceeds its limits, largest over all joints; 0 inside, infinite if it is not a number.
double excess(const JointVector& value, const JointVector& low, const JointVector& high) {
  const double most = std::max((low - value).maxCoeff(), (value - high).maxCoeff());
  return value.allFinite() ? std::max(0.0, most) : std::numeric_limits<double>::infinity();
}

double excess(const JointVector& value, const JointVector& limit) { return excess(value, -limit, limit); }

/// Records the largest excess. @return whether it is beyond the tolerance
bool note(double excess, double tolerance, double& most) {
  if (!(excess > tolerance)) return false;
  most = std::max(most, excess);
  return true;
}

}  // namespace

Monitor::Monitor(const RobotModel& model, const GlassSettings& glass)
    : commanded_(model), measured_(model), glass_(glass), glasses_(model.tools.size(), Glass{Liquid(glass)}) {
  measured_.set_position(model.home);  // until a state arrives
}

void Monitor::fill(double height) {
  if (height == glass_.fill) return;
  glass_.fill = height;
  for (int t = 0; t < measured_.tool_count(); ++t) {
    glasses_[t].liquid = Liquid(glass_);
    reset_liquid(t);
  }
}

bool Monitor::spilled() const {
  return std::ranges::any_of(glasses_, [](const Glass& glass) { return glass.liquid.state().spilled; });
}

void Monitor::set_obstacles(const Obstacles& obstacles, std::vector<std::string> names) {
  obstacles_ = obstacles;
  names_ = std::move(names);
}

void Monitor::update(const JointCommand& command, bool anew) {
  const RobotModel& model = commanded_.model();
  MonitorResult& r = result_;
  bool outside = note(excess(command.q, model.position_min, model.position_max), kPosition, r.position_excess) |
                 note(excess(command.dq, model.velocity_max), kSpeed, r.speed_excess) |
                 note(excess(command.ddq, model.acceleration_max), kAcceleration, r.acceleration_excess);
  const double dt = to_seconds(command.stamp.made - last_command_.stamp.made);
  if (r.commands > 0 && !anew) {  // the stated derivatives may differ from the actual motion
    const JointVector way = command.q - last_command_.q, change = command.dq - last_command_.dq;
    // Within the acceleration limits, the step differs from the mean of both speeds by no more than this.
    const JointVector astray = way - 0.5 * dt * (command.dq + last_command_.dq);
    const JointVector span = JointVector::Constant(way.size(), std::max(dt, 1e-9));
    outside |= !(dt > 0.0) | note(excess(way.cwiseQuotient(span), model.velocity_max), kSpeed, r.speed_excess) |
               note(excess(change.cwiseQuotient(span), model.acceleration_max), kAcceleration, r.acceleration_excess) |
               note(excess(astray, 0.25 * dt * dt * model.acceleration_max), kPosition, r.step);
  }
  r.beyond_limits += outside;
  commanded_.set_position(command.q);
  const NearestPair nearest = nearest_pair(commanded_, obstacles_);
  r.in_contact += nearest.gap < -kOverlap;
  if (nearest.gap < r.smallest_clearance) {
    r.smallest_clearance = nearest.gap;
    r.nearest = {name(nearest.first), name(nearest.second)};
  }
  look_at_obstacles(command.stamp.made);
  ++r.commands;
  last_command_ = command;
}

/// Name of a body of the arm, or of an object that it carries.
const std::string& Monitor::name(int solid) const {
  return solid < kMaxBodies ? commanded_.model().bodies[solid].name : names_[solid - kMaxBodies];
}

/// Call after commanded_.set_position.
void Monitor::look_at_obstacles(Time now) {
  const double t = to_seconds(now - obstacles_.time);
  bool touches = false;
  for (int i = 0; i < obstacles_.count; ++i) {
    if (obstacles_.list[i].carried) continue;  // a part of the arm
    const auto [body, distance] = nearest_body(commanded_, obstacles_, i, t);
    touches |= distance < -kOverlap;
    if (distance >= result_.smallest_distance) continue;
    result_.smallest_distance = distance;
    result_.nearest_body = name(body);
    result_.nearest_obstacle = names_[i];
  }
  result_.touching += touches;
}

std::vector<std::string> Monitor::overlaps() const {
  std::vector<std::string> lines;
  for (int i = 0; i < obstacles_.count; ++i) {
    const auto [body, distance] = nearest_body(measured_, obstacles_, i, to_seconds(last_state_ - obstacles_.time));
    if (distance >= -kOverlap) continue;
    lines.push_back(fmt::format("the arm is inside the object '{}': its body '{}' by {:.1f} mm", names_[i], name(body),
                                -1e3 * distance));
  }
  return lines;
}

void Monitor::update(const JointState& state) {
  const JointVector& fastest = measured_.model().velocity_max;
  result_.too_fast += note(excess(state.dq, fastest), kMeasured * fastest.minCoeff(), result_.measured_excess);
  measured_.set_position(state.q);
  const double dt = to_seconds(state.stamp.made - last_state_);
  for (int t = 0; t < measured_.tool_count(); ++t) {
    auto& [liquid, last_velocity, local_acceleration] = glasses_[t];
    Vector3 velocity = Vector3::Zero();
    for (const int k : measured_.chain(t)) velocity += state.dq[k] * measured_.dp(k, t);
    if (result_.states > 0 && dt > 0.0) {
      local_acceleration = measured_.R(t).transpose() * ((velocity - last_velocity) / dt + kGravity);
      if (!measured_.model().tools[t].gripper_time) liquid.update(dt, local_acceleration);  // a gripper holds no glass
    }
    last_velocity = velocity;
  }
  last_state_ = state.stamp.made;
  ++result_.states;
}

std::string to_text(const MonitorResult& r) {
  std::string text = fmt::format("commands           {} looked at, {} beyond a limit, {} in contact", r.commands,
                                 r.beyond_limits, r.in_contact);
  if (!r.nearest[0].empty()) {
    text += fmt::format("; smallest gap {:.3g} mm ({}, {})", 1e3 * r.smallest_clearance, r.nearest[0], r.nearest[1]);
  }
  if (!r.nearest_body.empty()) {
    text += fmt::format("\nobstacles          touched by {} commands; smallest distance {:.3g} mm ({}, {})", r.touching,
                        1e3 * r.smallest_distance, r.nearest_body, r.nearest_obstacle);
  }
  if (r.beyond_limits > 0) {
    text += fmt::format("\nbeyond a limit     by {:.3g} mrad, {:.3g} rad/s, {:.3g} rad/s^2; steps of {:.3g} mrad",
                        1e3 * r.position_excess, r.speed_excess, r.acceleration_excess, 1e3 * r.step);
  }
  text += fmt::format("\nmeasured           {} states, {} beyond a speed limit", r.states, r.too_fast);
  if (r.too_fast > 0) text += fmt::format(", by {:.3g} rad/s", r.measured_excess);
  return text + "\n";
}

}  // namespace steadyhand

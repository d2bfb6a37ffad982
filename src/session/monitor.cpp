#include "session/monitor.hpp"

#include <cmath>

#include "plan/plan_check.hpp"

namespace steadyhand {

namespace {

/// What rounding may add: to positions and their derivatives by differences.
constexpr double kPosition = 1e-4, kVelocity = 1e-3, kAcceleration = 1e-2;  // rad, rad/s, rad/s^2 (m...)

/// After so long without a command the arm has stopped, and been restarted where it stood.
constexpr double kNewBeginning = 0.045;  // s

bool beyond(const JointVector& value, const JointVector& low, const JointVector& high, double tolerance) {
  return !((value - low).minCoeff() >= -tolerance && (high - value).minCoeff() >= -tolerance);  // true for NaN
}

}  // namespace

NearestPair nearest_pair(const Kinematics& arm) {
  NearestPair nearest;
  for (const SpherePair& pair : arm.model().pairs) {
    const double radii = arm.model().spheres[pair.first].radius + arm.model().spheres[pair.second].radius;
    const double gap = std::sqrt(arm.squared_distance(pair)) - radii;
    if (gap < nearest.gap) nearest = {{pair.first, pair.second}, gap};
  }
  return nearest;
}

Monitor::Monitor(const RobotModel& model, const GlassSettings& glass)
    : commanded_(model), measured_(model), liquid_(glass) {}

void Monitor::update(const JointCommand& command) {
  const RobotModel& model = commanded_.model();
  bool outside = beyond(command.q, model.position_min, model.position_max, kPosition) ||
                 beyond(command.dq, -model.velocity_max, model.velocity_max, kVelocity) ||
                 beyond(command.ddq, -model.acceleration_max, model.acceleration_max, kAcceleration);
  const double dt = to_seconds(command.stamp.made - last_command_.stamp.made);
  if (result_.commands > 0 && dt > 0.0 &&
      dt < kNewBeginning) {  // what it says of its derivatives may not be what it does
    const JointVector speed = (command.q - last_command_.q) / dt, change = (command.dq - last_command_.dq) / dt;
    outside = outside || beyond(speed, -model.velocity_max, model.velocity_max, kVelocity) ||
              beyond(change, -model.acceleration_max, model.acceleration_max, kAcceleration);
  }
  result_.beyond_limits += outside;
  commanded_.set_position(command.q);
  const NearestPair nearest = nearest_pair(commanded_);
  result_.in_contact += nearest.gap < -PlanCheckSettings{}.overlap_between_nodes;
  if (nearest.gap < result_.smallest_clearance) {
    result_.smallest_clearance = nearest.gap;
    result_.nearest = nearest.spheres;
  }
  ++result_.commands;
  last_command_ = command;
}

void Monitor::update(const JointState& state) {
  measured_.set_position(state.q);
  Vector3 velocity = Vector3::Zero();
  for (int k = 0; k < measured_.dof(); ++k) velocity += state.dq[k] * measured_.dp(k);
  const double dt = to_seconds(state.stamp.made - last_state_);
  if (result_.states > 0 && dt > 0.0) {
    local_acceleration_ = measured_.R().transpose() * ((velocity - last_velocity_) / dt + kGravity);
    // Cycles that were slept through: the same mean acceleration, in steps that the pendulum can take.
    const int steps = std::clamp(static_cast<int>(std::ceil(dt / 0.004)), 1, 250);
    for (int i = 0; i < steps; ++i) liquid_.update(dt / steps, Quaternion(measured_.R()), local_acceleration_);
  }
  last_velocity_ = velocity;
  last_state_ = state.stamp.made;
  ++result_.states;
}

}  // namespace steadyhand

#include "steadyhand/planning/plan/straight_stop.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

constexpr double kInterval = 0.02;   // s: how densely check_plan looks at distances
constexpr double kShortest = 0.001;  // s: from next to no speed, or over next to no way, a plan would take no time

}  // namespace

double stop_time(const RobotModel& model, const JointVector& dq) {
  return (dq.cwiseAbs().array() / model.acceleration_max.array()).maxCoeff();
}

double braking_step(const RobotModel& model, int j, double q, double dq, int intervals, double dt) {
  const double speed = std::abs(dq), hardest = model.acceleration_max[j] * dt;
  const double room = dq > 0.0 ? model.position_max[j] - q : q - model.position_min[j];
  // In m intervals of constant deceleration it goes speed * m * dt / 2.
  const int most = static_cast<int>(std::min<double>(intervals, 2.0 * room / std::max(speed * dt, 1e-12)));
  return most > 0 && most * dt >= speed / model.acceleration_max[j] ? speed / most : hardest;
}

JointVector straight_stop_at(const RobotModel& model, const JointVector& q, const JointVector& dq, double t) {
  const double time = stop_time(model, dq), braking = std::min(t, time);
  return time > 0.0 ? JointVector(q + braking * (1.0 - 0.5 * braking / time) * dq) : q;
}

void make_straight_stop(const RobotModel& model, const JointCommand& from, double duration, Plan& plan) {
  const int n = model.dof();
  const bool moves = from.dq.cwiseAbs().maxCoeff() > 0.0;
  const double time = moves ? std::max({duration, stop_time(model, from.dq), kShortest}) : 0.0;
  plan.stamp = from.stamp;
  plan.start = from.stamp.made;
  plan.joints = n;
  plan.origin = PlanOrigin::kSolved;
  plan.intervals = static_cast<int>(std::min<double>(std::ceil(time / kInterval), Plan::kMaxIntervals));
  plan.dt = moves ? time / plan.intervals : kInterval;
  for (int k = 0; k <= plan.intervals; ++k) {
    const double t = k * plan.dt, left = moves ? 1.0 - static_cast<double>(k) / plan.intervals : 0.0;
    plan.x[k].resize(2 * n);
    plan.x[k] << from.q + 0.5 * t * (1.0 + left) * from.dq, left * from.dq;
    if (k < plan.intervals) plan.u[k] = -from.dq / time;
  }
}

void make_straight_move(const RobotModel& model, const JointCommand& from, const JointVector& to, double duration,
                        Plan& plan) {
  const int n = model.dof();
  const JointVector way = to - from.q;
  const double by_speed = 2.0 * (way.cwiseAbs().array() / model.velocity_max.array()).maxCoeff();
  const double by_acceleration = 2.0 * std::sqrt((way.cwiseAbs().array() / model.acceleration_max.array()).maxCoeff());
  const double time = std::max({duration, by_speed, by_acceleration, kShortest});
  const double half = std::min<double>(std::ceil(0.5 * time / kInterval), Plan::kMaxIntervals / 2);  // intervals
  plan.stamp = from.stamp;
  plan.start = from.stamp.made;
  plan.joints = n;
  plan.origin = PlanOrigin::kSolved;
  plan.intervals = 2 * static_cast<int>(half);
  plan.dt = time / plan.intervals;
  for (int k = 0; k <= plan.intervals; ++k) {
    const double done = static_cast<double>(k) / plan.intervals, left = 1.0 - done;
    const bool brakes = k >= plan.intervals / 2;
    plan.x[k].resize(2 * n);
    plan.x[k] << (brakes ? JointVector(to - 2.0 * left * left * way) : JointVector(from.q + 2.0 * done * done * way)),
        (4.0 * std::min(done, left) / time) * way;
    if (k < plan.intervals) plan.u[k] = ((brakes ? -4.0 : 4.0) / (time * time)) * way;
  }
}

}  // namespace steadyhand

#include "steadyhand/plan/straight_stop.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

double stop_time(const RobotModel& model, const JointVector& dq) {
  return (dq.cwiseAbs().array() / model.acceleration_max.array()).maxCoeff();
}

JointVector straight_stop_at(const RobotModel& model, const JointVector& q, const JointVector& dq, double t) {
  const double time = stop_time(model, dq), braking = std::min(t, time);
  return time > 0.0 ? JointVector(q + braking * (1.0 - 0.5 * braking / time) * dq) : q;
}

void make_straight_stop(const RobotModel& model, const JointCommand& from, double duration, Plan& plan) {
  constexpr double kInterval = 0.02;   // s: how densely check_plan looks at distances
  constexpr double kShortest = 0.001;  // s: from next to no speed a stop would take next to no time
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

}  // namespace steadyhand

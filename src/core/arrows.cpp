#include "core/arrows.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

Plan& Plan::operator=(const Plan& other) {
  if (this == &other) return *this;
  stamp = other.stamp;
  start = other.start;
  dt = other.dt;
  joints = other.joints;
  intervals = other.intervals;
  origin = other.origin;
  std::copy_n(other.x.begin(), intervals + 1, x.begin());
  std::copy_n(other.u.begin(), intervals, u.begin());
  return *this;
}

JointCommand sample(const Plan& plan, Time t) {
  const int n = plan.joints;
  const double elapsed = std::max(0.0, to_seconds(t - plan.start));
  const int k = std::min(static_cast<int>(elapsed / plan.dt), plan.intervals);
  const StateVector& x = plan.x[k];

  JointCommand command;
  command.stamp = {plan.stamp.hand, t};
  if (k == plan.intervals) {
    command.q = x.head(n);
    command.dq = command.ddq = JointVector::Zero(n);
    return command;
  }
  const double s = std::min(elapsed - k * plan.dt, plan.dt);
  command.ddq = plan.u[k];
  command.dq = x.tail(n) + s * plan.u[k];
  command.q = x.head(n) + s * x.tail(n) + (0.5 * s * s) * plan.u[k];
  return command;
}

}  // namespace steadyhand

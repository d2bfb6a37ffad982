#include "core/arrows.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

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

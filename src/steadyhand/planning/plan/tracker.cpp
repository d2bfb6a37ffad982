#include "steadyhand/planning/plan/tracker.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

JointCommand sample(const Plan& plan, Time t) {
  const int n = plan.joints;
  Time::rep since = 0;
  if (__builtin_sub_overflow(t.count(), plan.start.count(), &since)) since = t < plan.start ? 0 : Time::max().count();
  const double elapsed = to_seconds(Time(std::max<Time::rep>(0, since)));
  const double passed = elapsed / plan.dt;  // of intervals next to nothing: more than an int holds
  const int k = passed >= 0.0 && passed < plan.intervals ? static_cast<int>(passed) : plan.intervals;
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

void stand(const JointVector& q, Time start, Plan& plan) {
  plan.stamp = {start, start};
  plan.start = start;
  plan.dt = 0.05;
  plan.joints = static_cast<int>(q.size());
  plan.intervals = 0;
  plan.origin = PlanOrigin::kSolved;
  plan.x[0].setZero(2 * q.size());
  plan.x[0].head(q.size()) = q;
}

}  // namespace steadyhand

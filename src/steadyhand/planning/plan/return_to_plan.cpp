#include "steadyhand/planning/plan/return_to_plan.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

bool make_return(const Plan& followed, const JointCommand& from, int steps, Plan& plan) {
  constexpr double kInterval = 0.01;  // s: some liquid periods shorter, and a whole plan fits
  const Time start = from.stamp.made;
  const double rest = to_seconds(followed.start - start) + followed.intervals * followed.dt;
  const int along = std::max(2 * steps, static_cast<int>(std::ceil(std::max(0.0, rest) / kInterval - 1e-6)));
  if (along > Plan::kMaxIntervals) return false;
  const int n = followed.joints;
  plan.stamp = {followed.stamp.hand, start};
  plan.start = start;
  plan.dt = kInterval;
  plan.joints = n;
  plan.velocity_max = followed.velocity_max;
  plan.intervals = along;
  plan.world = followed.world;
  plan.origin = followed.origin;

  JointCommand there = sample(followed, start);
  const JointVector away = from.q - there.q, faster = from.dq - there.dq;
  const double time = steps * kInterval;
  const JointVector first = -(away / time + 1.5 * faster) / time, second = (away / time + 0.5 * faster) / time;
  plan.x[0].resize(2 * n);
  plan.x[0] << from.q, from.dq;
  for (int k = 0; k < along; ++k) {
    const JointCommand next = sample(followed, start + from_seconds((k + 1) * kInterval));
    plan.u[k] = (next.dq - there.dq) / kInterval;
    if (k < 2 * steps) plan.u[k] += k < steps ? first : second;
    const JointVector q = plan.x[k].head(n), dq = plan.x[k].tail(n);
    plan.x[k + 1].resize(2 * n);
    plan.x[k + 1] << q + kInterval * dq + (0.5 * kInterval * kInterval) * plan.u[k], dq + kInterval * plan.u[k];
    there = next;
  }
  return true;
}

}  // namespace steadyhand

#include "steadyhand/arms/driver/carry_on.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

JointCommand carried_on(const JointCommand& last, double seconds, const CarryOn& how) {
  JointCommand now = last;
  now.stamp.made += from_seconds(seconds);
  if (last.ddq.size() != last.q.size() || !last.ddq.allFinite()) now.ddq = JointVector::Zero(last.q.size());
  const double bridged = std::min(seconds, how.bridged), braking_for = seconds - bridged;
  now.q += bridged * now.dq + (0.5 * bridged * bridged) * now.ddq;
  now.dq += bridged * now.ddq;
  if (braking_for <= 0.0) return now;
  for (int i = 0; i < now.q.size(); ++i) {
    const double rate = -std::copysign(how.braking[i], now.dq[i]);
    const double to_rest = std::abs(now.dq[i]) / how.braking[i], t = std::min(braking_for, to_rest);
    now.q[i] += t * now.dq[i] + 0.5 * t * t * rate;
    now.ddq[i] = t < to_rest ? rate : 0.0;
    now.dq[i] = t < to_rest ? now.dq[i] + t * rate : 0.0;
  }
  return now;
}

}  // namespace steadyhand

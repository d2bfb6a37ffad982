#include "steadyhand/operator/protocol/policy_hand.hpp"

#include <algorithm>

namespace steadyhand {

void PolicyHand::begin(Time now) {
  due_ = now;
  open_ = true;
}

void PolicyHand::take(const PolicyTarget& target, Time now) {
  const bool goes_on =
      !is_stale(now) && target_.X_base_tool.p.allFinite() && target_.X_base_tool.q.coeffs().allFinite();
  from_ = goes_on ? at(now) : target.X_base_tool;
  target_ = target;
  heard_ = now;
}

bool PolicyHand::is_stale(Time t) const {
  return heard_ == Time::min() || t - heard_ > std::max(kPatience, from_seconds(3.0 * period_));
}

/// Newest target, or on the way there.
Pose PolicyHand::at(Time t) const {
  const Pose& to = target_.X_base_tool;
  const double part = to_seconds(t - heard_) / period_;
  if (part >= 1.0) return to;
  return {from_.p + std::max(part, 0.0) * (to.p - from_.p), from_.q.slerp(std::max(part, 0.0), to.q)};
}

bool PolicyHand::next(Time now, OperatorSample& sample) {
  if (due() > now) return false;
  const Time t = std::max(due_, now - kPeriod);  // missed samples are skipped
  due_ = t + kPeriod;
  sample = {};
  sample.stamp = {t, t};
  sample.leader = Leader::kPolicy;
  sample.tool = target_.tool;
  sample.tracked = !is_stale(t);
  sample.X_operator_hand = at(t);
  sample.gripper = target_.gripper;
  sample.clutch = !open_;
  if (sample.tracked) open_ = false;  // the next one closes the clutch
  return true;
}

}  // namespace steadyhand

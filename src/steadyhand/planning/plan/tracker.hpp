#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// q, dq, ddq at time t of a plan: exact between nodes; before the start the first state, after the end the last one at
/// rest. Safe for every time, and for intervals of any length. Allocates nothing.
JointCommand sample(const Plan& plan, Time t);

/// A plan that is stationary at q from `start` on. Allocates nothing.
void stand(const JointVector& q, Time start, Plan& plan);

/// Follows the newest plan at the arm's rate: interpolates position, velocity and acceleration exactly, and is
/// stationary after the plan's end if there is no newer one. Control thread; never waits, never allocates.
class Tracker {
 public:
  /// @param rest position until the first plan
  explicit Tracker(const JointVector& rest) { stand(rest, Time(0), plan_); }

  /// The next commands come from this plan.
  void follow(const Plan& plan) { plan_ = plan; }
  const Plan& plan() const { return plan_; }  ///< the followed plan
  /// Command to the arm at `now`.
  JointCommand update(Time now) const { return sample(plan_, now); }

 private:
  Plan plan_;
};

}  // namespace steadyhand

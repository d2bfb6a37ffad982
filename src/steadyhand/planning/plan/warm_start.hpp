#pragma once

#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

inline constexpr double kStill = 1e-9;  ///< rad/s (m/s)

/// The last solution as the start of the next solve, which begins any time later: accelerations and multipliers
/// shifted by that time. The constructor allocates all memory. The Ocp must outlive it.
class WarmStart {
 public:
  /// For solutions of this problem.
  explicit WarmStart(const Ocp& ocp);

  /// Starts without a solution: a stationary arm, no multipliers.
  void reset(Time now);
  /// @param start time of the solution's node 0
  void keep(const Solution& solution, Time start);
  /// Makes guess() and multipliers() for a problem that starts at x0 at time `start`; what was before the last solution
  /// is taken for its first node.
  void shift(const StateVector& x0, Time start);

  /// Joints of guess() that stop instead, evenly in the fewest whole intervals, or as hard as they can if they would
  /// pass a position limit. Below kStill they count as stationary.
  void stop(JointSet joints);

  /// The row now has another meaning: discards its multipliers from shift().
  void forget(int constraint, int row);

  /// As shift() left it.
  const Trajectory& guess() const { return guess_; }
  /// Null until something was kept.
  const Multipliers* multipliers() const { return known_ ? &multipliers_ : nullptr; }

 private:
  void shift_multipliers(double intervals);

  const Ocp& ocp_;
  Trajectory last_, guess_;
  Multipliers last_multipliers_, multipliers_;
  Time last_start_{0};
  bool known_ = false;
};

}  // namespace steadyhand

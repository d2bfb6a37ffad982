#pragma once

#include <Eigen/Core>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/plan/obstacle_sweep.hpp"
#include "steadyhand/planning/plan/plan_check.hpp"

namespace steadyhand {

/// Something for each pair of n + 1 links, the lower one first; behind these rows: obstacles (ObstacleRow) and a link.
template <typename T>
using LinkPairsOf =
    Eigen::Array<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxJoints + 1 + kObstacleRows, kMaxJoints + 1>;
using LinkPairs = LinkPairsOf<double>;    ///< numbers
using LinkPairsMask = LinkPairsOf<bool>;  ///< selects entries of LinkPairs
/// All the same.
template <typename T>
LinkPairsOf<T> all_link_pairs(const RobotModel& model, T value) {
  return LinkPairsOf<T>::Constant(model.dof() + 1 + kObstacleRows, model.dof() + 1, value);
}
/// The row of LinkPairs for a kind of obstacles.
inline int row_of(ObstacleRow kind, const RobotModel& model) { return model.dof() + 1 + kind; }

/// Smallest distance between the bodies of two links, or obstacles and a link, m; 1e6 where there are none or where it
/// is not wanted. Call set_position before.
/// @param t s, since the sweep's motion began
LinkPairs gaps(const Kinematics& kinematics, const ObstacleSweep& obstacles, double t, const LinkPairsMask& wanted);
/// All of them.
inline LinkPairs gaps(const Kinematics& kinematics, const ObstacleSweep& obstacles, double t) {
  return gaps(kinematics, obstacles, t, all_link_pairs(kinematics.model(), true));
}

/// Largest distance from a joint's origin to a point of a link that it moves, or of an object that a tool there
/// carries, m; indices (joint, link).
LinkPairs levers(const RobotModel& model, const Obstacles& obstacles);

/// The arm at one time of an interval with constant acceleration.
struct Moment {
  double t;        ///< s, since the sweep's motion began
  JointVector q;   ///< rad (m)
  JointVector dq;  ///< rad/s (m/s)
  LinkPairs gaps;  ///< m, or a lower bound
};

/// kSelfCollision or kObstacle where a gap is below `smallest`, else kNone.
PlanFault contact(const LinkPairs& gaps, const LinkPairs& smallest);

/// Whether gaps stay above `smallest` (m) from one moment to another: docs/explanation/formulation.md, "Between nodes".
/// For most gaps the earlier gap and the largest speeds prove it; only the others are computed. Where the bound is too
/// weak, the span is halved, up to 7 times, from 25 ms to 0.2 ms; a gap that is not proven then counts as too small.
class GapsBetween {
 public:
  /// @param smallest m; all references must outlive it
  /// @param tolerance m; gaps that may be below -tolerance belong to bodies that overlap at the beginning
  GapsBetween(Kinematics& kinematics, const ObstacleSweep& obstacles, const LinkPairs& levers,
              const LinkPairs& smallest, double tolerance);

  /// Sets last.gaps; improves first.gaps where it computes them.
  /// @param acceleration of the joints from `first` to `last`, rad/s^2 (m/s^2)
  PlanFault look(Moment& first, Moment& last, const JointVector& acceleration);

 private:
  LinkPairs gaps_at(const Moment& moment, const LinkPairsMask& wanted);
  PlanFault look_closer(const Moment& first, const Moment& last, const JointVector& acceleration, int halvings);

  Kinematics& kinematics_;
  const ObstacleSweep& obstacles_;
  const LinkPairs &levers_, &smallest_;
  double tolerance_;
  LinkPairs radii_;  ///< m, least sum of the radii of two bodies
};

}  // namespace steadyhand

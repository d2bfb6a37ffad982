#pragma once

#include <Eigen/Core>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/plan/obstacle_sweep.hpp"
#include "steadyhand/planning/plan/plan_check.hpp"

namespace steadyhand {

/// A value for each pair of links, the one nearer to the base first; the last rows: obstacles (ObstacleRow) and a link.
using LinkPairs = Eigen::Array<double, kMaxJoints + 1 + kObstacleRows, kMaxJoints + 1>;
/// The row of LinkPairs for a kind of obstacles.
constexpr int row_of(ObstacleRow kind) { return kMaxJoints + 1 + kind; }

/// Selects entries of LinkPairs.
using LinkPairsMask = Eigen::Array<bool, LinkPairs::RowsAtCompileTime, LinkPairs::ColsAtCompileTime>;

/// Smallest distance between the bodies of two links, or obstacles and a link, m; 1e6 where there are none or where it
/// is not wanted. Call set_position before.
/// @param t s, since the sweep's motion began
LinkPairs gaps(const Kinematics& kinematics, const ObstacleSweep& obstacles, double t,
               const LinkPairsMask& wanted = LinkPairsMask::Constant(true));

/// Largest distance from a joint's origin to a point of a later link, or of an object that the tool carries, m; indices
/// (joint, link).
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

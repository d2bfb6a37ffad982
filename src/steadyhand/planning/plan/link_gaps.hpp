#pragma once

#include <Eigen/Core>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/plan/obstacle_sweep.hpp"
#include "steadyhand/planning/plan/plan_check.hpp"

namespace steadyhand {

/// A value for each two links, the nearer to the base first; the last rows are for obstacles (ObstacleRow) and a link.
using LinkPairs = Eigen::Array<double, kMaxJoints + 1 + kObstacleRows, kMaxJoints + 1>;
/// Of LinkPairs: the row of obstacles of a kind.
constexpr int row_of(ObstacleRow kind) { return kMaxJoints + 1 + kind; }

/// Which of LinkPairs.
using LinkPairsMask = Eigen::Array<bool, LinkPairs::RowsAtCompileTime, LinkPairs::ColsAtCompileTime>;

/// Smallest gap between the bodies of two links, or obstacles and a link, m; 1e6 where there are none, and where nobody
/// wants to know. Call set_position before.
/// @param t s, since the sweep's motion began
LinkPairs gaps(const Kinematics& kinematics, const ObstacleSweep& obstacles, double t,
               const LinkPairsMask& wanted = LinkPairsMask::Constant(true));

/// No point of a link, or of what the tool carries, is ever further than this from the origin of a joint before it, m
/// (joint, link).
LinkPairs levers(const RobotModel& model, const Obstacles& obstacles);

/// The arm at one time of an interval with constant acceleration.
struct Moment {
  double t;        ///< s, since the sweep's motion began
  JointVector q;   ///< rad (m)
  JointVector dq;  ///< rad/s (m/s)
  LinkPairs gaps;  ///< m, or less than they are
};

/// kSelfCollision or kObstacle where a gap is below `smallest`, else kNone.
PlanFault contact(const LinkPairs& gaps, const LinkPairs& smallest);

/// Whether gaps stay above `smallest` (m) from one moment to another: docs/explanation/formulation.md, "Between nodes".
/// Most do by what they were and what the speeds allow; only the others are looked at. Where that is too much to tell,
/// the span is halved, up to 7 times, from 25 ms to 0.2 ms; what cannot be told then does not stay.
class GapsBetween {
 public:
  /// @param smallest m; all references must outlive it
  /// @param tolerance m; gaps that may be smaller than its negative are of what overlaps at the beginning
  GapsBetween(Kinematics& kinematics, const ObstacleSweep& obstacles, const LinkPairs& levers,
              const LinkPairs& smallest, double tolerance);

  /// Tells last.gaps, and first.gaps better where it has to look.
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

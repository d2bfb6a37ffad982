#pragma once

#include <Eigen/Core>

#include "steadyhand/robot/gaps.hpp"

namespace steadyhand {

/// A value for each two links, the nearer to the base first.
using LinkPairs = Eigen::Array<double, kMaxJoints + 1, kMaxJoints + 1>;

/// Smallest gap between the bodies of two links, m; infinity without pairs. Call set_position before.
LinkPairs gaps(const Kinematics& kinematics);

/// The arm at one time of an interval with constant acceleration.
struct Moment {
  double t;        ///< s since the interval's beginning
  JointVector q;   ///< rad (m)
  JointVector dq;  ///< rad/s (m/s)
  LinkPairs gaps;  ///< m
};

/// Whether gaps stay above `smallest` (m) between two moments at which they do: docs/formulation.md, "Between nodes".
/// Where what the speeds allow is too much to tell, the span is halved, up to 7 times, from 25 ms to 0.2 ms; what
/// cannot be told then does not stay.
class GapsBetween {
 public:
  /// @param smallest m
  GapsBetween(Kinematics& kinematics, double smallest);

  /// @param acceleration of the joints from `first` to `last`, rad/s^2 (m/s^2)
  bool stay(const Moment& first, const Moment& last, const JointVector& acceleration, int halvings = 7);

 private:
  Kinematics& kinematics_;
  LinkPairs levers_;  ///< m
  LinkPairs radii_;   ///< m, least sum of the radii of two bodies
  double smallest_;
};

}  // namespace steadyhand

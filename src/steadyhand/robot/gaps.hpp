#pragma once

#include <limits>

#include "steadyhand/collision/obstacle.hpp"
#include "steadyhand/robot/kinematics.hpp"

namespace steadyhand {

/// Signed distance of a pair's surfaces, m; negative by the depth while they overlap. Call set_position before.
double gap(const Kinematics& arm, const BodyPair& pair);

/// The same of a body of the arm and something else, whose shape is where `there` says, in the base.
double gap(const Kinematics& arm, int body, const Shape& other, const Placed& there);

/// A body of the arm, as an index into RobotModel::bodies, and how far the solid of an obstacle, without its margin,
/// is.
struct NearestBody {
  int body = -1;                                              ///< -1: all may touch it
  double distance = std::numeric_limits<double>::infinity();  ///< m, negative by the depth while they overlap
};

/// The nearest of the bodies that must not touch the obstacle, `t` s after it was at `obstacle.at`. Call set_position
/// before.
NearestBody nearest_body(const Kinematics& arm, const Obstacle& obstacle, double t);

/// Two bodies of a pair, as indices into RobotModel::bodies, and their gap.
struct NearestPair {
  int first = -1;                                        ///< -1: the model has no pairs
  int second = -1;                                       ///< the same
  double gap = std::numeric_limits<double>::infinity();  ///< m
};

/// The pair with the smallest gap. What plans, monitors, reports and pages say of distances is this. Call set_position
/// before.
NearestPair nearest_pair(const Kinematics& arm);

/// The smallest gap, m; negative when a pair overlaps, infinite without pairs. Call set_position before.
inline double clearance(const Kinematics& arm) { return nearest_pair(arm).gap; }

}  // namespace steadyhand

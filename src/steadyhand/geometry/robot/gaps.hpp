#pragma once

#include <limits>

#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

/// Where an obstacle is that a tool carries. Call set_position before.
template <typename Scalar>
PlacedOf<Scalar> placed_on_tool(const KinematicsOf<Scalar>& arm, const Obstacle& carried) {
  const Matrix3Of<Scalar>& R = arm.R(carried.tool);
  const Placed& at = carried.at;
  PlacedOf<Scalar> result{arm.p(carried.tool), Matrix3Of<Scalar>()};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      result.p[k] += R(k, i) * at.p[i];
      result.R(k, i) = R(k, 0) * at.R(0, i) + R(k, 1) * at.R(1, i) + R(k, 2) * at.R(2, i);
    }
  }
  return result;
}

/// A solid that moves with the arm (solid_of): its shape, link and pose. Call set_position before.
struct Solid {
  const Shape& shape;  ///< shape of the model, or the obstacles
  int link;            ///< link of the arm
  Placed at;           ///< in the base
};
/// @param index of a body, or solid_of an obstacle that is carried
Solid solid(const Kinematics& arm, const Obstacles& obstacles, int index);
/// Link of the arm that moves a solid.
inline int link_of(const RobotModel& model, const Obstacles& obstacles, int index) {
  return index < kMaxBodies ? model.bodies[index].link : model.tools[obstacles.list[index - kMaxBodies].tool].link;
}

/// Calls f(index) for each body of the arm and each obstacle that it carries.
template <typename F>
void for_each_solid(const RobotModel& model, const Obstacles& obstacles, const F& f) {
  for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) f(i);
  for (int o = 0; o < obstacles.count; ++o) {
    if (obstacles.list[o].carried) f(solid_of(o));
  }
}

/// Calls f(solid, obstacle) for each body of the arm and each obstacle that it carries and must keep apart from it, and
/// once for each two obstacles that different tools carry, of which the first is the solid. Solids on one link may
/// touch.
template <typename F>
void for_each_carried_pair(const RobotModel& model, const Obstacles& obstacles, const F& f) {
  for (int o = 0; o < obstacles.count; ++o) {
    const Obstacle& carried = obstacles.list[o];
    if (!carried.carried) continue;
    const int link = model.tools[carried.tool].link;
    for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
      if (model.bodies[i].link != link && !carried.ignores[i]) f(i, o);
    }
    for (int other = 0; other < o; ++other) {
      const Obstacle& first = obstacles.list[other];
      if (first.carried && model.tools[first.tool].link != link && !carried.ignores[solid_of(other)] &&
          !first.ignores[solid_of(o)])
        f(solid_of(other), o);
    }
  }
}

/// Signed distance of a pair's surfaces, m; negative by the depth while they overlap. Call set_position before.
double gap(const Kinematics& arm, const BodyPair& pair);

/// The same of a body of the arm and something else, whose shape is where `there` says, in the base.
double gap(const Kinematics& arm, int body, const Shape& other, const Placed& there);

/// The same of two solids, with their margins.
double solid_gap(const Kinematics& arm, const Obstacles& obstacles, int first, int second);

/// What moves with the arm, as solid() takes it, and how far the solid of an obstacle is, both without their margins.
struct NearestBody {
  int body = -1;                                              ///< -1: all may touch it
  double distance = std::numeric_limits<double>::infinity();  ///< m, negative by the depth while they overlap
};

/// The nearest of what moves with the arm and must not touch the obstacle, `t` s after Obstacles::time. If that is
/// carried itself, the nearest of for_each_carried_pair. Call set_position before.
NearestBody nearest_body(const Kinematics& arm, const Obstacles& obstacles, int obstacle, double t);

/// Two bodies of a pair, as solid() takes them, and their gap without margins.
struct NearestPair {
  int first = -1;                                        ///< -1: the model has no pairs
  int second = -1;                                       ///< the same
  double gap = std::numeric_limits<double>::infinity();  ///< m
};

/// The pair with the smallest gap, what the arm carries included. Plans, monitors, reports and pages
/// use these distances. Call set_position before.
NearestPair nearest_pair(const Kinematics& arm, const Obstacles& obstacles = kNoObstacles);

/// The smallest gap, m; negative when a pair overlaps, infinite without pairs. Call set_position before.
inline double clearance(const Kinematics& arm) { return nearest_pair(arm).gap; }

}  // namespace steadyhand

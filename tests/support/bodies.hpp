#pragma once

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/loading.hpp"

namespace steadyhand {

/// m, between the centres of a pair's bodies.
inline double center_distance(const Kinematics& arm, const BodyPair& pair) {
  return (arm.body(pair.first).p - arm.body(pair.second).p).norm();
}

/// A sphere for RobotSettings::bodies.
inline RobotSettings::BodyOnLink ball(const std::string& name, const std::string& link, const Vector3& center,
                                      double radius) {
  return {name, link, Shape::sphere(radius), Eigen::Isometry3d(Eigen::Translation3d(center))};
}

}  // namespace steadyhand

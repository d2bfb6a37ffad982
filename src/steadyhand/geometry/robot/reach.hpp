#pragma once

#include "steadyhand/core/math.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// The ball that holds every position the tool can take.
struct Reach {
  Vector3 center = Vector3::Zero();  ///< m, base frame; on the first joint's axis
  double radius = 0.0;               ///< m
};

/// The smallest such ball with its centre on the axis of the first joint, which for a revolute one is where symmetry
/// puts it: found by seeded sampling of the joints inside their limits, then a local ascent of the distance from the
/// samples farthest out, and 0.1 mm on top. Deterministic. Takes some 50 ms: for set-up, not for the loop.
Reach compute_reach(const RobotModel& model);

/// The point itself, or where the line from the centre to it leaves the ball. Allocates nothing.
Vector3 clip(const Reach& reach, const Vector3& point);

}  // namespace steadyhand

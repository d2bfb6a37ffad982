#pragma once

#include <cstdint>
#include <string_view>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/reach.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

/// Which limit of the optimal control problem holds the arm back.
enum class ConstraintKind : std::uint8_t {
  kNone,
  kPosition,
  kVelocity,
  kAcceleration,
  kSelfCollision,
  kReach,
  kObstacle
};
/// As recordings and the protocol call it, e.g. "self_collision".
std::string_view to_string(ConstraintKind kind);

/// The constraint, and whose it is.
struct ActiveConstraint {
  ConstraintKind kind = ConstraintKind::kNone;  ///< which limit
  int first = -1;                               ///< joint, or (first) body
  int second = -1;                              ///< second body of the pair, or index of the obstacle
};

/// What holds the arm back over a plan's first `nodes` nodes: the gravest of what is touched, with the clearance of the
/// instance that it solves, in the order reach (the instance's reference was clipped to it), self-collision, obstacle,
/// position, velocity, acceleration limit. Allocates nothing.
ActiveConstraint active_constraint(const Plan& plan, int nodes, const OcpInstance& instance, const Reach& reach,
                                   Kinematics& kinematics, const Obstacles& obstacles = kNoObstacles);

}  // namespace steadyhand

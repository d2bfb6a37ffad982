#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/names.hpp"
#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/model.hpp"
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
/// Their names in recordings and the protocol.
constexpr auto names_of(ConstraintKind) {
  using enum ConstraintKind;
  return named("ConstraintKind",
               {Name{kNone, "none"}, Name{kPosition, "position", "limit of joint `first`"},
                Name{kVelocity, "velocity", "limit of joint `first`"},
                Name{kAcceleration, "acceleration", "limit of joint `first`"},
                Name{kSelfCollision, "self_collision", "distance of bodies `first` and `second`"},
                Name{kReach, "reach", "reach of the arm"},
                Name{kObstacle, "obstacle", "distance of body `first` to object `second` of `cell`"}});
}

/// The constraint, and whose it is.
struct ActiveConstraint {
  ConstraintKind kind = ConstraintKind::kNone;  ///< which limit
  int first = -1;                               ///< joint, or (first) body
  int second = -1;                              ///< second body of the pair, or index of the obstacle
};

/// As recordings and the protocol have it (core/describe.hpp).
template <typename V>
void describe(V& v, ActiveConstraint& c) {
  v.type("ActiveConstraint", "A limit that holds the arm back.");
  v.add("kind", "", "which limit", c.kind);
  v.add("first", "", "joint, or (first) body; -1: none", c.first);
  v.add("second", "", "second body of the pair, or object; -1: none", c.second);
}

/// What holds the arm back over a plan's first `nodes` nodes: the gravest of what is touched, with the clearance of the
/// instance that it solves, in the order reach (the instance's reference was clipped to it), self-collision, obstacle,
/// position, velocity, acceleration limit. Allocates nothing.
/// @param reaches of each tool
ActiveConstraint active_constraint(const Plan& plan, int nodes, const OcpInstance& instance,
                                   std::span<const Reach> reaches, Kinematics& kinematics,
                                   const Obstacles& obstacles = kNoObstacles);

}  // namespace steadyhand

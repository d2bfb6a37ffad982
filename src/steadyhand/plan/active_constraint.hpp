#pragma once

#include "steadyhand/core/live.hpp"
#include "steadyhand/robot/kinematics.hpp"
#include "steadyhand/robot/reach.hpp"

namespace steadyhand {

/// What holds the arm back over a plan's first `nodes` nodes: the gravest of what is touched, in the order reach (the
/// reference was clipped to it), self-collision, position, velocity, acceleration limit. Allocates nothing.
ActiveConstraint active_constraint(const Plan& plan, int nodes, const Reference& reference, const Reach& reach,
                                   Kinematics& kinematics);

}  // namespace steadyhand

#pragma once

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

/// Adds a stop after interval `first` - 1 of the plan, of as many intervals as `duration` s need. The tool continues
/// along its path and stops smoothly and upright. Unlike joints that brake evenly, this does not tilt a glass. Does
/// not check limits. Sets plan.intervals. If there are not enough intervals, returns false and leaves the plan as it
/// was. Allocates nothing.
/// @param given joints that only continue to brake as in the plan's first interval
bool make_level_stop(Kinematics& arm, int first, double duration, JointSet given, Plan& plan);

}  // namespace steadyhand

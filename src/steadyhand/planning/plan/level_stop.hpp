#pragma once

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

/// Puts a stop behind interval `first` - 1 of the plan, of as many intervals as `duration` s need: the tool goes on
/// along its way and comes smoothly to rest, upright, so that a glass is not tilted by the stop, as it is by joints
/// that brake evenly. Limits are not looked at. Sets plan.intervals; returns false, and leaves the plan as it was,
/// where there are not enough intervals. Allocates nothing.
bool make_level_stop(Kinematics& arm, int first, double duration, Plan& plan);

}  // namespace steadyhand

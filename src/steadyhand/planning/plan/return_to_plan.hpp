#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// A plan that leads from a command back to another plan, which it left, and along that to its end. Each joint's
/// difference in position and speed decays to zero by two constant accelerations, each `steps` intervals of 10 ms long.
/// Unchecked: the limits are not looked at. Returns false where that plan goes on for too long. Allocates nothing.
bool make_return(const Plan& followed, const JointCommand& from, int steps, Plan& plan);

}  // namespace steadyhand

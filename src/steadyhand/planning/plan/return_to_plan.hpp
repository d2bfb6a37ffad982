#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// A plan that returns from a command to the plan that it left and follows that to its end. Each joint's
/// difference in position and speed decays to zero by two constant accelerations, each `steps` intervals of 10 ms long.
/// Does not check limits. Returns false if the other plan is too long. Allocates nothing.
bool make_return(const Plan& followed, const JointCommand& from, int steps, Plan& plan);

}  // namespace steadyhand

#pragma once

#include <span>
#include <vector>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// The motion that commands have begun and their plan ends, as points for a controller that joins them by quintics:
/// first the commands (what it does already, so that it may take over anywhere among them without a step), then the
/// rest of the plan, to rest. Accelerations of a plan jump at its nodes, and a quintic from node to node would
/// overshoot by a third of the jump; so there is a point just before each node and one just behind it, between which
/// the quintics are the plan itself.
/// @param commands in order of time, at least one, the last one on the plan
/// @param points their stamps say when; strictly increasing; the last one at rest, its velocity exactly 0
void make_trajectory(std::span<const JointCommand> commands, const Plan& plan, std::vector<JointCommand>& points);

}  // namespace steadyhand

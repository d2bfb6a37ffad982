#pragma once

#include <string>

#include "steadyhand/robot/model.hpp"

namespace steadyhand {

/// What `steadyhand describe` prints of a robot: joints, tool, limits, bodies, pairs.
/// @param indent spaces of each level; -1: on one line
std::string robot_json(const RobotModel& model, int indent = -1);

}  // namespace steadyhand

#pragma once

#include <string>

#include "steadyhand/files/record/json_reader.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// What `steadyhand describe` prints of a robot: joints, tool, limits, bodies, pairs.
/// @param indent spaces of each level; -1: on one line
std::string robot_json(const RobotModel& model, int indent = -1);

/// The robot again; without names of links but the base's, which are not told. Throws json::Wrong, also for an arm that
/// cannot be.
/// @param key of the robot, for messages
RobotModel read_robot_json(const OrderedJson& json, const std::string& key);

}  // namespace steadyhand

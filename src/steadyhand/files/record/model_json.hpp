#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/geometry/robot/model.hpp"

/// Robots, cells and solids as recordings, pages and the command line have them: each is described once, in
/// model_json.cpp. What reads them throws json::Wrong. @param key of the object, for messages
namespace steadyhand {

using OrderedJson = nlohmann::ordered_json;  ///< keys in the order of docs/explanation/formulation.md

namespace json {

/// Carries the first error out of nested readers; does not leave their module.
struct Wrong {
  std::string message;
};
[[noreturn]] inline void fail(const std::string& key, const std::string& what) { throw Wrong{key + ": " + what}; }

}  // namespace json

/// {"name", "at_s", "objects": [{"name", "shape", "origin", sizes as for bodies in docs/explanation/formulation.md,
/// "velocity", "margin", "color", "holds_only_tool", "attached", "may_be_touched_by"}]}. One line.
/// @param at when its objects are where they say; without it there is no "at_s"
std::string cell_json(const Cell& cell, std::optional<Time> at = {});
Cell read_cell_json(const OrderedJson& json, const std::string& key);

/// What `steadyhand describe` prints of a robot: joints, tool, limits, bodies, pairs.
/// @param indent spaces of each level; -1: on one line
std::string robot_json(const RobotModel& model, int indent = -1);
/// Reads robot_json() back; it has no link names except the base's. Fails also for an impossible arm.
RobotModel read_robot_json(const OrderedJson& json, const std::string& key);

}  // namespace steadyhand

#pragma once

#include <optional>
#include <string>

#include "steadyhand/core/time.hpp"
#include "steadyhand/files/record/json_reader.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

namespace steadyhand {

/// {"name", "at_s", "objects": [{"name", "shape", "origin", sizes as of bodies in docs/formulation.md, "velocity",
/// "margin", "color", "holds_only_tool"}]}. One line.
/// @param at when its objects are where they say; without it there is no "at_s"
std::string cell_json(const Cell& cell, std::optional<Time> at = {});

/// What cell_json() wrote, read back. Throws json::Wrong.
/// @param key of the object, for messages
Cell read_cell_json(const OrderedJson& json, const std::string& key);

}  // namespace steadyhand

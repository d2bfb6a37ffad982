#pragma once

#include <optional>
#include <string>

#include "steadyhand/core/time.hpp"
#include "steadyhand/robot/cell.hpp"

namespace steadyhand {

/// {"name", "at_s", "objects": [{"name", "shape", "origin", sizes as of bodies in docs/formulation.md, "velocity",
/// "margin", "color", "holds_only_tool"}]}. One line.
/// @param at when its objects are where they say; without it there is no "at_s"
std::string cell_json(const Cell& cell, std::optional<Time> at = {});

}  // namespace steadyhand

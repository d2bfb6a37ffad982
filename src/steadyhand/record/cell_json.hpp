#pragma once

#include <string>

#include "steadyhand/robot/cell.hpp"

namespace steadyhand {

/// {"name", "objects": [{"name", "shape", "origin", sizes as of bodies in docs/formulation.md, "velocity", "margin",
/// "color",
/// "holds_only_tool"}]}. One line.
std::string cell_json(const Cell& cell);

}  // namespace steadyhand

#pragma once

#include <filesystem>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

namespace steadyhand {

/// Reads cells/NAME.yaml (its keys: docs/how-to/add-a-table.md); a world of cuRobo's in YAML, MoveIt's text (.scene)
/// and a cell's URDF (.urdf), too. Fails as YamlMap says.
Result<Cell> load_cell(const std::filesystem::path& file);

}  // namespace steadyhand

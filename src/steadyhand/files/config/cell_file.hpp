#pragma once

#include <string>

#include "steadyhand/files/config/places.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

namespace steadyhand {

/// Reads cells/NAME.yaml (its keys: docs/how-to/add-a-table.md); a world of cuRobo's in YAML, MoveIt's text (.scene)
/// and a cell's URDF (.urdf), too. Fails as YamlMap says.
Result<Cell> load_cell(const std::filesystem::path& file);

/// A cell by name ("table") or by the path of its file; "none" is empty.
Result<Cell> open_cell(const std::string& name, const Places& places = Places::standard());

}  // namespace steadyhand

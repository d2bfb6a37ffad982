#pragma once

#include <filesystem>

#include "steadyhand/files/config/yaml_reader.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

/// Cells as other software writes them. Their frame is taken for the arm's base; margins are CellObject's default. Each
/// fails on what it cannot keep the arm clear of, such as meshes, with file, line or object, and the reason. All
/// solids of one object have its name; load_cell() makes the names unique.
namespace steadyhand {

/// MoveIt's scene text (.scene), in the version where objects have poses and in the older one.
Result<Cell> load_moveit_scene(const std::filesystem::path& file);

/// The collision boxes, spheres and cylinders of a URDF whose joints are fixed.
Result<Cell> load_urdf_cell(const std::filesystem::path& file);

/// How far the norm of a quaternion in such files may be off 1.
constexpr double kQuaternionTolerance = 1e-3;

/// "#rrggbb" of red, green and blue from 0 to 1; what is beyond counts as the end.
std::string hex_color(const std::vector<double>& rgb);

/// Whether a YAML file is a world of cuRobo's.
bool is_curobo_world(YamlMap& map);
/// That world's cuboids, spheres, capsules and cylinders; the mapping's finish() reports errors.
void read_curobo_world(YamlMap& map, Cell& cell);

}  // namespace steadyhand

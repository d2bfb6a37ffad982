#pragma once

#include <urdf_model/pose.h>
#include <urdf_world/types.h>

#include <filesystem>
#include <optional>
#include <string>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Parses a URDF, or one with xacro macros (expand_xacro), and checks what urdfdom lets through. In the model that
/// comes back every link hangs on the root by exactly one path, and every mesh file exists. Refuses, with the reason: a
/// file that is missing, empty, no XML or no URDF, a loop, a link with two parents, several roots, a missing mesh.
/// Prints nothing.
///
/// Mesh names are paths relative to the URDF's folder, file:// paths, or package://NAME/PATH, where the folder NAME is
/// looked for in the URDF's folder and those above it; where there is none, PATH alone, as packages are copied under
/// other names.
Result<urdf::ModelInterfaceSharedPtr> read_urdf(const std::filesystem::path& file);

/// A pose of a URDF.
Eigen::Isometry3d to_eigen(const urdf::Pose& pose);

/// The file that a mesh's name in a URDF stands for, if there is one. folder: the URDF's, absolute
std::optional<std::filesystem::path> find_mesh(const std::filesystem::path& folder, const std::string& name);

}  // namespace steadyhand

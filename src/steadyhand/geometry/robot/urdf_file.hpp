#pragma once

#include <urdf_model/pose.h>
#include <urdf_world/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/urdf_text.hpp"

namespace steadyhand {

/// An element of a link that cannot be read.
struct UnreadElement {
  std::string link;     ///< its name
  std::string element;  ///< inertial or visual
  std::string where;    ///< file and line
  std::string reason;   ///< for people
};

/// urdfdom's model of a URDF. urdfdom stops reading a link at the first element that it cannot read, and drops
/// those after it. Here such an inertial or visual element is taken out first and added to `unread`, so that a link
/// always has each of its collision elements; one of these that cannot be read is an error. Prints nothing.
/// @param file for messages
Result<urdf::ModelInterfaceSharedPtr> parse_urdf(const std::filesystem::path& file, const UrdfText& text,
                                                 std::vector<UnreadElement>& unread);

/// Parses a URDF and checks what urdfdom lets through. In the model that comes back every link hangs on the root by
/// exactly one path and has all of its collision elements, and every mesh file exists. Refuses, with the reason: a file
/// that is missing, empty, no XML or no URDF, a loop, a link with two parents, several roots, a collision element that
/// cannot be read, a missing mesh. Prints nothing.
///
/// Mesh names are paths relative to the URDF's folder, file:// paths, or package://NAME/PATH, where the folder NAME is
/// looked for in the URDF's folder and those above it; if there is none, PATH alone, because packages are copied under
/// other names. If there is no such file, %20 and the like are decoded.
/// @param unread receives the elements that cannot be read; nullptr: the caller needs neither
Result<urdf::ModelInterfaceSharedPtr> read_urdf(const std::filesystem::path& file, Xacro xacro = Xacro::kIfNamed,
                                                std::vector<UnreadElement>* unread = nullptr);

/// A pose of a URDF.
Eigen::Isometry3d to_eigen(const urdf::Pose& pose);

/// The file that a mesh's name in a URDF refers to, if it exists. folder: the URDF's, absolute
std::optional<std::filesystem::path> find_mesh(const std::filesystem::path& folder, const std::string& name);

}  // namespace steadyhand

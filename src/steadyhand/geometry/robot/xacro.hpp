#pragma once

#include <filesystem>
#include <string>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// The output of the command `xacro FILE`: the URDF of a file of xacro macros with its default arguments.
/// Runs the code in the file: xacro's expressions are Python. $(find PACKAGE) is a folder of that name in the file's
/// folder or above it, or one above it whose package.xml has the name; where ROS is set up, what ROS finds.
/// Refuses, with the reason: no such command on the PATH; a file that xacro itself refuses.
Result<std::string> expand_xacro(const std::filesystem::path& file);

}  // namespace steadyhand

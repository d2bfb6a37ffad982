#pragma once

#include <filesystem>
#include <string>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// What the command `xacro FILE` prints: the URDF that a file of xacro macros stands for, with its default arguments.
/// Refuses, with the reason: no such command on the PATH, and whatever xacro itself refuses.
Result<std::string> expand_xacro(const std::filesystem::path& file);

}  // namespace steadyhand

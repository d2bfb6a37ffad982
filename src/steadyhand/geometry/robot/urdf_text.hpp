#pragma once

#include <filesystem>
#include <string>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Whether xacro macros are expanded. Their expressions are Python, so expanding runs the code in the file.
enum class Xacro { kNever, kIfNamed, kAlways };

/// The text of a URDF.
struct UrdfText {
  std::string text;       ///< XML
  bool expanded = false;  ///< by xacro: lines are not those of the file
};

/// A URDF's text, which is expanded by `expand_xacro` if `xacro` is kAlways, or kIfNamed and the file's name ends in
/// .xacro. Refuses, with the reason: a file that is missing, empty, UTF-16 or a Git LFS pointer.
Result<UrdfText> read_urdf_text(const std::filesystem::path& file, Xacro xacro = Xacro::kIfNamed);

}  // namespace steadyhand

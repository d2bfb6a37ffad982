#pragma once

#include <filesystem>
#include <string>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// The text of a URDF.
struct UrdfText {
  std::string text;       ///< XML
  bool expanded = false;  ///< by xacro: lines are not those of the file
};

/// A URDF's text, expanded by `expand_xacro` if it has macros. Refuses, with the reason: a file that is missing or empty.
Result<UrdfText> read_urdf_text(const std::filesystem::path& file);

}  // namespace steadyhand

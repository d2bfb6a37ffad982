#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Folders of the files that have a short name.
struct Places {
  std::filesystem::path data;  ///< robots/, profiles/, recordings/
  /// Where Python packages are installed; the first that has a file counts.
  std::vector<std::filesystem::path> packages;

  /// `data` is share/steadyhand in the folder of this library or program, or one or two folders above it, as it was
  /// built or installed; the environment variable STEADYHAND_DATA names another. `packages` is the folder of that name
  /// in there, followed by the folders of the environment variable STEADYHAND_PACKAGES, separated by colons.
  static Places standard();
};

/// `name` is a path if it has a folder or an extension or is a file; else NAME.yaml in the `folder` of the data. Fails
/// if there is no such file, and lists the names that there are.
Result<std::filesystem::path> find_named_file(const Places& places, const std::string& folder, const std::string& name);

/// Names that find_named_file knows, sorted.
std::vector<std::string> names_in(const Places& places, const std::string& folder);

/// A file inside an installed Python package.
Result<std::filesystem::path> find_in_package(const Places& places, const std::string& package,
                                              const std::string& path);

}  // namespace steadyhand

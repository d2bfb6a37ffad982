#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Where the files are that a short name stands for.
struct Places {
  std::filesystem::path root;          ///< the checkout: robots/, profiles/
  std::filesystem::path dependencies;  ///< the pinned packages: venv/lib/python3*/site-packages, node_modules

  /// The checkout that this program was built from; the environment variable STEADYHAND_DEPS moves `dependencies`.
  static Places standard();
};

/// `name` is a path if it has a folder or an extension or is a file; else NAME.yaml in the checkout's `folder`. Fails
/// if there is no such file, and lists the names that there are.
Result<std::filesystem::path> find_named_file(const Places& places, const std::string& folder, const std::string& name);

/// Names that find_named_file knows, sorted.
std::vector<std::string> names_in(const Places& places, const std::string& folder);

/// A file inside an installed Python package.
Result<std::filesystem::path> find_in_package(const Places& places, const std::string& package,
                                              const std::string& path);

}  // namespace steadyhand

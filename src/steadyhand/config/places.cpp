#include "steadyhand/config/places.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

namespace steadyhand {

namespace fs = std::filesystem;

Places Places::standard() {
  const char* moved = std::getenv("STEADYHAND_DEPS");
  return {STEADYHAND_SOURCE_ROOT, moved != nullptr && *moved != '\0' ? moved : STEADYHAND_DEPS};
}

std::vector<std::string> names_in(const Places& places, const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(places.root / folder, error)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<fs::path> find_named_file(const Places& places, const std::string& folder, const std::string& name) {
  std::error_code error;
  const fs::path path(name);
  if (name.empty()) return Error{fmt::format("a name is expected: {}", fmt::join(names_in(places, folder), ", "))};
  if (!path.has_parent_path() && !path.has_extension()) {
    const fs::path named = places.root / folder / (name + ".yaml");
    if (fs::is_regular_file(named, error)) return named;
  }
  if (fs::is_regular_file(path, error)) return path;
  return Error{fmt::format("'{}' is neither a file nor one of the names in {}/: {}", name, folder,
                           fmt::join(names_in(places, folder), ", "))};
}

Result<fs::path> find_in_package(const Places& places, const std::string& package, const std::string& path) {
  std::error_code error;
  for (const fs::directory_entry& python : fs::directory_iterator(places.dependencies / "venv/lib", error)) {
    const fs::path file = python.path() / "site-packages" / package / path;
    if (fs::is_regular_file(file, error)) return file;
  }
  return Error{fmt::format("Python package '{}' has no file '{}' under {}; ./steadyhand installs the pinned packages",
                           package, path, places.dependencies.string())};
}

}  // namespace steadyhand

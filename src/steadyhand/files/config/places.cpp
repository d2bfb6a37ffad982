#include "steadyhand/files/config/places.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "steadyhand/core/folder.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

/// The shared library that holds this function, or the program.
fs::path this_binary() {
  std::error_code error;
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&names_in), &info) != 0 && info.dli_fname != nullptr) {
    const fs::path file(info.dli_fname);
    if (file.filename().string().find(".so") != std::string::npos) return fs::canonical(file, error);
  }
  return fs::canonical("/proc/self/exe", error);
}

fs::path data_folder() {
  const char* named = std::getenv("STEADYHAND_DATA");
  if (named != nullptr && *named != '\0') return named;
  const fs::path folder = this_binary().parent_path();
  std::error_code error;
  for (const char* above : {".", "..", "../.."}) {
    const fs::path data = (folder / above / "share/steadyhand").lexically_normal();
    if (fs::is_directory(data, error)) return data;
  }
  return folder / "share/steadyhand";
}

}  // namespace

Places Places::standard() {
  Places places{data_folder(), {}};
  std::error_code error;
  if (fs::is_directory(places.data / "packages", error)) places.packages.push_back(places.data / "packages");
  const char* named = std::getenv("STEADYHAND_PACKAGES");
  std::istringstream folders(named != nullptr ? named : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (!folder.empty()) places.packages.emplace_back(folder);
  }
  return places;
}

std::vector<std::string> names_in(const Places& places, const std::string& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : entries_of(places.data / folder)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<fs::path> find_named_file(const Places& places, const std::string& folder, const std::string& name) {
  std::error_code error;
  const fs::path path(name);
  if (!name.empty() && !path.has_parent_path() && !path.has_extension()) {
    const fs::path named = places.data / folder / (name + ".yaml");
    if (fs::is_regular_file(named, error)) return named;
  }
  if (fs::is_regular_file(path, error)) return path;
  const std::vector<std::string> names = names_in(places, folder);
  if (names.empty()) {
    return Error{
        fmt::format("'{}' is no file, and there are no {} in {}: set STEADYHAND_DATA to the folder that has them", name,
                    folder, places.data.string())};
  }
  return Error{
      fmt::format("'{}' is neither a file nor one of the names in {}/: {}", name, folder, fmt::join(names, ", "))};
}

Result<fs::path> find_in_package(const Places& places, const std::string& package, const std::string& path) {
  std::error_code error;
  std::string looked;
  for (const fs::path& packages : places.packages) {
    const fs::path file = packages / package / path;
    if (fs::is_regular_file(file, error)) return file;
    looked += (looked.empty() ? "" : ", ") + packages.string();
  }
  if (looked.empty()) looked = (places.data / "packages").string() + ", which is not there";
  return Error{fmt::format("Python package '{}' with its file '{}' is not in {}: install the package there", package,
                           path, looked)};
}

}  // namespace steadyhand

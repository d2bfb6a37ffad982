#include "steadyhand/arms/mujoco/mujoco_library.hpp"

#include <fmt/format.h>

#include <mutex>

#include "steadyhand/core/folder.hpp"

namespace steadyhand {

namespace {

std::mutex loading;
const MujocoLibrary* loaded = nullptr;

/// MuJoCo prints its warnings; what matters here is looked up in its data.
void be_silent(const char*) {}

/// Files that may be it, those of the wanted version first, so that an error names them.
std::vector<std::string> candidates(const std::vector<std::filesystem::path>& packages, const std::string& wanted) {
  std::vector<std::string> files;
  for (const std::filesystem::path& folder : packages) files.push_back(folder / "mujoco" / wanted);
  files.push_back(wanted);
  for (const std::filesystem::path& folder : packages) {
    for (const auto& entry : entries_of(folder / "mujoco")) {
      if (entry.path().filename().string().starts_with("libmujoco.so.")) files.push_back(entry.path());
    }
  }
  return files;
}

}  // namespace

Status load_mujoco(const std::vector<std::filesystem::path>& packages) {
  const std::lock_guard lock(loading);
  if (loaded != nullptr) return Done{};
  const std::string wanted =
      fmt::format("{}.{}.{}", mjVERSION_HEADER / 1000000, mjVERSION_HEADER / 1000 % 1000, mjVERSION_HEADER % 1000);
  std::string remedy = fmt::format("install it with 'pip install mujoco-core=={}'", wanted);
  if (!packages.empty()) {
    remedy += fmt::format("; outside a Python environment add '--no-deps --target {}'", packages.front().string());
  }
  const Result<SharedLibrary> library = SharedLibrary::load(candidates(packages, "libmujoco.so." + wanted));
  if (!library) {
    return Error{fmt::format("MuJoCo {} is not installed: {}. Tried: {}", wanted, remedy, library.error().message)};
  }
  const MujocoLibrary found{*library};
  if (found.mj_version != nullptr && found.mj_versionString != nullptr && found.mj_version() != mjVERSION_HEADER) {
    return Error{fmt::format("{} is MuJoCo {}, and this program needs {}: {}", library->name(),
                             found.mj_versionString(), wanted, remedy)};
  }
  if (Status s = found.in.complete(); !s) return Error{fmt::format("{}: {}", s.error().message, remedy)};
  *found.mju_user_warning = be_silent;
  loaded = new MujocoLibrary(found);  // for good
  return Done{};
}

const MujocoLibrary& mujoco() { return *loaded; }

}  // namespace steadyhand

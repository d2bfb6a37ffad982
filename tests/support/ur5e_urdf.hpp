#pragma once

#include <filesystem>

namespace steadyhand {

/// The UR5e of the pinned package airo_models; empty if the packages are not installed.
inline std::filesystem::path ur5e_urdf() {
  std::error_code error;
  for (const auto& python : std::filesystem::directory_iterator(STEADYHAND_DEPS "/venv/lib", error)) {
    const auto file = python.path() / "site-packages/airo_models/arms/ur5e/ur5e.urdf";
    if (std::filesystem::exists(file)) return file;
  }
  return {};
}

}  // namespace steadyhand

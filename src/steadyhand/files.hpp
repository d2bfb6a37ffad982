#pragma once

/// Files: robots, profiles and obstacles by name or path, and recorded hands.
///
///     auto arm = open_pipeline("ur5e", "profiles/mine.yaml");
///     if (!arm) std::cerr << arm.error().message;     // names the file, the key and what would be right

#include "steadyhand/files/config/cell_file.hpp"
#include "steadyhand/files/config/open_pipeline.hpp"
#include "steadyhand/files/config/profile_file.hpp"
#include "steadyhand/files/config/robot_file.hpp"

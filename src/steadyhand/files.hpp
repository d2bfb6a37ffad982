#pragma once

/// Files: robots, profiles and obstacles by name or path.
///
///     auto arm = open_pipeline("ur5e", "profiles/mine.yaml");
///     if (!arm) std::cerr << arm.error().message;     // names the file, the key and what would be right

#include "steadyhand/files/config/open.hpp"

#pragma once

#include <string>

namespace steadyhand {

/// Of the sources, with "-dirty" if they were changed; or "unknown". Written at each build (cmake/commit.cmake).
extern const char* const kCommit;

/// What --version prints, for a bug report: version, commit, the processor that the planner is compiled for, parts.
std::string version_text();

}  // namespace steadyhand

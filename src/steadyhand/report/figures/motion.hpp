#pragma once

#include <cstddef>
#include <limits>
#include <string>

#include "steadyhand/files/record/session_file.hpp"

namespace steadyhand {

/// A session as page and report replay it, as JSON: `motion` of docs/reference/protocol.md, "Recorded sessions".
/// @param period s, smallest time between two rows of `target`
/// @param most_rows limit for each list of times; in longer lists one row replaces several and keeps their worst values
std::string motion_json(const SessionFile& session, double period,
                        std::size_t most_rows = std::numeric_limits<std::size_t>::max());

}  // namespace steadyhand

#pragma once

#include <cstddef>
#include <limits>
#include <string>

#include "steadyhand/files/record/session_file.hpp"

namespace steadyhand {

/// A session as page and report replay it, as JSON: `motion` of docs/reference/protocol.md, "Recorded sessions".
/// @param period s, between two rows of `target`, at least
/// @param most_rows of each list of times; of more, one stands for several, and keeps the worst of them
std::string motion_json(const SessionFile& session, double period,
                        std::size_t most_rows = std::numeric_limits<std::size_t>::max());

}  // namespace steadyhand

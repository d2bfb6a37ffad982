#pragma once

#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

namespace steadyhand {

/// The obstacles around the arm from a time of a session on; moving ones have their poses of that time.
struct CellChange {
  Time at{0};
  Cell cell;
};

}  // namespace steadyhand

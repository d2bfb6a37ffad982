#pragma once

#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/cell.hpp"

namespace steadyhand {

/// What stands around the arm from a time of a session on; what moves is there then.
struct CellChange {
  Time at{0};
  Cell cell;
};

}  // namespace steadyhand

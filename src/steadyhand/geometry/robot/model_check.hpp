#pragma once

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Why the model is invalid, or Done: for models that are not read from a file. Sizes, finite numbers, limits, axes,
/// and the links and bodies that bodies and pairs name. Does not check where home is.
Status check(const RobotModel& model);

}  // namespace steadyhand

#pragma once

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Why there is no such arm, or Done: for models that no file was read for. Sizes, finite numbers, limits, axes, and
/// the links and bodies that bodies and pairs name. Where home lies is not looked at.
Status check(const RobotModel& model);

}  // namespace steadyhand

#pragma once

/// Geometry: a robot as a model, where its bodies are, and how near they come to each other and to obstacles.
///
///     Result<RobotModel> model = open_robot("ur5e");  // steadyhand/files.hpp
///     Kinematics arm(*model);
///     arm.update(q);                                  // poses and derivatives, without allocation

#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/geometry/robot/model.hpp"

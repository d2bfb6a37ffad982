#pragma once

#include <memory>

#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand::python {

/// A model and scratch to evaluate it, under Python's lock.
struct Robot {
  explicit Robot(RobotModel loaded) : model(std::make_shared<const RobotModel>(std::move(loaded))), arm(*model) {}

  std::shared_ptr<const RobotModel> model;
  Kinematics arm;
};

}  // namespace steadyhand::python

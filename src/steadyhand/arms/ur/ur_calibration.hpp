#pragma once

#include "steadyhand/arms/ur/ur_primary.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// How far an arm's factory-measured kinematics is from a model's, at the zero pose.
struct UrDeviation {
  double joint_m = 0.0, joint_rad = 0.0;  ///< largest deviation of a joint's axis
  double tool_m = 0.0;                    ///< deviation of the tool
};

/// The model with its joint axes where the factory measured them, and its tool carried along. Each link keeps its frame
/// as nearly as its axis allows (parallel axes have their parameters far away), so bodies and meshes stay where they
/// are. Fails if that is another arm: an axis further than 20 mm or 0.1 rad from the model's. @pre six revolute joints
Result<RobotModel> calibrate(const RobotModel& model, const UrKinematics& kinematics, UrDeviation& deviation);

}  // namespace steadyhand

#pragma once

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/robot/model.hpp"

namespace steadyhand {

/// Shortest time in which all joints can come to rest from these velocities, s.
double stop_time(const RobotModel& model, const JointVector& dq);

/// A plan in which all joints brake evenly from a command on, so that the arm stays on its course: in `duration` s, or
/// in stop_time() if that is longer, or in 1 ms. Unchecked. Allocates nothing.
void make_straight_stop(const RobotModel& model, const JointCommand& from, double duration, Plan& plan);

}  // namespace steadyhand

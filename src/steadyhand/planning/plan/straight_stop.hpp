#pragma once

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Shortest time in which all joints can stop from these velocities, s.
double stop_time(const RobotModel& model, const JointVector& dq);

/// rad/s (m/s), by which the speed of joint j falls in each of `intervals` of dt (s) if it brakes evenly, or in fewer
/// intervals if it would pass a position limit. If even these are too many: as much as its acceleration limit allows.
double braking_step(const RobotModel& model, int j, double q, double dq, int intervals, double dt);

/// Where the joints are t (s) after they began to brake evenly, in stop_time(), from a position and velocity.
JointVector straight_stop_at(const RobotModel& model, const JointVector& q, const JointVector& dq, double t);

/// A plan in which all joints brake evenly from a command on, so that the arm stays on its path: in `duration` s, or
/// in stop_time() if that is longer, or in 1 ms. Unchecked. Allocates nothing.
void make_straight_stop(const RobotModel& model, const JointCommand& from, double duration, Plan& plan);

/// A plan from a command at rest straight to `to`, at rest: all joints accelerate evenly, then brake, in `duration` s,
/// or as fast as the limits of speed and acceleration allow if that takes longer. Unchecked. Allocates nothing.
void make_straight_move(const RobotModel& model, const JointCommand& from, const JointVector& to, double duration,
                        Plan& plan);

}  // namespace steadyhand

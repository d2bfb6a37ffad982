#pragma once

#include <functional>
#include <string>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand::bench {

/// Where the glass shall be at time t, s.
using TargetPath = std::function<Pose(double t)>;

/// A closed loop for solvers to run: a target that moves, and how often is planned.
struct Sequence {
  std::string name;
  bool hard = false;       ///< against limits, through jumps or noise
  double rate_hz = 500.0;  ///< of planning
  double noise = 0.0;      ///< on x_0: standard deviation of joint angles, rad; of speeds ten times that a second
  double period = 0.0;     ///< s, after which the path begins again
  TargetPath target;
};

/// All of them, for one robot: the bundled recording at 20 and 500 Hz, smooth motion of 0.6 m/s and 1 rad/s, targets
/// pushed into the arm itself, beyond the reach and faster than joints can turn, jumps of 0.3 m, and noise on x_0.
/// `seed` draws the amplitudes and phases.
Result<std::vector<Sequence>> make_sequences(const RobotModel& model, unsigned seed);

/// A table below the arm and boxes, posts and balls of 2 to 15 cm around it, none nearer than 5 cm to where it begins.
Obstacles make_obstacles(const RobotModel& model, int count, unsigned seed);

}  // namespace steadyhand::bench

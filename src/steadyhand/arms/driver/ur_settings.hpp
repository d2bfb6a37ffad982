#pragma once

#include <cstdint>
#include <string>

#include "steadyhand/core/math.hpp"

namespace steadyhand {

struct UrProgramSettings {
  int session = 1;                ///< session number of the set-points that it follows; it ignores others
  double step = 0.002;            ///< s, of the controller's cycle
  int bridged = 2;                ///< lost cycles over which set-points are extrapolated
  double timeout = 0.05;          ///< s without a new set-point after which it brakes, stops and ends
  double first_wait = 2.0;        ///< s that it waits for the first set-point
  double start_tolerance = 0.05;  ///< rad, from the arm's position to the first set-point, all joints together
  double return_tolerance = 0.1;  ///< rad, from the arm's position after a gap to a set-point, any joint
  double braking = 10.0;          ///< rad/s^2, when set-points are missing
  double rejoin = 1.3;           ///< times acceleration_max: the most on the way back, so that plans are caught up with
  double state_period = 0.0;     ///< s between states over RTDE, if that is not each cycle; 0: it is
  double lookahead = 0.03;       ///< s, of servoj, 0.03 to 0.2
  double gain = 1000.0;          ///< of servoj, 100 to 2000
  JointVector velocity_max;      ///< rad/s; a set-point that asks for a tenth more is refused. Six.
  JointVector acceleration_max;  ///< rad/s^2, of the plans. Six.
};

/// Settings for a Robotiq gripper on the arm's wrist.
struct RobotiqSettings {
  double speed = 1.0;    ///< speed of the fingers, share of the maximum
  double force = 0.2;    ///< gripping force, share of the maximum
  double timeout = 0.5;  ///< s for each answer
};

/// How to reach a Universal Robots arm, and what to ask of it. See docs/reference/ur.md.
struct UrSettings {
  std::string host;
  std::uint16_t rtde_port = 30004, script_port = 30001;
  std::uint16_t gripper_port = 63352;  ///< port of the gripper's URCap, if the robot has a gripper; 0: do not use it
  RobotiqSettings gripper;
  UrProgramSettings program;    ///< its session, limits and state_period are set by the arm
  double state_timeout = 0.04;  ///< s without a message from the controller after which the arm counts as stopped
  double start_within = 5.0;    ///< s in which the controller has to start the program
  double start_tolerance =
      0.02;              ///< rad, between where the controller wants the joints and where they are, at the start
  double delay = 0.035;  ///< s, ArmInfo::delay: mostly the controller's servo; `check --stage slow` measures it
  double connect_timeout = 2.0;  ///< s, for each step of connecting
  double lost_cycles_max = 0.1;  ///< share of the controller's cycles, over a second, that its program may lose
  bool calibration = true;       ///< take the arm's kinematics, as its factory measured it, from the controller
  bool replace_program = false;  ///< end another program that runs on the controller, to start ours
};

}  // namespace steadyhand

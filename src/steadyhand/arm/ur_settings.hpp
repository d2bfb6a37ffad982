#pragma once

#include <cstdint>
#include <string>

#include "steadyhand/arm/ur_program.hpp"

namespace steadyhand {

/// How to reach a Universal Robots arm, and what to ask of it. docs/universal-robots.md has the whole story.
struct UrSettings {
  std::string host;
  std::uint16_t rtde_port = 30004, script_port = 30001;
  UrProgramSettings program;  ///< its session, limits and state_period are set by the arm
  double silence = 0.04;      ///< s without a word from the controller after which the arm counts as stopped
  double start_within = 5.0;  ///< s in which the controller has to start the program
  double start_tolerance =
      0.02;               ///< rad, between where the controller wants the joints and where they are, at the start
  double delay = 0.035;   ///< s, ArmInfo::delay: mostly the controller's servo; `check --stage slow` measures it
  double patience = 2.0;  ///< s, for each step of connecting
  double lost_cycles_max = 0.1;  ///< share of the controller's cycles, over a second, that its program may lose
  bool calibration = true;       ///< take the arm's kinematics, as its factory measured it, from the controller
  bool replace_program = false;  ///< end another program that runs on the controller, to start ours
};

}  // namespace steadyhand

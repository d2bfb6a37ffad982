#pragma once

#include <string>

namespace steadyhand {

/// A gripper behind an action GripperCommand or ParallelGripperCommand of ROS 2.
struct Ros2GripperSettings {
  std::string action = "/gripper_controller/gripper_cmd";  ///< empty: the gripper is not used
  std::string joint;                ///< its joint in the joint states, for its position; empty: the action's only
  double open = 0.0, closed = 0.8;  ///< positions of the action and that joint, in their unit, at 0 and at 1
  double max_effort = 20.0;         ///< in each goal, N or Nm, by the controller's convention
  double timeout = 2.0;             ///< s for an answer, after which the controller counts as not answering
};

/// How to reach an arm through ROS 2. See docs/how-to/ros2.md.
struct Ros2Settings {
  int domain = -1;                                          ///< -1: ROS_DOMAIN_ID, else 0
  std::string controller = "/joint_trajectory_controller";  ///< its node; listens at CONTROLLER/joint_trajectory
  std::string joint_states = "/joint_states";
  /// Topic with the execution speed of the hardware in %; below 100 nothing moves. Empty: not reported.
  std::string speed_scaling = "/speed_scaling_state_broadcaster/speed_scaling";
  std::string hand;              ///< topic of poses that control the arm as the operator's hand does; empty: none
  bool scene = false;            ///< take objects from MoveIt's topics (docs/how-to/ros2.md), also with other arms
  bool show = false;             ///< publish for RViz, and listen to `hand`, also with other arms
  std::string prefix;            ///< prefix of names of joints and frames on the ROS side
  Ros2GripperSettings gripper;   ///< if the robot has one
  std::string joints;            ///< names of the joints from the base, with commas between; empty: those of the robot
  double rate_hz = 100.0;        ///< of trajectories
  double look_ahead = 0.05;      ///< s between a command and its execution; trajectories are sent this early
  double state_timeout = 0.035;  ///< s without joint states after which the arm counts as stopped
  /// s by which the arm lags behind its controller's set-points. By default between none and that of a UR's servos, so
  /// that at 3 rad/s neither is path_tolerance away; `check --stage slow` measures it.
  double servo_delay = 0.015;
  double control_rate_hz = 500.0;  ///< of control cycles, by our own clock
  double settle = 0.5;             ///< s in which the controller takes over at the present position, at the start
  double start_within = 5.0;       ///< s in which controller and joint states have to be there
  double start_tolerance = 0.02;   ///< rad, most that the joints may move during the start
  bool realtime = false;           ///< ask for real-time priority for the threads that communicate
  double command_timeout = 0.1;    ///< s without a command after which the arm counts as stopped
  double path_tolerance = 0.05;    ///< rad, any joint, measured to commanded a delay ago: it stopped, or lags
};

}  // namespace steadyhand

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/arms/driver/arm_kinds.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/operator/console/settings.hpp"

namespace steadyhand {

/// The driver of one arm of a robot with two.
struct NamedArm {
  std::string tool;               ///< its tool's name
  const ArmKind* kind = nullptr;  ///< never null
  std::string address;            ///< of a controller with a host; with ros2, the controller or nothing
};

/// Reads `--arm left=ur:ADDRESS,right=ur:ADDRESS`. Fails, with the reason, on anything that no robot could have.
Result<std::vector<NamedArm>> parse_arms(const std::string& text);
/// Whether they are the arms of this robot.
Status check_arms(const std::vector<NamedArm>& arms, const RobotModel& model);

/// Which arm follows, as the command line chose it, or else the settings.
struct ArmChoice {
  std::string arm, host;        ///< empty: not said
  std::vector<NamedArm> parts;  ///< two drivers, if `arm` names two
  std::string wrong;            ///< why `arm` names none
  std::string robot;            ///< of the settings
  std::uint16_t rtde_port = 30004, script_port = 30001, dashboard_port = 0, gripper_port = 63352;
  std::optional<double> speed;  ///< share of the model's speeds and accelerations; none: all simulated, a quarter real
  double first_moves = 0.0;     ///< s, of the settings
  bool yes = false;             ///< was asked elsewhere whether hardware may move
  bool calibration = true;      ///< take a UR's kinematics from the arm, of the settings
  /// Null: there is none of this name.
  const ArmKind* kind() const;
  /// Takes values that were not given from the settings, and sets the chosen arm in the settings.
  void complete(SessionSettings& settings);
  /// `speed`, or the arm's default.
  double speed_scaling() const;
  /// What the first moves keep to of that, see PlanningSettings::first_speed_scaling.
  double first_speed_scaling() const;
};

void add_arm_options(CommandLine& command, ArmChoice& choice);
/// --host and the ports alone, for commands that only listen.
void add_host_options(CommandLine& command, ArmChoice& choice);

/// Shows what is about to move, and asks for confirmation unless --yes is given.
Status confirm(const ArmChoice& choice, const std::string& what);
/// Reads from the arm the kinematics that a UR's factory measured, if the arm reports them; prints what it did.
Status take_calibration(const ArmChoice& choice, RobotModel& model);
/// Checks the choice, of whose kind there is one from then on, asks once before anything that can move hardware, and
/// lowers the model's limits to the share.
Status prepare_arm(const ArmChoice& choice, RobotModel& model);
/// Fails with what to install, if this program was built without ROS 2.
Status has_ros2();
/// The same of MuJoCo, which is loaded from these places.
Status has_mujoco(const Places& places);
/// The same of arms of Universal Robots.
Status has_ur();
/// Model and clock must outlive it.
Result<std::unique_ptr<Arm>> make_arm(const ArmChoice& choice, const RobotModel& model, const SessionSettings& session,
                                      Clock& clock);

}  // namespace steadyhand

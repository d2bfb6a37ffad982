#include "steadyhand/apps/commands/arm_choice.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "steadyhand/core/nearest.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#ifdef STEADYHAND_MUJOCO
#include "steadyhand/arms/mujoco/mujoco_arm.hpp"
#include "steadyhand/arms/mujoco/mujoco_library.hpp"
#include "steadyhand/files/config/open.hpp"
#endif
#ifdef STEADYHAND_ROS2
#include "steadyhand/arms/ros2/ros2_arm.hpp"
#endif
#ifdef STEADYHAND_UR
#include "steadyhand/arms/ur/ur_arm.hpp"
#include "steadyhand/arms/ur/ur_calibration.hpp"
#include "steadyhand/files/config/robot_file.hpp"
#endif

namespace steadyhand {

namespace {

constexpr Time kTimeout = std::chrono::seconds(2);
constexpr double kFirstSpeed = 0.25;  ///< a real arm's: in its first moves, and until more is requested

std::string follows(const ArmChoice& choice, double speed) {
  const bool slow_first = choice.first_speed_scaling() < 1.0 && choice.first_moves > 0.0;
  const std::string first = slow_first
                                ? fmt::format(", at {:.0f} % until the first engagement after {:g} s of following",
                                              100.0 * choice.first_speed_scaling() * speed, choice.first_moves)
                                : "";
  return fmt::format("it follows the hand at {:.0f} % of its speed and acceleration{}", 100.0 * speed, first);
}

/// A note if liquid would leave the glass in the arm's present pose; otherwise empty.
[[maybe_unused]] std::string note_on_tilt(const RobotModel& model, const GlassSettings& glass, const JointVector& q) {
  Kinematics kinematics(model);
  kinematics.set_position(q);
  const double tilt = std::acos(std::clamp(kinematics.R()(2, 2), -1.0, 1.0));
  const double most = std::atan2(glass.height - glass.fill, glass.radius);
  if (tilt < most) return "";
  return fmt::format(
      "note: at the arm's position the glass is tilted by {:.0f} degrees; at its fill level it spills from {:.0f}: "
      "start with the glass upright\n",
      tilt * 180.0 / M_PI, most * 180.0 / M_PI);
}

}  // namespace

Status confirm(const ArmChoice& choice, const std::string& what) {
  std::cout << fmt::format(
                   "The arm {} will MOVE: {}.\n"
                   "It does not see you, nor anything that is not in its robot and cell files.\n"
                   "Keep people out of its reach, and a hand on the emergency stop. "
                   "See docs/how-to/before-a-real-arm.md and docs/{}.\n",
                   choice.kind()->has_host ? "at " + choice.host : "behind the ROS 2 controller", what,
                   choice.kind()->guide)
            << std::flush;
  if (choice.yes) return Done{};
  if (isatty(STDIN_FILENO) == 0)
    return Error{"the program cannot ask whether the arm may move (no terminal); add --yes to allow it"};
  std::cout << "Go on? Type yes: " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != "yes") return Error{"not started"};
  return Done{};
}

#ifdef STEADYHAND_UR
Status take_calibration(const ArmChoice& choice, RobotModel& model) {
  if (choice.kind() != &kUniversalRobots || !choice.calibration) return Done{};
  auto socket = Socket::connect(choice.host, choice.script_port, kTimeout);
  if (!socket) {
    return Error{socket.error().message +
                 "; enable the primary interface at the pendant: Settings, Security, Services"};
  }
  UrPrimary primary(*std::move(socket));
  const auto kinematics = read_kinematics(primary, kTimeout);
  if (!kinematics) {
    std::cout << "note: the controller does not send the arm's calibration; the robot file is used\n";
    return Done{};
  }
  UrDeviation deviation;
  auto calibrated = calibrate(model, *kinematics, deviation);
  if (!calibrated) return calibrated.error();
  model = *std::move(calibrated);
  std::cout << fmt::format("the arm's calibration: its tool is {:.1f} mm from that of the robot file\n",
                           1e3 * deviation.tool_m);
  return Done{};
}
#else
Status take_calibration(const ArmChoice&, RobotModel&) { return Done{}; }
#endif

Status has_ros2() {
#ifdef STEADYHAND_ROS2
  return Done{};
#else
  return Error{
      "this program was built without ROS 2: install cyclonedds-dev and cyclonedds-tools and build again "
      "with -DSTEADYHAND_WITH_ROS2=ON"};
#endif
}

Status has_mujoco([[maybe_unused]] const Places& places) {
#ifdef STEADYHAND_MUJOCO
  return load_mujoco(places.packages);
#else
  return Error{
      "this program was built without MuJoCo: install the PyPI package mujoco-core of "
      "setup/requirements-mujoco.txt into .deps/venv, and build again with -DSTEADYHAND_WITH_MUJOCO=ON; "
      "./steadyhand demo --arm mujoco does both"};
#endif
}

Status has_ur() {
#ifdef STEADYHAND_UR
  return Done{};
#else
  return Error{
      "this program was built without arms of Universal Robots: build again with -DSTEADYHAND_WITH_UR=ON, "
      "which ./steadyhand demo --arm ur does"};
#endif
}

double ArmChoice::speed_scaling() const { return speed.value_or(kind()->hardware ? kFirstSpeed : 1.0); }

double ArmChoice::first_speed_scaling() const {
  return kind()->hardware ? std::min(1.0, kFirstSpeed / speed_scaling()) : 1.0;
}

void add_host_options(CommandLine& command, ArmChoice& choice) {
  command.add_option("--host", choice.host, "Name or address of the arm's controller");
  command.add_option("--rtde-port", choice.rtde_port, "RTDE")->capture_default_str()->group("Ports of the controller");
  command.add_option("--script-port", choice.script_port, "Primary interface, for programs")
      ->capture_default_str()
      ->group("Ports of the controller");
  command.add_option("--dashboard-port", choice.dashboard_port, "Dashboard; with PolyScope X its Robot API")
      ->capture_default_str()
      ->group("Ports of the controller");
  command.add_option("--gripper-port", choice.gripper_port, "Robotiq's URCap, of robots with a gripper; 0: none")
      ->capture_default_str()
      ->group("Ports of the controller");
}

void add_arm_options(CommandLine& command, ArmChoice& choice) {
  command.add_option(
      "--arm", choice.arm,
      "sim (in this program; the default), mujoco (the same with contact), ros2 (a joint trajectory controller), or ur "
      "(Universal Robots, directly); the last two move hardware. Also a setting: arm.kind");
  add_host_options(command, choice);
  command.add_option("--speed", choice.speed,
                     "Share of the robot's speeds and accelerations, above 0 to 1; default: 1 simulated, 0.25 real, "
                     "which first moves keep to in any case (setting arm.first_moves)");
  command.add_flag("--yes", choice.yes, "Do not ask before hardware moves");
}

void ArmChoice::complete(SessionSettings& settings) {
  if (arm.empty()) arm = settings.arm_kind;
  if (kind() != nullptr && kind()->has_host && host.empty()) host = settings.arm_host;
  settings.arm_kind = arm;
  settings.arm_host = host;
  first_moves = settings.live.planning.first_moves;
  calibration = settings.ur.calibration;
}

Status prepare_arm(const ArmChoice& choice, RobotModel& model) {
  const ArmKind* kind = choice.kind();
  if (kind == nullptr) return Error{fmt::format("--arm is '{}'; {}", choice.arm, suggestion(choice.arm, arm_names()))};
  if (kind == &kRos2Controller) {
    if (Status s = has_ros2(); !s) return s;
  }
  if (kind == &kUniversalRobots) {
    if (Status s = has_ur(); !s) return s;
  }
  if (kind->has_host && choice.host.empty()) {
    return Error{fmt::format("--arm {} needs --host, the controller's name or address", kind->name)};
  }
  if (!kind->has_host && !choice.host.empty()) return Error{"--host belongs to --arm ur"};
  if (choice.speed && !(*choice.speed > 0.0 && *choice.speed <= 1.0)) {
    return Error{fmt::format("--speed is {}; it must be above 0, to 1", *choice.speed)};
  }
  const double speed = choice.speed_scaling();
  model.velocity_max *= speed;
  model.acceleration_max *= speed;
  if (!kind->hardware) return Done{};
  if (Status s = confirm(choice, follows(choice, speed)); !s) return s;
  return take_calibration(choice, model);
}

Result<std::unique_ptr<Arm>> make_arm(const ArmChoice& choice, const RobotModel& model, const SessionSettings& session,
                                      Clock& clock) {
  if (choice.kind() == &kSimulated)
    return std::unique_ptr<Arm>(new SimulatedArm(model, model.home, session.arm, clock));
#ifdef STEADYHAND_MUJOCO
  if (choice.kind() == &kMujoco) {
    const Result<ChainDynamics> dynamics = open_dynamics(session.robot);
    if (!dynamics) return dynamics.error();
    auto arm = MujocoArm::make(model, *dynamics, session.live.cell, session.task, session.mujoco, clock);
    if (!arm) return arm.error();
    return std::unique_ptr<Arm>(std::move(*arm));
  }
#endif
#ifdef STEADYHAND_ROS2
  if (choice.kind() == &kRos2Controller) {
    Ros2Settings settings = session.ros2;
    settings.realtime = session.live.realtime;
    settings.path_tolerance = session.live.control.path_tolerance;
    auto arm = Ros2Arm::connect(model, settings, clock);
    if (!arm) return arm.error();
    const auto stands = (*arm)->wait_for_states();
    if (!stands) return stands.error();
    std::cout << note_on_tilt(model, session.live.glass, *stands) << std::flush;
    return std::unique_ptr<Arm>(std::move(*arm));
  }
#endif
#ifdef STEADYHAND_UR
  UrSettings settings = session.ur;
  settings.host = choice.host;
  settings.rtde_port = choice.rtde_port;
  settings.script_port = choice.script_port;
  settings.gripper_port = choice.gripper_port;
  auto arm = UniversalRobotsArm::connect(model, settings, clock);
  if (!arm) return arm.error();
  if ((*arm)->runtime() == UrRuntime::kPaused) {
    std::cout
        << "note: a program is paused on the controller (after switching on, too); it is ended before ours starts\n";
  } else if ((*arm)->runtime() != UrRuntime::kStopped) {
    if (!settings.replace_program) {
      return Error{
          fmt::format("another program runs on the controller at {}: stop it at the pendant, or allow us to with "
                      "--set ur.replace_program=true",
                      choice.host)};
    }
    std::cout << "note: the program that runs on the controller is ended (ur.replace_program)\n";
  }
  std::cout << std::flush;
  return std::unique_ptr<Arm>(std::move(*arm));
#else
  return has_ur().error();
#endif
}

}  // namespace steadyhand

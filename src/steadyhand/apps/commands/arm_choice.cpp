#include "steadyhand/apps/commands/arm_choice.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "steadyhand/arms/driver/composite_arm.hpp"
#include "steadyhand/core/nearest.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/session/live/realtime_threads.hpp"
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
#include "steadyhand/files/config/open.hpp"
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

/// Two drivers.
constexpr ArmKind kTwoArms{"", "reference/two-drivers.md", true}, kTwoSimulatedArms{"", "reference/two-drivers.md"};

/// Where the arms are that will move.
std::string place_of(const ArmChoice& choice) {
  if (choice.parts.empty()) {
    return choice.kind()->has_host ? "The arm at " + choice.host : "The arm behind the ROS 2 controller";
  }
  std::string text;
  for (const NamedArm& part : choice.parts) {
    if (!part.kind->hardware) continue;
    text += fmt::format("{} arm '{}'{}{}", text.empty() ? "The" : " and the", part.tool,
                        part.kind->has_host ? " at " : " behind the ROS 2 controller",
                        part.kind->has_host || part.address.empty() ? part.address : " " + part.address);
  }
  return text;
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
                   "{} will MOVE: {}.\n"
                   "It does not see you, nor anything that is not in its robot and cell files.\n"
                   "Keep people out of its reach, and a hand on the emergency stop. "
                   "See docs/how-to/before-a-real-arm.md and docs/{}.\n",
                   place_of(choice), what, choice.kind()->guide)
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
namespace {

/// @param host of the arm's controller
Status take_calibration(const ArmChoice& choice, const std::string& host, RobotModel& model) {
  auto socket = Socket::connect(host, choice.script_port, kTimeout);
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

/// An arm of a robot file's `arms`, with the mount that the whole robot does not have.
Result<RobotModel> mounted_arm(const std::string& robot, const RobotModel& model, int tool) {
  Result<RobotModel> arm = arm_of(model, tool);
  if (!arm) return arm.error();
  const auto file = find_named_file(Places::standard(), "robots", robot);
  if (!file || !is_robot_file(*file)) return arm;
  const Result<RobotSettings> settings = load_robot_settings(*file, Places::standard());
  if (!settings) return settings.error();
  for (const RobotSettings& each : settings->arms) {
    if (each.name == model.tools[tool].name) arm->mount = each.mount;
  }
  return arm;
}

}  // namespace

Status take_calibration(const ArmChoice& choice, RobotModel& model) {
  if (!choice.calibration) return Done{};
  if (choice.kind() == &kUniversalRobots) return take_calibration(choice, choice.host, model);
  for (const NamedArm& part : choice.parts) {
    if (part.kind != &kUniversalRobots) continue;
    const int tool = model.tools[0].name == part.tool ? 0 : 1;
    Result<RobotModel> arm = mounted_arm(choice.robot, model, tool);
    if (!arm) return arm.error();
    std::cout << "arm '" << part.tool << "': ";
    if (Status s = take_calibration(choice, part.address, *arm); !s)
      return Error{fmt::format("arm '{}': {}", part.tool, s.error().message)};
    const int first = first_joint_of(model, tool);
    for (int k = 0; k < arm->dof(); ++k) model.joints[first + k].origin = arm->joints[k].origin;
    model.tools[tool].origin = arm->tool().origin;
  }
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

const ArmKind* ArmChoice::kind() const {
  if (parts.empty()) return find_arm_kind(arm);
  const auto is_hardware = [](const NamedArm& part) { return part.kind->hardware; };
  return std::any_of(parts.begin(), parts.end(), is_hardware) ? &kTwoArms : &kTwoSimulatedArms;
}

Result<std::vector<NamedArm>> parse_arms(const std::string& text) {
  std::vector<NamedArm> arms;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string entry = text.substr(begin, end - begin);
    begin = end + 1;
    const auto refuse = [&](const std::string& reason) { return Error{fmt::format("--arm {}: {}", entry, reason)}; };
    const std::size_t equal = entry.find('='), colon = entry.find(':', equal);
    if (equal == std::string::npos || equal == 0)
      return refuse("each of two arms is NAME=KIND or NAME=KIND:ADDRESS, as left=ur:10.0.0.2");
    NamedArm arm;
    arm.tool = entry.substr(0, equal);
    const std::string kind = entry.substr(equal + 1, std::min(colon, entry.size()) - equal - 1);
    arm.kind = find_arm_kind(kind);
    if (arm.kind == nullptr) return refuse(fmt::format("the kind is '{}'; {}", kind, suggestion(kind, arm_names())));
    if (arm.kind == &kMujoco) return refuse("MuJoCo simulates both arms in one scene: --arm mujoco");
    if (colon != std::string::npos) arm.address = entry.substr(colon + 1);
    if (arm.kind->has_host && arm.address.empty())
      return refuse(fmt::format("{} needs the address of this arm's controller: {}={}:ADDRESS", kind, arm.tool, kind));
    if (arm.kind == &kSimulated && colon != std::string::npos)
      return refuse(fmt::format("sim has no address: {}=sim", arm.tool));
    for (const NamedArm& other : arms) {
      if (other.tool == arm.tool) return refuse(fmt::format("arm '{}' is named twice", arm.tool));
      if (other.kind == arm.kind && other.address == arm.address && arm.kind->hardware) {
        return refuse(fmt::format("it is the controller of arm '{}', too; each arm has its own: {}={}:{}", other.tool,
                                  arm.tool, kind, arm.kind->has_host ? "ADDRESS" : "/CONTROLLER"));
      }
    }
    arms.push_back(std::move(arm));
  }
  return arms;
}

Status check_arms(const std::vector<NamedArm>& arms, const RobotModel& model) {
  if (const Result<RobotModel> arm = arm_of(model, 0); !arm) return Error{"--arm: " + arm.error().message};
  std::vector<std::string> names;
  for (const Tool& tool : model.tools) names.push_back(tool.name);
  for (const NamedArm& arm : arms) {
    if (std::find(names.begin(), names.end(), arm.tool) == names.end())
      return Error{fmt::format("--arm names '{}', which robot '{}' does not have; {}", arm.tool, model.name,
                               suggestion(arm.tool, names))};
  }
  for (const std::string& name : names) {
    const auto is_this = [&](const NamedArm& arm) { return arm.tool == name; };
    if (std::none_of(arms.begin(), arms.end(), is_this))
      return Error{fmt::format("--arm does not name arm '{}' of robot '{}': add {}=KIND", name, model.name, name)};
  }
  return Done{};
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
      "(Universal Robots, directly); the last two move hardware. Also a setting: arm.kind. Two drivers for a robot "
      "with "
      "two arms: left=ur:ADDRESS,right=ur:ADDRESS, by the names of its tools");
  add_host_options(command, choice);
  command.add_option("--speed", choice.speed,
                     "Share of the robot's speeds and accelerations, above 0 to 1; default: 1 simulated, 0.25 real, "
                     "which first moves keep to in any case (setting arm.first_moves)");
  command.add_flag("--yes", choice.yes, "Do not ask before hardware moves");
}

void ArmChoice::complete(SessionSettings& settings) {
  if (arm.empty()) arm = settings.arm_kind;
  if (arm.find('=') != std::string::npos) {
    Result<std::vector<NamedArm>> named = parse_arms(arm);
    if (named) parts = *std::move(named);
    if (!named) wrong = named.error().message;
  }
  robot = settings.robot;
  if (kind() != nullptr && kind()->has_host && host.empty()) host = settings.arm_host;
  settings.arm_kind = arm;
  settings.arm_host = host;
  first_moves = settings.live.planning.first_moves;
  calibration = settings.ur.calibration;
}

Status prepare_arm(const ArmChoice& choice, RobotModel& model) {
  const ArmKind* kind = choice.kind();
  if (!choice.wrong.empty()) return Error{choice.wrong};
  if (kind == nullptr) return Error{fmt::format("--arm is '{}'; {}", choice.arm, suggestion(choice.arm, arm_names()))};
  if (!choice.parts.empty()) {
    if (Status s = check_arms(choice.parts, model); !s) return s;
  }
  const auto has = [&](const ArmKind& of) {
    const auto is_of = [&](const NamedArm& part) { return part.kind == &of; };
    return kind == &of || std::any_of(choice.parts.begin(), choice.parts.end(), is_of);
  };
  if (has(kRos2Controller)) {
    if (Status s = has_ros2(); !s) return s;
  }
  if (has(kUniversalRobots)) {
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

namespace {

/// @param address of its controller
Result<std::unique_ptr<Arm>> make_one(const ArmKind* kind, const std::string& address, const ArmChoice& choice,
                                      const RobotModel& model, const SessionSettings& session, Clock& clock) {
  if (kind == &kSimulated) return std::unique_ptr<Arm>(new SimulatedArm(model, model.home, session.arm, clock));
#ifdef STEADYHAND_MUJOCO
  if (kind == &kMujoco) {
    const Result<ChainDynamics> dynamics = open_dynamics(session.robot);
    if (!dynamics) return dynamics.error();
    auto arm = MujocoArm::make(model, *dynamics, session.live.cell, session.task, session.mujoco, clock);
    if (!arm) return arm.error();
    return std::unique_ptr<Arm>(std::move(*arm));
  }
#endif
#ifdef STEADYHAND_ROS2
  if (kind == &kRos2Controller) {
    Ros2Settings settings = session.ros2;
    if (!address.empty()) settings.controller = address;
    settings.realtime = session.live.realtime;
    settings.path_tolerance = session.live.control.path_tolerance;
    auto arm = Ros2Arm::connect(model, settings, clock);
    if (!arm) return arm.error();
    const auto stands = (*arm)->wait_for_states();
    if (!stands) return stands.error();
    if (choice.parts.empty()) std::cout << note_on_tilt(model, session.live.glass, *stands) << std::flush;
    return std::unique_ptr<Arm>(std::move(*arm));
  }
#endif
#ifdef STEADYHAND_UR
  UrSettings settings = session.ur;
  settings.host = address;
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
                      address)};
    }
    std::cout << "note: the program that runs on the controller is ended (ur.replace_program)\n";
  }
  std::cout << std::flush;
  return std::unique_ptr<Arm>(std::move(*arm));
#else
  return has_ur().error();
#endif
}

}  // namespace

namespace {

/// Settings that name something of one arm, if both are behind ROS 2.
Status check_ros2(const std::vector<NamedArm>& arms, const RobotModel& model, const Ros2Settings& settings) {
  const auto is_ros2 = [](const NamedArm& arm) { return arm.kind == &kRos2Controller; };
  if (!std::all_of(arms.begin(), arms.end(), is_ros2)) return Done{};
  const auto controller = [&](const NamedArm& arm) { return arm.address.empty() ? settings.controller : arm.address; };
  if (controller(arms[0]) == controller(arms[1])) {
    return Error{fmt::format("--arm gives both arms the controller {}; one controller of all joints is --arm ros2",
                             controller(arms[0]))};
  }
  if (!settings.joints.empty())
    return Error{"ros2.joints names the joints of one arm; with a controller for each, the robot names them"};
  if (model.tools[0].gripper_time && model.tools[1].gripper_time && !settings.gripper.action.empty())
    return Error{"both arms have a gripper, and ros2.gripper names the action of one; set it to nothing"};
  return Done{};
}

}  // namespace

Result<std::unique_ptr<Arm>> make_arm(const ArmChoice& choice, const RobotModel& model, const SessionSettings& session,
                                      Clock& clock) {
  if (choice.parts.empty()) return make_one(choice.kind(), choice.host, choice, model, session, clock);
  if (Status s = check_ros2(choice.parts, model, session.ros2); !s) return s.error();
  std::array<CompositeArm::Make, kMaxTools> make;
  for (const NamedArm& part : choice.parts) {
    make[model.tools[0].name == part.tool ? 0 : 1] = [&](const RobotModel& arm, Clock& its_clock) {
      return make_one(part.kind, part.address, choice, arm, session, its_clock);
    };
  }
  const auto on_thread = [realtime = session.live.realtime] {
    name_thread("second arm");
    if (realtime) (void)make_realtime(kControlPriority);
  };
  auto arm = CompositeArm::make(model, make, clock, CompositeArm::Turns::kThread, on_thread);
  if (!arm) return arm.error();
  return std::unique_ptr<Arm>(std::move(*arm));
}

}  // namespace steadyhand

#include "steadyhand/operator/console/settings.hpp"

#include <fmt/format.h>

#include <cmath>

#include "steadyhand/arms/driver/arm_kinds.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

namespace {

const Interval positive = Interval::positive(), some = Interval::not_negative();
constexpr Interval up_to(double high) { return {0.0, high, true}; }
constexpr Interval at_most(double high) { return {0.0, high, false}; }

void describe_hand(SessionSettings& s, SettingsTable& t) {
  RetargetSettings& hand = s.live.planning.retarget;
  t.add("hand.scale", "m/m", "motion of the tool for each metre of the hand", hand.scale, up_to(10.0));
  t.add("hand.yaw", "rad", "rotation of the operator's axes about the base's z", hand.yaw, {-7.0, 7.0});
  t.add("hand.translation_frame", "axes in which the tool translates with the hand", s.translation_frame,
        {"base", "tool"});
  t.add("hand.rotation_frame", "axes in which the tool rotates with the hand", s.rotation_frame, {"base", "tool"});
  t.add("hand.ramp", "s", "time after engaging until the arm follows the whole motion", hand.ramp, at_most(10.0));

  HandGateSettings& gate = s.live.planning.gate;
  t.add("gate.accept_emulated", "accept poses with a guessed position", gate.accept_emulated);
  t.add("gate.speed_max", "m/s", "a faster hand counts as a jump", gate.speed_max, positive);
  t.add("gate.jump_allowance", "m", "allowance for noise in that test", gate.jump_allowance, some);
  t.add("gate.turn_rate_max", "rad/s", "a hand that rotates faster counts as a jump", gate.turn_rate_max, positive);
  t.add("gate.turn_allowance", "rad", "allowance for noise in that test", gate.turn_allowance, some);
  t.add("gate.gap_max", "s", "time without a good pose after which the hand is lost", gate.gap_max, positive);
  t.add("gate.resume_distance", "m", "distance from the last good pose within which tracking resumes",
        gate.resume_distance, some);
  t.add("gate.resume_angle", "rad", "angle within which tracking resumes", gate.resume_angle, some);
  t.add("gate.resume_samples", "", "good poses in a row before tracking resumes", gate.resume_samples, {1.0, 1000.0});
  t.add("gate.age_max", "s", "older poses are dropped on arrival", gate.age_max, positive);
}

void describe_planning(SessionSettings& s, SettingsTable& t) {
  std::vector<std::string> solvers = solver_names();
  solvers.insert(solvers.begin(), "profile");
  LiveSettings& live = s.live;
  t.add("planner.rate", "Hz", "planning rate; auto: as high as this computer sustains", live.planner_rate_hz,
        {4.0, 500.0}, "auto");
  t.add("planner.look_ahead", "s", "time from a planning step to the start of its plan; auto: from the rate",
        live.look_ahead, up_to(0.25), "auto");
  t.add("planner.solver", "solver; profile: that of the profile", s.solver, solvers);
  t.add("planner.rest_within", "s", "time within which the arm stops after it no longer follows",
        live.planning.rest_within, up_to(5.0));
  t.add("predict.window", "s", "part of the hand's motion that gives its velocity", live.planning.predictor.window,
        up_to(1.0));
  t.add("predict.gap_max", "s", "time without poses after which the hand counts as stationary",
        live.planning.predictor.max_gap, up_to(5.0));

  SupervisorSettings& supervisor = live.control.supervisor;
  t.add("supervision.together", "where a hand is lost, the tool of the other hand rests too", supervisor.together);
  t.add("supervision.hold_after", "s", "time without a good pose after which the arm holds", supervisor.hold_after,
        up_to(5.0));
  t.add("supervision.disengage_after", "s", "time without a message from the device after which the arm disengages",
        supervisor.disengage_after, up_to(5.0));
  t.add("supervision.planner_late_after", "s", "time without a new plan after which the arm holds",
        supervisor.planner_late_after, up_to(5.0));
  t.add("control.path_tolerance", "rad",
        "(m) difference of measured and commanded position, at any joint, at which the arm stops",
        live.control.path_tolerance, positive);
  t.add("control.stall_cycles", "", "missed control cycles in a row at which the arm stops", live.control.stall_cycles,
        {1.0, 1e6});
  t.add("control.soft_stop", "s", "extra time that a stop may take to keep the liquid in", live.control.soft_stop,
        at_most(5.0));
  t.add("control.realtime", "request real-time priority, locked memory, and no sleep states", live.realtime);
}

void describe_arm(SessionSettings& s, SettingsTable& t) {
  t.add("arm.kind", "driver of the arm", s.arm_kind, arm_names());
  t.add("arm.host", "name or address of the controller, with ur", s.arm_host);
  t.add("arm.first_moves", "s",
        "time after the first engagement at a quarter of the speed, with hardware; --speed does not change it",
        s.live.planning.first_moves, at_most(3600.0));
  PlanCheckSettings& check = s.live.planning.planner.check;
  t.add("arm.tool_speed_max", "m/s",
        "speed limit of the tool in each plan; 0: none. Set it to that of the arm's safety configuration",
        check.tool_speed_max, at_most(10.0));
  t.add("arm.elbow_speed_max", "m/s", "speed limit of the elbow (third joint) in each plan; 0: none",
        check.elbow_speed_max, at_most(10.0));
  t.add("arm.rate", "Hz", "control rate of the simulated arm", s.arm.rate_hz, {20.0, 500.0});
  t.add("arm.latency", "s", "from a command to its effect", s.arm.latency, at_most(0.1));
  t.add("arm.servo_lag", "s", "time constant of the servo of the simulated arm", s.arm.servo_lag, at_most(0.1));
  t.add("arm.quantisation", "rad", "(m) resolution of the measured position", s.arm.quantisation, at_most(0.01));
  t.add("arm.noise", "rad", "(m) standard deviation of the measured position", s.arm.noise, at_most(0.001));
  t.add("arm.seed", "", "seed of the noise", s.arm.seed, {0.0, 4294967295.0});
  t.add("arm.command_timeout", "s", "time without a command after which the simulated arm stops", s.arm.command_timeout,
        up_to(10.0));
  t.add("arm.start_time", "s", "time until the simulated arm follows commands", s.arm.start_time, at_most(60.0));

  t.add("mujoco.contact", "reaction to contact: stop, yield (press lightly, then follow) or push", s.contact,
        {"stop", "yield", "push"});
  t.add("mujoco.yield", "", "share of the largest torques that yield presses with", s.mujoco.yield, up_to(1.0));
  t.add("mujoco.latency", "s", "from a command to its effect", s.mujoco.latency, at_most(0.1));
  t.add("mujoco.seed", "", "seed of the first placement of a task's objects", s.mujoco.seed, {0.0, 4294967295.0});

  t.add("camera.width", "", "width of the image in pixels, even", s.camera.width, {16.0, 4096.0});
  t.add("camera.height", "", "height of the image in pixels, even", s.camera.height, {16.0, 4096.0});
  t.add("camera.rate", "Hz", "image rate of each camera", s.camera.rate_hz, {1.0, 120.0});
}

void describe_ros2(SessionSettings& s, SettingsTable& t) {
  Ros2Settings& ros2 = s.ros2;
  t.add("ros2.domain", "", "ROS domain; -1: ROS_DOMAIN_ID, or 0 if it is not set", ros2.domain, {-1.0, 232.0});
  t.add("ros2.controller", "joint trajectory controller of the arm", ros2.controller);
  t.add("ros2.joint_states", "topic of the joint states", ros2.joint_states);
  t.add("ros2.speed_scaling", "topic of the speed scaling in %; below 100 nothing moves; empty: none",
        ros2.speed_scaling);
  t.add("ros2.hand", "topic of poses that act as the operator's hand; empty: none", ros2.hand);
  t.add("ros2.scene", "add objects of MoveIt's topics to the cell, with any driver", ros2.scene);
  t.add("ros2.show", "publish for RViz and read ros2.hand, with any driver", ros2.show);
  t.add("ros2.prefix", "prefix of joint and frame names in ROS", ros2.prefix);
  t.add("ros2.joints", "joint names in ROS from the base, with commas; empty: those of the robot", ros2.joints);
  t.add("ros2.rate", "Hz", "rate of trajectories", ros2.rate_hz, {5.0, 500.0});
  t.add("ros2.look_ahead", "s", "from a command to its execution", ros2.look_ahead, up_to(0.5));
  t.add("ros2.state_timeout", "s", "time without joint states after which the arm counts as stopped",
        ros2.state_timeout, up_to(0.5));
  t.add("ros2.servo_delay", "s", "delay of the arm behind its controller", ros2.servo_delay, at_most(0.5));
  t.add("ros2.control_rate", "Hz", "control rate, by this computer's clock", ros2.control_rate_hz, {20.0, 500.0});
  t.add("ros2.start_within", "s", "longest wait for controller and joint states at the start", ros2.start_within,
        up_to(60.0));
  const Interval any_place{-10.0, 10.0};
  Ros2GripperSettings& gripper = ros2.gripper;
  t.add("ros2.gripper", "action (Parallel)GripperCommand, for robots with a gripper; empty: not used", gripper.action);
  t.add("ros2.gripper_joint", "joint of the gripper in the joint states; empty: the action reports its position",
        gripper.joint);
  t.add("ros2.gripper_open", "m", "(rad) position of the open gripper", gripper.open, any_place);
  t.add("ros2.gripper_closed", "m", "(rad) position of the closed gripper", gripper.closed, any_place);
  t.add("ros2.gripper_effort", "N", "(Nm) largest effort of a goal", gripper.max_effort, at_most(1e4));
  t.add("ros2.gripper_timeout", "s", "time without an answer to a goal after which the arm stops", gripper.timeout,
        up_to(60.0));
}

void describe_ur(SessionSettings& s, SettingsTable& t) {
  UrSettings& ur = s.ur;
  t.add("ur.delay", "s", "from a command to its effect; `check --stage slow` measures it", ur.delay, at_most(0.3));
  t.add("ur.lookahead", "s", "lookahead time of servoj: a larger value is smoother and later", ur.program.lookahead,
        {0.03, 0.2});
  t.add("ur.gain", "", "gain of servoj: a higher value is stiffer and rougher", ur.program.gain, {100.0, 2000.0});
  t.add("ur.calibration", "read the factory calibration of the kinematics from the controller", ur.calibration);
  t.add("ur.replace_program", "stop a program that runs on the controller, to start the one of steadyhand",
        ur.replace_program);
  t.add("ur.lost_cycles_max", "", "share of control cycles that the program on the controller may miss before it stops",
        ur.lost_cycles_max, up_to(1.0));
  t.add("ur.gripper_speed", "", "share of the largest speed of the gripper", ur.gripper.speed, at_most(1.0));
  t.add("ur.gripper_force", "", "share of the largest force of the gripper", ur.gripper.force, at_most(1.0));
}

void describe_session(SessionSettings& s, SettingsTable& t) {
  GlassSettings& glass = s.live.glass;
  t.add("glass.radius", "m", "inner radius at the surface of the liquid", glass.radius, up_to(1.0));
  t.add("glass.height", "m", "inner height of the glass", glass.height, up_to(2.0));
  t.add("glass.fill", "m", "height of the liquid, less than that of the glass", glass.fill, up_to(2.0));
  t.add("glass.viscosity", "m^2/s", "kinematic viscosity of the liquid; water: 1e-6", glass.viscosity, at_most(1.0));
  t.add("glass.frequency_factor", "",
        "frequency of the liquid, relative to a cylinder of this radius and fill (docs/reference/profiles.md)",
        glass.frequency_factor, {0.2, 5.0});

  t.add("recording.enabled", "write the session to a file", s.recording.enabled);
  t.add("recording.folder", "folder of the recordings", s.recording_folder);
  t.add("recording.keep_free", "GB", "free space on the disk below which the recording ends",
        s.recording_place.keep_free_gb, at_most(1e6));
  t.add("recording.folder_max", "GB", "size of the folder above which the oldest recordings are deleted; 0: never",
        s.recording_place.max_gb, at_most(1e6));
  t.add("recording.plan_rate", "Hz", "largest rate of recorded plans and references", s.recording.plan_rate_hz,
        up_to(1000.0));
  t.add("recording.flight", "s", "time before a fault that is saved in a separate file; 0: none",
        s.recording.flight_seconds, at_most(600.0));

  t.add("server.port", "", "port of the page on this computer; 0: any", s.server.port, {0.0, 65535.0});
  t.add("server.lan", "also serve the local network, over HTTPS", s.server.lan);
  t.add("server.lan_port", "", "port of the page on the local network; 0: any", s.server.lan_port, {0.0, 65535.0});
  t.add("server.max_clients", "", "largest number of clients; a new one replaces one that is not paired",
        s.server.max_clients, {1.0, 1000.0});
  t.add("server.max_rate", "Hz", "largest message rate of one client", s.server.max_rate_hz, {1.0, 10000.0});
}

}  // namespace

SessionSettings::SessionSettings() : live(operator_defaults()) {}

Status SessionSettings::resolve(const SettingsTable& table) {
  const auto frame = [](const std::string& name) { return name == "tool" ? MotionFrame::kTool : MotionFrame::kBase; };
  live.planning.retarget.translation_frame = frame(translation_frame);
  live.planning.retarget.rotation_frame = frame(rotation_frame);
  recording_place.path = recording_folder;
  mujoco.rate_hz = arm.rate_hz;
  mujoco.command_timeout = arm.command_timeout;
  mujoco.start_time = arm.start_time;
  mujoco.contact = contact == "yield"  ? ContactPolicy::kYield
                   : contact == "push" ? ContactPolicy::kPush
                                       : ContactPolicy::kStop;
  const SupervisorSettings& supervisor = live.control.supervisor;
  live.planning.sample_timeout = supervisor.disengage_after;
  struct Order {
    const char *low, *high;
    double low_value, high_value;
    const char* unit;
  };
  for (const Order& o :
       {Order{"glass.fill", "glass.height", live.glass.fill, live.glass.height, "m"},
        Order{"supervision.hold_after", "supervision.disengage_after", supervisor.hold_after,
              supervisor.disengage_after, "s"},
        Order{"planner.rate", "arm.rate", live.planner_rate_hz, std::nextafter(arm.rate_hz, 1e9), "Hz"}}) {
    if (o.low_value < o.high_value) continue;
    return Error{fmt::format("{} is {} {} ({}); it must be less than {}, {} {} ({})", o.low, o.low_value, o.unit,
                             table.origin(o.low), o.high, o.high_value, o.unit, table.origin(o.high))};
  }
  return Done{};
}

SettingsTable describe(SessionSettings& s) {
  SettingsTable t;
  t.add("robot", "name of robots/, a robot file or a URDF", s.robot);
  t.add("cell", "obstacles: name of cells/, a cell file, or none", s.cell);
  t.add("task", "task: name of tasks/, a task file, or none; needs arm.kind mujoco", s.task_name);
  t.add("profile", "name of profiles/ or a profile file", s.profile);
  for (const auto add :
       {describe_hand, describe_planning, describe_arm, describe_ros2, describe_ur, describe_session}) {
    add(s, t);
  }
  return t;
}

}  // namespace steadyhand

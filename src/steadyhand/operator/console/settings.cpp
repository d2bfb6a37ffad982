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
  t.add("hand.scale", "m/m", "the tool's motion for the hand's", hand.scale, up_to(10.0));
  t.add("hand.yaw", "rad", "turn of the operator's axes about the base's z", hand.yaw, {-7.0, 7.0});
  t.add("hand.translation_frame", "in whose axes the hand's translation counts", s.translation_frame, {"base", "tool"});
  t.add("hand.rotation_frame", "in whose axes its rotation counts", s.rotation_frame, {"base", "tool"});
  t.add("hand.ramp", "s", "after a grip, until all of the hand's motion is followed", hand.ramp, at_most(10.0));

  HandGateSettings& gate = s.live.planning.gate;
  t.add("gate.accept_emulated", "follow poses whose position the headset guesses", gate.accept_emulated);
  t.add("gate.speed_max", "m/s", "a faster hand has jumped", gate.speed_max, positive);
  t.add("gate.jump_allowance", "m", "of noise beside that", gate.jump_allowance, some);
  t.add("gate.turn_rate_max", "rad/s", "a hand that turns faster has jumped", gate.turn_rate_max, positive);
  t.add("gate.turn_allowance", "rad", "of noise beside that", gate.turn_allowance, some);
  t.add("gate.gap_max", "s", "without a good pose: the hand is lost", gate.gap_max, positive);
  t.add("gate.resume_distance", "m", "from where it was lost: nearer, it is trusted again", gate.resume_distance, some);
  t.add("gate.resume_angle", "rad", "the same for its rotation", gate.resume_angle, some);
  t.add("gate.resume_samples", "", "good poses in a row until then", gate.resume_samples, {1.0, 1000.0});
  t.add("gate.age_max", "s", "poses that arrive later are dropped", gate.age_max, positive);
}

void describe_planning(SessionSettings& s, SettingsTable& t) {
  std::vector<std::string> solvers = solver_names();
  solvers.insert(solvers.begin(), "profile");
  LiveSettings& live = s.live;
  t.add("planner.rate", "Hz", "planning steps; auto: what this machine sustains", live.planner_rate_hz, {4.0, 500.0},
        "auto");
  t.add("planner.look_ahead", "s", "from a step to where its plan begins; auto: by the rate", live.look_ahead,
        up_to(0.25), "auto");
  t.add("planner.solver", "whose; profile: the profile's own", s.solver, solvers);
  t.add("planner.rest_within", "s", "in which the arm comes to rest when it no longer follows",
        live.planning.rest_within, up_to(5.0));
  t.add("predict.window", "s", "of the hand's motion that its velocity is taken from", live.planning.predictor.window,
        up_to(1.0));
  t.add("predict.gap_max", "s", "without poses, after which the hand is taken to rest", live.planning.predictor.max_gap,
        up_to(5.0));

  SupervisorSettings& supervisor = live.control.supervisor;
  t.add("supervision.hold_after", "s", "without a good pose: hold", supervisor.hold_after, up_to(5.0));
  t.add("supervision.disengage_after", "s", "without a word from the device: disengage", supervisor.disengage_after,
        up_to(5.0));
  t.add("supervision.planner_late_after", "s", "without a new plan: hold", supervisor.planner_late_after, up_to(5.0));
  t.add("control.path_tolerance", "rad", "(m) measured to commanded, any joint: stop", live.control.path_tolerance,
        positive);
  t.add("control.stall_cycles", "", "slept through in a row: stop", live.control.stall_cycles, {1.0, 1e6});
  t.add("control.soft_stop", "s", "that a stop may take longer to spare the liquid", live.control.soft_stop,
        at_most(5.0));
  t.add("control.realtime", "ask for real-time priority, locked memory and processors that do not sleep",
        live.realtime);
}

void describe_arm(SessionSettings& s, SettingsTable& t) {
  t.add("arm.kind", "which arm follows: in this program, or hardware", s.arm_kind, arm_names());
  t.add("arm.host", "name or address of the controller of ur", s.arm_host);
  t.add("arm.first_moves", "s", "of following that hardware moves at a quarter of its speed, whatever --speed says",
        s.live.planning.first_moves, at_most(3600.0));
  PlanCheckSettings& check = s.live.planning.planner.check;
  t.add("arm.tool_speed_max", "m/s", "of the arm's own safety configuration: no plan moves the glass faster; 0: none",
        check.tool_speed_max, at_most(10.0));
  t.add("arm.elbow_speed_max", "m/s", "the same of its elbow, the third joint", check.elbow_speed_max, at_most(10.0));
  t.add("arm.rate", "Hz", "control cycles of the simulated arm", s.arm.rate_hz, {20.0, 500.0});
  t.add("arm.latency", "s", "from a command to its effect", s.arm.latency, at_most(0.1));
  t.add("arm.servo_lag", "s", "time constant of its servo", s.arm.servo_lag, at_most(0.1));
  t.add("arm.quantisation", "rad", "(m) steps of the measured position", s.arm.quantisation, at_most(0.01));
  t.add("arm.noise", "rad", "(m) standard deviation of the measured position", s.arm.noise, at_most(0.001));
  t.add("arm.seed", "", "of the noise", s.arm.seed, {0.0, 4294967295.0});
  t.add("arm.command_timeout", "s", "without a command: it stops by itself", s.arm.command_timeout, up_to(10.0));
  t.add("arm.start_time", "s", "until it follows", s.arm.start_time, at_most(60.0));

  t.add("mujoco.contact", "where something is in the way: stop, yield (press lightly, come after) or push", s.contact,
        {"stop", "yield", "push"});
  t.add("mujoco.yield", "", "share of the torque that it presses with, of yield", s.mujoco.yield, up_to(1.0));
  t.add("mujoco.latency", "s", "from a command to its effect", s.mujoco.latency, at_most(0.1));
  t.add("mujoco.seed", "", "of the first places of a task's things", s.mujoco.seed, {0.0, 4294967295.0});

  t.add("camera.width", "", "pixels of each camera (--camera), an even number", s.camera.width, {16.0, 4096.0});
  t.add("camera.height", "", "likewise", s.camera.height, {16.0, 4096.0});
  t.add("camera.rate", "Hz", "pictures of each camera", s.camera.rate_hz, {1.0, 120.0});
}

void describe_ros2(SessionSettings& s, SettingsTable& t) {
  Ros2Settings& ros2 = s.ros2;
  t.add("ros2.domain", "", "-1: that of ROS_DOMAIN_ID, else 0", ros2.domain, {-1.0, 232.0});
  t.add("ros2.controller", "joint trajectory controller that leads the arm", ros2.controller);
  t.add("ros2.joint_states", "topic that tells where the joints are", ros2.joint_states);
  t.add("ros2.speed_scaling", "topic that tells it, in %; below 100 nothing moves; empty: none", ros2.speed_scaling);
  t.add("ros2.hand", "topic of poses that lead the arm as the operator's hand does; empty: none", ros2.hand);
  t.add("ros2.scene", "take objects from MoveIt's topics into the cell, also with another arm", ros2.scene);
  t.add("ros2.show", "publish for RViz, and listen to ros2.hand, also with another arm", ros2.show);
  t.add("ros2.prefix", "of the joints' and frames' names on the ROS side", ros2.prefix);
  t.add("ros2.joints", "their names there from the base, with commas; empty: the robot's", ros2.joints);
  t.add("ros2.rate", "Hz", "trajectories sent", ros2.rate_hz, {5.0, 500.0});
  t.add("ros2.look_ahead", "s", "from a command to its execution", ros2.look_ahead, up_to(0.5));
  t.add("ros2.state_timeout", "s", "without joint states: it counts as stopped", ros2.state_timeout, up_to(0.5));
  t.add("ros2.servo_delay", "s", "by which the arm lags behind its controller", ros2.servo_delay, at_most(0.5));
  t.add("ros2.control_rate", "Hz", "control cycles, by this computer's clock", ros2.control_rate_hz, {20.0, 500.0});
  t.add("ros2.start_within", "s", "until controller and joint states are there", ros2.start_within, up_to(60.0));
  const Interval any_place{-10.0, 10.0};
  Ros2GripperSettings& gripper = ros2.gripper;
  t.add("ros2.gripper",
        "action (Parallel)GripperCommand of the gripper, of robots that have one; empty: it is left alone",
        gripper.action);
  t.add("ros2.gripper_joint", "of the joint states, that tells where it is; empty: the action alone does",
        gripper.joint);
  t.add("ros2.gripper_open", "m", "(rad) position of the action, and of that joint, at open", gripper.open, any_place);
  t.add("ros2.gripper_closed", "m", "(rad) the same at closed", gripper.closed, any_place);
  t.add("ros2.gripper_effort", "N", "(Nm) most that a goal allows", gripper.max_effort, at_most(1e4));
  t.add("ros2.gripper_timeout", "s", "without an answer to a goal: the arm stops", gripper.timeout, up_to(60.0));
}

void describe_ur(SessionSettings& s, SettingsTable& t) {
  UrSettings& ur = s.ur;
  t.add("ur.delay", "s", "from a command to its effect; `check --stage slow` measures it", ur.delay, at_most(0.3));
  t.add("ur.lookahead", "s", "of servoj: longer is smoother and later", ur.program.lookahead, {0.03, 0.2});
  t.add("ur.gain", "", "of servoj: higher is stiffer and rougher", ur.program.gain, {100.0, 2000.0});
  t.add("ur.calibration", "take the arm's kinematics, as its factory measured it, from the controller", ur.calibration);
  t.add("ur.replace_program", "end another program that runs on the controller to start ours", ur.replace_program);
  t.add("ur.lost_cycles_max", "", "share of its cycles that our program may lose there: beyond, it stops",
        ur.lost_cycles_max, up_to(1.0));
  t.add("ur.gripper_speed", "", "of the gripper's fingers, share of their most", ur.gripper.speed, at_most(1.0));
  t.add("ur.gripper_force", "", "of the grip, share of its most", ur.gripper.force, at_most(1.0));
}

void describe_session(SessionSettings& s, SettingsTable& t) {
  GlassSettings& glass = s.live.glass;
  t.add("glass.radius", "m", "inside, of the liquid's surface", glass.radius, up_to(1.0));
  t.add("glass.height", "m", "inside", glass.height, up_to(2.0));
  t.add("glass.fill", "m", "of liquid, less than the height", glass.fill, up_to(2.0));
  t.add("glass.viscosity", "m^2/s", "of the liquid; water's is 1e-6", glass.viscosity, at_most(1.0));
  t.add("glass.frequency_factor", "",
        "of the liquid, over that in a cylinder of this radius and fill (docs/reference/profiles.md)",
        glass.frequency_factor, {0.2, 5.0});

  t.add("recording.enabled", "write the session to a file", s.recording.enabled);
  t.add("recording.folder", "of the files", s.recording_folder);
  t.add("recording.keep_free", "GB", "that stay free on the disk: the recording ends before",
        s.recording_place.keep_free_gb, at_most(1e6));
  t.add("recording.folder_max", "GB", "of recordings in the folder: the oldest beyond are deleted; 0: none are",
        s.recording_place.max_gb, at_most(1e6));
  t.add("recording.plan_rate", "Hz", "plans and references written, at most", s.recording.plan_rate_hz, up_to(1000.0));
  t.add("recording.flight", "s", "before a fault that go to a file of their own; 0: none", s.recording.flight_seconds,
        at_most(600.0));

  t.add("server.port", "", "of the page on this computer; 0: any", s.server.port, {0.0, 65535.0});
  t.add("server.lan", "serve the local network too, over HTTPS", s.server.lan);
  t.add("server.lan_port", "", "of that; 0: any", s.server.lan_port, {0.0, 65535.0});
  t.add("server.max_clients", "", "one that is not paired makes room for the next", s.server.max_clients,
        {1.0, 1000.0});
  t.add("server.max_rate", "Hz", "messages of one client", s.server.max_rate_hz, {1.0, 10000.0});
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
  t.add("cell", "what stands around the arm: name of cells/ or a cell file; none", s.cell);
  t.add("task", "what is to be done: name of tasks/ or a task file; none; with arm.kind mujoco", s.task_name);
  t.add("profile", "name of profiles/ or a profile file", s.profile);
  for (const auto add :
       {describe_hand, describe_planning, describe_arm, describe_ros2, describe_ur, describe_session}) {
    add(s, t);
  }
  return t;
}

}  // namespace steadyhand

#ifdef STEADYHAND_UR
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <future>
#include <iostream>
#include <limits>
#include <map>
#include <memory>

#include "steadyhand/apps/commands/arm_choice.hpp"
#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/apps/commands/commissioning.hpp"
#include "steadyhand/apps/commands/settings_options.hpp"
#include "steadyhand/arms/ur/rtde_client.hpp"
#include "steadyhand/arms/ur/ur_arm.hpp"
#include "steadyhand/arms/ur/ur_dashboard.hpp"
#include "steadyhand/arms/ur/ur_link_check.hpp"
#include "steadyhand/arms/ur/ur_modes.hpp"
#include "steadyhand/arms/ur/ur_program.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/operator/console/stop_signals.hpp"
#include "steadyhand/session/live/realtime_threads.hpp"
#ifdef STEADYHAND_ROS2
#include "steadyhand/arms/ros2/ros2_link_check.hpp"
#endif

namespace steadyhand {

namespace {

constexpr Time kTimeout = std::chrono::seconds(3);
constexpr double kMachineShare = 0.1;  ///< share of the time in which only this machine's wake-ups are measured
constexpr int kPriority = 80;
constexpr int kUnlockSeconds = 8;       ///< for which a protective stop is asked to be unlocked
constexpr double kLightestTool = 0.05;  ///< kg; no gripper weighs less

struct Options {
  ArmChoice arm;
  SettingsOptions settings;
  std::string stage = "read";
  double seconds = 60.0;
  bool unlock = false;
};

const std::map<std::string, Stage> kStages = {{"read", Stage::kRead},
                                              {"hold", Stage::kHold},
                                              {"slow", Stage::kSlow},
                                              {"empty", Stage::kEmpty},
                                              {"glass", Stage::kGlass}};

/// Reads state, writes one integer register that no program of ours reads, and reads it back.
RtdeRecipes echo_recipes() {
  return {{{"timestamp", "DOUBLE", {}},
           {"robot_mode", "INT32", {}},
           {"safety_status", "INT32", "safety_mode"},
           {"input_int_register_47", "INT32", {}},
           {"runtime_state", "UINT32", {}},
           {"speed_scaling", "DOUBLE", {}},
           {"target_speed_fraction", "DOUBLE", {}},
           {"actual_q", "VECTOR6D", {}},
           {"payload", "DOUBLE", {}},
           {"tcp_offset", "VECTOR6D", {}}},
          {{"input_int_register_47", "INT32", {}}},
          2};
}

std::string format_times(const TimingSummary& us) {
  return fmt::format("median {:.2f}  p99 {:.2f}  p99.9 {:.2f}  largest {:.2f} ms", us.p50 / 1e3, us.p99 / 1e3,
                     us.p999 / 1e3, us.max / 1e3);
}

std::uint64_t retransmitted(int descriptor) {
  tcp_info info{};
  socklen_t size = sizeof(info);
  return getsockopt(descriptor, IPPROTO_TCP, TCP_INFO, &info, &size) == 0 ? info.tcpi_total_retrans : 0;
}

/// @param stopped is the arm, protectively; asks again when the controller wants it to be later
void print_panel(const Options& options, const ControllerVersion& version, const StopSignals& signals) {
  const char* name = version.major >= 10 ? "robot API          " : "dashboard          ";
  auto panel = UrPanel::open(version, options.arm.host, options.arm.dashboard_port, kTimeout);
  if (!panel) {
    std::cout << fmt::format("{}{}; is it enabled? Settings, Security, Services\n", name, panel.error().message);
    return;
  }
  for (int i = 0; options.unlock && i < kUnlockSeconds; ++i) {
    const auto answer = (*panel)->unlock_protective_stop();
    const std::string& said = answer ? *answer : answer.error().message;
    std::cout << fmt::format("{}unlock protective stop: {}\n", name, said) << std::flush;
    // Some software refuses for 5 s, so that a person sees why it stopped.
    if (said.find("5s") == std::string::npos || signals.arrived_within(std::chrono::milliseconds(999))) break;
  }
  for (const UrPanel::Line& line : (*panel)->state()) std::cout << name << line.question << ": " << line.answer << "\n";
}

struct Measured {
  UrLinkReport report;
  UrRobotMode mode{};
  UrSafety safety{};
  UrRuntime runtime{};
  double scaling = 1.0, slider = 1.0, payload = 0.0;
  std::array<double, 6> q{}, tcp{};
};

/// First how late this machine wakes, then the stream; until the time is over or a signal comes.
Result<Measured> measure(RtdeClient& client, double seconds, const StopSignals& signals) {
  MonotonicClock clock;
  UrLinkMeter meter(client.rate_hz());
  const Time period = from_seconds(1.0 / client.rate_hz());
  const Time begin = clock.now(), listen_from = begin + from_seconds(kMachineShare * seconds);
  const Time end = begin + from_seconds(seconds);
  for (Time next = begin + period; next < listen_from; next = std::max(next + period, clock.now())) {
    clock.sleep_until(next);
    meter.woke(clock.now() - next);
  }
  while (client.fill() == Socket::Outcome::kDone) {
    for (RtdeReader old({}); client.next(old);) {
    }
  }
  Measured measured;
  Time asked = clock.now();
  while (clock.now() < end) {
    if (!client.wait(kTimeout)) return Error{"no message from the controller for 3 s"};
    const Socket::Outcome outcome = client.fill();
    const Time arrival = clock.now();
    if (outcome == Socket::Outcome::kClosed) return Error{"the controller closed the connection while it was measured"};
    bool received = false;
    for (RtdeReader data({}); client.next(data); received = true) {
      const double stamp = data.take<double>();
      measured.mode = static_cast<UrRobotMode>(data.take<std::int32_t>());
      measured.safety = static_cast<UrSafety>(data.take<std::int32_t>());
      meter.package(arrival, stamp, data.take<std::int32_t>());
      measured.runtime = static_cast<UrRuntime>(data.take<std::uint32_t>());
      for (double* value : {&measured.scaling, &measured.slider}) *value = data.take<double>();
      for (double& value : measured.q) value = data.take<double>();
      measured.payload = data.take<double>();
      for (double& value : measured.tcp) value = data.take<double>();
    }
    if (!received) continue;
    RtdeWriter input = client.input();
    input.put(meter.send(arrival));
    (void)client.send(input);
    if (arrival - asked < std::chrono::milliseconds(100)) continue;
    asked = arrival;
    if (signals.arrived_within(Time(0))) break;
  }
  measured.report = meter.report();
  measured.report.retransmitted = retransmitted(client.descriptor());
  return measured;
}

UrLinkVerdict print(const Measured& m) {
  const UrLinkReport& r = m.report;
  std::cout << fmt::format(
      "measured           {:.1f} s, {} states, {} left out by the controller, {} packets sent again\n"
      "this machine       wakes late by {}\n"
      "states             late by {}; longest gap {:.2f} ms\n"
      "round trip         {} (a cycle is {:.0f} ms)\n",
      r.seconds, r.packages, r.skipped, r.retransmitted, format_times(r.wake), format_times(r.late),
      r.longest_gap / 1e3, format_times(r.round_trip), 1e3 / r.rate_hz);
  for (const std::string_view why : {why_not(m.mode), why_not(m.safety)}) {
    if (!why.empty()) std::cout << "arm                " << why << "\n";
  }
  std::cout << fmt::format(
      "tool               payload {:.2f} kg, TCP {:.0f} {:.0f} {:.0f} mm from the flange, as set at the pendant\n",
      m.payload, 1e3 * m.tcp[0], 1e3 * m.tcp[1], 1e3 * m.tcp[2]);
  if (m.payload < kLightestTool) {
    std::cout << "to change          no payload is set: enter that of gripper and glass at the pendant (Installation, "
                 "Payload)\n";
  }
  if (m.slider < 0.99 || m.scaling < 0.99) {
    std::cout << fmt::format(
        "to change          the speed slider is at {:.0f} %, the controller scales by {:.0f} %: the "
        "arm starts at 100 % only\n",
        100.0 * m.slider, 100.0 * m.scaling);
  }
  if (m.runtime == UrRuntime::kPlaying) {
    std::cout << "to change          another program runs on the controller: stop it at the pendant\n";
  } else if (m.runtime == UrRuntime::kPaused) {
    std::cout << "note: a program is paused there (after switching on, too); ours ends it when it starts\n";
  }
  const UrProgramSettings program;
  const UrLinkJudgement j = judge(r, program.bridged, program.timeout);
  for (const std::string& finding : j.findings) std::cout << "to change          " << finding << "\n";
  const char* words = j.verdict == UrLinkVerdict::kFit ? "FIT: no set-point was later than the controller tolerates"
                      : j.verdict == UrLinkVerdict::kFitWithCare
                          ? "FIT WITH CARE: at times the arm slows down for lack of set-points"
                          : "NOT FIT: the arm would stop for lack of set-points";
  std::cout << "verdict            " << words << "\n";
  return j.verdict;
}

#ifdef STEADYHAND_ROS2
Status run_ros2(const Options& options, int& exit_code) {
  SessionSettings settings;
  SettingsTable table = describe(settings);
  if (Status s = options.settings.apply(table); !s) return s;
  const auto model = open_robot(settings.robot);
  if (!model) return model.error();
  const StopSignals signals;
  std::cout << fmt::format("ROS 2              {}, {}/joint_trajectory; nothing moves\n", settings.ros2.joint_states,
                           settings.ros2.controller)
            << std::flush;
  const AwakeProcessors awake;
  if (!awake.refused().empty()) std::cout << "note: " << awake.refused() << "\n";
  const auto measured =
      measure_ros2_link(*model, settings.ros2, options.seconds, [&signals] { return signals.arrived_within(Time(0)); });
  if (!measured) return measured.error();
  const Ros2LinkReport& r = *measured;
  std::cout << fmt::format(
      "measured           {:.1f} s, {} states of this arm, {} of others; {} publishers, {} controllers listen\n"
      "this machine       wakes late by {}\n"
      "states             late by {}; longest gap {:.2f} ms\n",
      r.seconds, r.states, r.strangers, r.publishers, r.controllers, format_times(r.wake), format_times(r.late),
      r.longest_gap / 1e3);
  const Ros2LinkJudgement j = judge(r, settings.ros2, *model);
  for (const std::string& finding : j.findings) std::cout << "to change          " << finding << "\n";
  std::cout << fmt::format("verdict            {}\n",
                           j.fit ? "FIT: no gap of the joint states was long enough to stop the arm"
                                 : "NOT FIT: the arm would stop, or not start");
  if (!j.fit) exit_code = 1;
  return Done{};
}
#endif

std::string describe_home(const RobotModel& model, const std::array<double, 6>& q) {
  Kinematics kinematics(model);
  kinematics.set_position(model.home);
  double away = 0.0;
  for (int i = 0; i < model.dof(); ++i) away = std::max(away, std::abs(q[i] - model.home[i]));
  return fmt::format(
      "home               {:.0f} mm between its nearest parts, the glass {:.0f} mm above the base's plane; "
      "the arm is up to {:.0f} degrees from it\n",
      1e3 * clearance(kinematics), 1e3 * kinematics.p().z(), away * 180.0 / M_PI);
}

/// Whether margins are kept by the arm itself, or by its commands alone.
/// @param tolerance rad (m), that each joint may be off its commands
std::string describe_margins(const RobotModel& model, const Cell& cell, const std::array<double, 6>& q,
                             double tolerance) {
  if (cell.objects.empty()) return "";
  Kinematics kinematics(model);
  kinematics.set_position(Eigen::Map<const Eigen::Matrix<double, 6, 1>>(q.data()));
  double off = 0.0, margin = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    double moved = 0.0;
    for (int k = 0; k < model.bodies[i].link; ++k) {
      moved += tolerance * kinematics.dpoint(k, kinematics.body(static_cast<int>(i)).p).norm();
    }
    off = std::max(off, moved);
  }
  for (const CellObject& object : cell.objects) margin = std::min(margin, object.margin);
  return fmt::format(
      "cell               {}: the smallest margin is {:.0f} mm; before the arm stops, its joints may be {:g} rad from "
      "their "
      "commands, and here a body {:.0f} mm: margins are kept {}\n",
      cell.name, 1e3 * margin, tolerance, 1e3 * off,
      off < margin ? "by the arm, too" : "by the commands, not by the arm");
}

/// Describes the stage's motion to the person who is asked to allow it.
std::string describe_stage(Stage stage, double seconds) {
  const StageMotion m = motion_of(stage);
  if (stage == Stage::kHold) return fmt::format("our program holds it at its position for {:g} s", seconds);
  return fmt::format(
      "each joint moves {:.1f} rad back and forth at up to {:.0f} % of its speed, for about {:g} s, {}; "
      "objects of the cell are not avoided",
      m.way, 100.0 * m.speed_scaling, seconds,
      stage == Stage::kGlass ? "with a glass of liquid" : "with an empty gripper or an empty glass");
}

/// A stage in which our program runs and the arm may move.
Status run_motion(const Options& options, const StopSignals& signals, int& exit_code) {
  const Stage stage = kStages.at(options.stage);
  SessionSettings settings;
  SettingsTable table = describe(settings);
  SettingsOptions given = options.settings;
  if (!std::filesystem::exists(given.file)) given.file.clear();  // it is made
  if (Status s = given.apply(table); !s) return s;
  auto model = open_robot(settings.robot);
  if (!model) return model.error();
  ArmChoice choice = options.arm;
  choice.complete(settings);
  if (Status s = confirm(choice, describe_stage(stage, options.seconds)); !s) return s;
  if (Status s = take_calibration(choice, *model); !s) return s;
  MonotonicClock clock;
  auto arm = make_arm(choice, *model, settings, clock);
  if (!arm) return arm.error();
  if (const auto* ur = dynamic_cast<const UniversalRobotsArm*>(arm->get())) {
    if (Status s = check_stage(stage, *model, ur->q()); !s) return s;
  } else if (Status s = check_stage(stage, *model, (*arm)->receive().joints.q); !s) {
    return s;
  }
  const auto lead = [&] {  // on a separate thread, the only one with priority
    const AwakeProcessors awake;
    (void)lock_memory();
    (void)make_realtime(kPriority);
    return run_stage(stage, **arm, *model, options.seconds, signals);
  };
  const StageReport r = std::async(std::launch::async, lead).get();
  std::cout << fmt::format(
      "stage {}         followed for {:.1f} s, {} cycles, {} missed; states up to {:.2f} ms from their cycle\n"
      "strays             up to {:.2f} mrad from where it was commanded\n",
      options.stage, r.seconds, r.cycles, r.late, 1e3 * r.jitter, 1e3 * r.stray);
  if (r.delay > 0.0) {
    std::cout << fmt::format("delay              {:.0f} ms from a command to its effect; the settings say {:.0f} ms\n",
                             1e3 * r.delay, 1e3 * (*arm)->info().delay);
  }
  if (!r.stopped.empty()) {
    std::cout << fmt::format("verdict            NOT PASSED: {}\n", r.stopped);
    exit_code = 1;
    return Done{};
  }
  if (r.delay > 0.0) {
    const bool ur = choice.kind() == &kUniversalRobots;
    const std::string key = ur ? "ur.delay" : "ros2.servo_delay";
    const std::string value = fmt::format("{:.3f}", ur ? r.delay : std::max(0.0, r.delay - settings.ros2.look_ahead));
    if (options.settings.file.empty()) {
      std::cout << "to change          --set " << key << "=" << value
                << ", or give --settings FILE and it is written there\n";
    } else {
      if (Status s = write_setting(options.settings.file, key, value); !s) return s;
      std::cout << fmt::format("written            {}: {} to {}\n", key, value, options.settings.file.string());
    }
  }
  std::cout << "verdict            PASSED\n";
  return Done{};
}

Status run(const Options& options, int& exit_code) {
  const ArmKind* kind = options.arm.kind();
  if (kind == nullptr || !kind->hardware) {
    return Error{fmt::format("--arm is '{}'; only ros2 and ur have a link to check", options.arm.arm)};
  }
  if (kind == &kRos2Controller) {
    if (Status s = has_ros2(); !s) return s;
  }
  if (!kind->has_host && !options.arm.host.empty()) return Error{"--host belongs to --arm ur"};
  if (kind->has_host && options.arm.host.empty()) {
    return Error{"check needs --host, the name or address of the arm's controller"};
  }
  if (!(options.seconds >= 1.0) || options.seconds > 86400.0) {
    return Error{fmt::format("--seconds is {}; it must be from 1 to 86400", options.seconds)};
  }
  if (!kStages.contains(options.stage)) {
    return Error{fmt::format("--stage is '{}'; it is read, hold, slow, empty or glass", options.stage)};
  }
  if (options.stage != "read" && options.seconds > kLongestStage) {
    return Error{fmt::format("--seconds is {}; a stage in which the arm may move has at most {} s", options.seconds,
                             kLongestStage)};
  }
#ifdef STEADYHAND_ROS2
  if (kind == &kRos2Controller && options.stage == "read") return run_ros2(options, exit_code);
#endif
  const StopSignals signals;
  if (options.stage != "read") return run_motion(options, signals, exit_code);
  auto socket = Socket::connect(options.arm.host, options.arm.rtde_port, kTimeout);
  if (!socket) return socket.error();
  auto client = RtdeClient::start(*std::move(socket), echo_recipes(), kTimeout);
  if (!client) return client.error();
  const ControllerVersion& v = (*client)->controller();
  std::cout << fmt::format("controller         software {}.{}.{}, RTDE {}, {:.0f} Hz; nothing moves\n", v.major,
                           v.minor, v.bugfix, (*client)->protocol(), (*client)->rate_hz());
  print_panel(options, v, signals);
  std::cout << std::flush;

  std::vector<std::string> notes;
  const auto listen = [&] {
    const AwakeProcessors awake;
    for (std::string note : {lock_memory(), make_realtime(kPriority), awake.refused()}) {
      if (!note.empty()) notes.push_back(std::move(note));
    }
    return measure(**client, options.seconds, signals);
  };
  const Result<Measured> measured = std::async(std::launch::async, listen).get();
  for (const std::string& note : notes) std::cout << "note: " << note << "\n";
  if (!measured) return measured.error();
  const UrLinkVerdict verdict = print(*measured);
  if (verdict == UrLinkVerdict::kUnfit) exit_code = 1;
  SessionSettings settings;
  SettingsTable table = describe(settings);
  if (Status s = options.settings.apply(table); !s) return s;
  auto model = open_robot(settings.robot);
  if (!model) return model.error();
  ArmChoice choice = options.arm;
  choice.complete(settings);
  if (Status s = take_calibration(choice, *model); !s) return s;
  const auto cell = open_cell(settings.cell);
  if (!cell) return cell.error();
  std::cout << describe_home(*model, measured->q)
            << describe_margins(*model, *cell, measured->q, settings.live.control.path_tolerance);
  return Done{};
}

}  // namespace

void add_check_command(CommandLine& app, Command& chosen, int& exit_code) {
  const auto options = std::make_shared<Options>();
  options->arm.arm = kUniversalRobots.name;
  CommandLine* command = app.add_subcommand(
      "check", "Test whether machine, network and arm are fit for a session; the arm moves only in a --stage");
  command->add_option("--arm", options->arm.arm, "ur (Universal Robots), or ros2")->capture_default_str();
  command->add_option("--settings", options->settings.file,
                      "YAML file of settings; a stage that measures the delay writes it there");
  command
      ->add_option("--stage", options->stage,
                   "read (nothing moves), hold (our program holds the arm), slow (0.1 rad at 5 % of its speed), empty "
                   "(0.2 rad at 25 %), glass (0.2 rad at 10 %, with liquid): in this order with a new arm")
      ->capture_default_str();
  command->add_flag("--yes", options->arm.yes, "Do not ask before hardware moves");
  command->add_option_function(
      "--robot", [options](const std::string& name) { options->settings.given.push_back({"robot", name, "--robot"}); },
      "Name, robot file or URDF");
  command->add_option("--set", options->settings.assignments, "KEY=VALUE of any setting, also several")
      ->expected(1, -1);
  add_host_options(*command, options->arm);
  command->add_option("--seconds", options->seconds, "Time to measure, s")->capture_default_str();
  command->add_flag("--unlock-protective-stop", options->unlock,
                    "Ask the dashboard to unlock a protective stop first: only after you have seen why it stopped");
  command->footer("Exit code 1 if the verdict is NOT FIT or NOT PASSED.");
  command->callback(
      [options, &chosen, &exit_code] { chosen = [options, &exit_code] { return run(*options, exit_code); }; });
}

}  // namespace steadyhand
#endif

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <iostream>
#include <memory>
#include <thread>

#include "app/arm_choice.hpp"
#include "app/commands.hpp"
#include "app/settings_options.hpp"
#include "arm/rtde_client.hpp"
#include "arm/ur_dashboard.hpp"
#include "arm/ur_link_check.hpp"
#include "arm/ur_modes.hpp"
#include "arm/ur_program.hpp"
#include "session/realtime.hpp"
#include "session/stop_signals.hpp"
#ifdef STEADYHAND_ROS2
#include "config/robot_file.hpp"
#include "ros2/ros2_link_check.hpp"
#endif

namespace steadyhand {

namespace {

constexpr Time kPatience = std::chrono::seconds(3);
constexpr double kMachineShare = 0.1;  ///< of the time, in which only this machine's waking is measured
constexpr int kPriority = 80;

struct Options {
  ArmChoice arm;
  SettingsOptions settings;  ///< of ROS 2
  double seconds = 60.0;
  bool unlock = false;
};

/// Reads state, writes one integer register that no program of ours reads, and reads it back.
RtdeRecipes echo_recipes() {
  return {{{"timestamp", "DOUBLE", {}},
           {"robot_mode", "INT32", {}},
           {"safety_status", "INT32", "safety_mode"},
           {"input_int_register_47", "INT32", {}}},
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

void print_dashboard(const Options& options) {
  auto dashboard = UrDashboard::connect(options.arm.host, options.arm.dashboard_port, kPatience);
  if (!dashboard) {
    std::cout << fmt::format("dashboard          {} (PolyScope X has none)\n", dashboard.error().message);
    return;
  }
  std::vector<std::string> questions = {"robotmode", "safetystatus", "programState", "is in remote control"};
  if (options.unlock) questions.insert(questions.begin(), "unlock protective stop");
  for (const std::string& question : questions) {
    const auto answer = dashboard->ask(question);
    std::cout << fmt::format("dashboard          {}: {}\n", question, answer ? *answer : answer.error().message);
  }
}

struct Measured {
  UrLinkReport report;
  UrRobotMode mode{};
  UrSafety safety{};
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
    if (!client.wait(kPatience)) return Error{"no word from the controller for 3 s"};
    const Socket::Outcome outcome = client.fill();
    const Time arrival = clock.now();
    if (outcome == Socket::Outcome::kClosed) return Error{"the controller closed the connection while it was measured"};
    bool heard = false;
    for (RtdeReader data({}); client.next(data); heard = true) {
      const double stamp = data.take<double>();
      measured.mode = static_cast<UrRobotMode>(data.take<std::int32_t>());
      measured.safety = static_cast<UrSafety>(data.take<std::int32_t>());
      meter.package(arrival, stamp, data.take<std::int32_t>());
    }
    if (!heard) continue;
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
      "states             come late by {}; longest gap {:.2f} ms\n"
      "round trip         {} (a cycle is {:.0f} ms)\n",
      r.seconds, r.packages, r.skipped, r.retransmitted, format_times(r.wake), format_times(r.late),
      r.longest_gap / 1e3, format_times(r.round_trip), 1e3 / r.rate_hz);
  for (const std::string_view why : {why_not(m.mode), why_not(m.safety)}) {
    if (!why.empty()) std::cout << "arm                " << why << "\n";
  }
  const UrProgramSettings program;
  const UrLinkJudgement j = judge(r, program.bridged, program.timeout);
  for (const std::string& finding : j.findings) std::cout << "to change          " << finding << "\n";
  const char* words = j.verdict == UrLinkVerdict::kFit ? "FIT: set-points never came later than the controller bridges"
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
      "states             come late by {}; longest gap {:.2f} ms\n",
      r.seconds, r.states, r.strangers, r.publishers, r.controllers, format_times(r.wake), format_times(r.late),
      r.longest_gap / 1e3);
  const Ros2LinkJudgement j = judge(r, settings.ros2);
  for (const std::string& finding : j.findings) std::cout << "to change          " << finding << "\n";
  std::cout << fmt::format("verdict            {}\n",
                           j.fit ? "FIT: joint states never stayed away for as long as stops the arm"
                                 : "NOT FIT: the arm would stop, or not start");
  if (!j.fit) exit_code = 1;
  return Done{};
}
#endif

Status run(const Options& options, int& exit_code) {
  if (options.arm.arm != "ur" && options.arm.arm != "ros2") {
    return Error{fmt::format("--arm is '{}'; only ros2 and ur have a link to check", options.arm.arm)};
  }
  if (options.arm.arm == "ros2") {
    if (Status s = has_ros2(); !s) return s;
  }
  if (options.arm.arm == "ros2" && !options.arm.host.empty()) return Error{"--host belongs to --arm ur"};
  if (options.arm.arm == "ur" && options.arm.host.empty()) {
    return Error{"check needs --host, the name or address of the arm's controller"};
  }
  if (!(options.seconds >= 1.0) || options.seconds > 86400.0) {
    return Error{fmt::format("--seconds is {}; it must be from 1 to 86400", options.seconds)};
  }
#ifdef STEADYHAND_ROS2
  if (options.arm.arm == "ros2") return run_ros2(options, exit_code);
#endif
  const StopSignals signals;
  auto socket = Socket::connect(options.arm.host, options.arm.rtde_port, kPatience);
  if (!socket) return socket.error();
  auto client = RtdeClient::start(*std::move(socket), echo_recipes(), kPatience);
  if (!client) return client.error();
  const ControllerVersion& v = (*client)->controller();
  std::cout << fmt::format("controller         software {}.{}.{}, RTDE {}, {:.0f} Hz; nothing moves\n", v.major,
                           v.minor, v.bugfix, (*client)->protocol(), (*client)->rate_hz());
  print_dashboard(options);
  std::cout << std::flush;

  Result<Measured> measured = Error{"not measured"};
  std::vector<std::string> notes;
  std::thread thread([&] {
    const AwakeProcessors awake;
    for (std::string note : {lock_memory(), make_realtime(kPriority), awake.refused()}) {
      if (!note.empty()) notes.push_back(std::move(note));
    }
    measured = measure(**client, options.seconds, signals);
  });
  thread.join();
  for (const std::string& note : notes) std::cout << "note: " << note << "\n";
  if (!measured) return measured.error();
  if (print(*measured) == UrLinkVerdict::kUnfit) exit_code = 1;
  return Done{};
}

}  // namespace

void add_check_command(CommandLine& app, Command& chosen, int& exit_code) {
  const auto options = std::make_shared<Options>();
  options->arm.arm = "ur";
  CommandLine* command = app.add_subcommand("check", "Is this machine and network fit to lead that arm? Nothing moves");
  command->add_option("--arm", options->arm.arm, "ur (Universal Robots), or ros2")->capture_default_str();
  command->add_option("--settings", options->settings.file, "YAML file of settings, for ros2");
  command->add_option("--set", options->settings.assignments, "KEY=VALUE of any setting, also several")
      ->expected(1, -1);
  add_host_options(*command, options->arm);
  command->add_option("--seconds", options->seconds, "Measure for so long")->capture_default_str();
  command->add_flag("--unlock-protective-stop", options->unlock,
                    "Ask the dashboard to unlock a protective stop first: only after you have seen why it stopped");
  command->footer("Exit code 1 if the verdict is NOT FIT.");
  command->callback(
      [options, &chosen, &exit_code] { chosen = [options, &exit_code] { return run(*options, exit_code); }; });
}

}  // namespace steadyhand

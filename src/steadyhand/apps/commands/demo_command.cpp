#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

#include "steadyhand/apps/commands/arm_choice.hpp"
#include "steadyhand/apps/commands/camera_choice.hpp"
#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/apps/commands/robot_choice.hpp"
#include "steadyhand/apps/commands/ros2_side.hpp"
#include "steadyhand/apps/commands/session_choice.hpp"
#include "steadyhand/apps/commands/settings_options.hpp"
#include "steadyhand/apps/commands/task_choice.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/robot/loading.hpp"
#include "steadyhand/operator/console/live_console.hpp"
#include "steadyhand/operator/console/output_queue.hpp"
#include "steadyhand/operator/console/stop_signals.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"
#include "steadyhand/session/live/realtime_threads.hpp"
#ifdef STEADYHAND_MESHES
#include "steadyhand/files/visual/arm_scene.hpp"
#endif

namespace steadyhand {

namespace {

constexpr Time kRestWithin = std::chrono::milliseconds(2500);
constexpr Time kReaderPatience = std::chrono::seconds(1);  ///< at the end, for the reader of the output

constexpr int kHalted = 1;  ///< exit code

struct Options {
  std::string input;
  RecordingOptions range;
  std::string page;
  std::string tip;
  bool headless = false, no_browser = false, no_fit = false;
  bool keep_going = false, hand_on_hardware = false;
  double seconds = 0.0;  ///< 0: until Ctrl-C
  SettingsOptions settings;
  ArmChoice arm;
  CameraChoice cameras;
};

std::string format_timing(const TimingSummary& us) {
  return fmt::format("median {:.1f}  p99 {:.1f}  p99.9 {:.1f}  largest {:.1f} ms", us.p50 / 1e3, us.p99 / 1e3,
                     us.p999 / 1e3, us.max / 1e3);
}

std::string format_summary(const LiveSummary& s) {
  std::string text = fmt::format(
      "session            {:.1f} s, engaged {:.1f} s in {} engagements\n"
      "hand               {} samples, {} dropped\n"
      "hand to command    {}\n"
      "planner            {}; {} plans followed, {} failed, {} late\n"
      "control            {} cycles, {} deadlines missed ({:.4f} %); woken late by {}\n",
      s.duration, s.engaged, s.engagements, s.samples, s.dropped_samples, format_timing(s.latency_us),
      format_timing(s.solve_us), s.plans, s.failed_plans, s.late_plans, s.cycles, s.missed_deadlines,
      s.cycles > 0 ? 100.0 * static_cast<double>(s.missed_deadlines) / static_cast<double>(s.cycles) : 0.0,
      format_timing(s.wake_us));
  text += to_text(s.monitor);
  text += fmt::format("liquid             {}\n", s.spilled ? "spilled" : "nothing spilled");
  if (s.tap_drops > 0) text += fmt::format("recording          {} messages were dropped\n", s.tap_drops);
  for (const auto& [reason, count] : s.holds) text += fmt::format("held or stopped    {} x {}\n", count, reason);
  return text;
}

std::string format_cameras(const Cameras& cameras) {
  std::string text;
  const std::vector<CameraState> states = cameras.states();
  for (std::size_t i = 0; i < states.size(); ++i) {
    const CameraState& s = states[i];
    text += fmt::format("camera {:11} {} pictures, {} dropped{}\n", cameras.cameras()[i].name, s.pictures, s.dropped,
                        s.ended.empty() ? "" : "; ended: " + s.ended);
  }
  return text;
}

Status check(const Options& options, const SessionSettings& settings) {
  if (!(options.seconds >= 0.0) || options.seconds > 1e7) {
    return Error{fmt::format("--seconds is {}; it must be from 0 (until Ctrl-C) to 1e7", options.seconds)};
  }
  if (options.headless && settings.server.lan) {
    return Error{"--headless and --lan exclude each other: headless has no page"};
  }
  if (!options.headless && (options.keep_going || options.hand_on_hardware)) {
    return Error{options.keep_going ? "--keep-going is for --headless: at the page a person resets"
                                    : "--hand-on-hardware needs --headless: at the page a person controls the arm"};
  }
  return Done{};
}

/// A recorded hand does not see what a real arm does, and no operator holds its clutch.
Status check_hand(const Options& options, const SessionSettings& settings) {
  if (options.arm.kind() == nullptr || !options.arm.kind()->hardware) return Done{};
  if (options.keep_going)
    return Error{"--keep-going is for a simulated arm; a real one that stopped waits for a person"};
  if (options.headless && !options.hand_on_hardware && settings.ros2.hand.empty()) {
    return Error{"--headless would move a real arm with a recorded hand; add --hand-on-hardware to allow it"};
  }
  return Done{};
}

/// The given recording, or the bundled ones.
Result<std::vector<NamedRecording>> load_recordings(const Options& options, const RobotModel& model,
                                                    const Places& places) {
  RecordingOptions range = options.range;
  for (const Tool& tool : model.tools) range.tools.push_back(tool.name);
  if (options.input.empty()) return bundled_recordings(places, range);
  Result<Recording> recording = load_recording(options.input, range);
  if (!recording) return recording.error();
  return std::vector<NamedRecording>{{recording->name, *std::move(recording)}};
}

/// No pose comes from a topic any more when the session goes, however this is left.
struct EndOfRos2 {
  Ros2Side& ros2;
  ~EndOfRos2() { ros2.close(); }
};

/// Stops the arm; on a second signal meanwhile, as fast as its limits allow.
void stop(LiveSession& session, const StopSignals& signals, const Clock& clock) {
  session.ask_stop();
  const Time until = clock.now() + kRestWithin;
  while (!session.stopped_at_rest() && clock.now() < until) {
    if (signals.arrived_within(std::chrono::milliseconds(5))) session.ask_stop();
  }
}

#ifndef STEADYHAND_MESHES
Result<std::string> arm_scene(const std::string&, const std::string&, const Places&) {
  return Error{"this program was built without Assimp: install libassimp-dev and build again"};
}
#endif

/// The arm's meshes for the page.
void add_arm_scene(const std::string& name, const std::string& tip, const RobotModel& model, const Places& places,
                   ServerSettings& server) {
  Result<std::string> scene = arm_scene(name, tip, places);
  if (!scene) {
    std::cerr << "note: the page draws only the arm's bodies: " << scene.error().message << "\n";
  } else if (!scene->empty()) {
    server.files["/arms/" + model.meshes + ".glb"] = *std::move(scene);
  }
}

/// Parts of the session, chosen by options and settings.
struct Chosen {
  std::vector<NamedRecording> recordings;
  RobotModel model;
  std::vector<Profile> profiles;
  int profile = 0;
};

/// Everything that can be wrong without an arm is looked at here.
Result<Chosen> choose(Options& options, const Places& places, SettingsTable& table, SessionSettings& settings) {
  Chosen chosen;
  if (Status s = options.settings.apply(table); !s) return s.error();
  if (Status s = settings.resolve(table); !s) return s.error();
  if (Status s = check(options, settings); !s) return s.error();
  settings.server.page_folder = options.page;
  options.arm.complete(settings);
  if (Status s = choose_task(options.arm, places, table, settings); !s) return s.error();
  Result<RobotModel> model = choose_robot(settings.robot, options.tip, places, options.no_fit);
  if (!model) return model.error();
  chosen.model = *std::move(model);
  Result<std::vector<NamedRecording>> recordings = load_recordings(options, chosen.model, places);
  if (!recordings) return recordings.error();
  chosen.recordings = *std::move(recordings);
  if (!options.headless) add_arm_scene(settings.robot, options.tip, chosen.model, places, settings.server);
  Result<Cell> cell = open_cell(settings.cell, places);
  if (!cell) return cell.error();
  settings.live.cell = in_base(*std::move(cell), chosen.model);
  if (Status s = take_task(chosen.model, settings); !s) return s.error();
  if (Status s = check_carried(settings.live.cell, at_home(chosen.model)); !s) return s.error();
  Result<std::vector<Profile>> profiles = all_profiles(settings.profile, places, chosen.model, chosen.profile);
  if (!profiles) return profiles.error();
  chosen.profiles = *std::move(profiles);
  for (Profile& profile : chosen.profiles) add_posture_where_redundant(profile.ocp, chosen.model);
  if (Status s = check_hand(options, settings); !s) return s.error();
  if (Status s = prepare_arm(options.arm, chosen.model); !s) return s.error();
  return chosen;
}

/// The console's part of the settings; of what the task places, where there is one.
Result<ConsoleSettings> console_settings(const Options& options, const SessionSettings& settings,
                                         const SettingsTable& table, const Chosen& chosen, Arm& arm, Cameras* cameras) {
  ConsoleSettings console{
      .live = settings.live,
      .server = settings.server,
      .recording = settings.recording,
      .recording_place = settings.recording_place,
      .profiles = chosen.profiles,
      .profile = chosen.profile,
      .solver = settings.solver == "profile" ? "" : settings.solver,
      .recordings = chosen.recordings,
      .metadata = {{"settings", table.values()},
                   {"run", {{"arm", options.arm.arm}, {"speed", fmt::format("{}", options.arm.speed_scaling())}}}},
      .page = !options.headless,
      .browser = !options.no_browser,
      .things = {},
      .cameras = cameras,
      .report_program = "/proc/self/exe"};
  if (!settings.task.name.empty()) {
    console.task = &settings.task;
    console.scene = dynamic_cast<SimulatedScene*>(&arm);
    console.metadata["task"] = describe_task(settings.task);
    auto solids = solids_of(settings.task, chosen.model);
    if (!solids) return solids.error();
    console.things = *std::move(solids);
  }
  console.live.planning.first_speed_scaling = options.arm.first_speed_scaling();
  return console;
}

/// Until the time is over, a signal comes or the arm is halted. @return the exit code
int lead(const Options& options, const std::string& hand, LiveConsole& console, Ros2Side& ros2,
         const StopSignals& signals, const Clock& clock) {
  LiveSession& session = console.session();
  const Time end = options.seconds > 0.0 ? clock.now() + from_seconds(options.seconds) : Time::max();
  int exit_code = 0;
  for (Time pause = LiveConsole::kPollPeriod; clock.now() < end && !signals.arrived_within(pause);) {
    const Time now = clock.now();
    pause = console.poll(now) - now;
    ros2.poll(now, session);
    if (options.headless && session.is_halted()) {
      exit_code = options.keep_going ? 0 : kHalted;
      if (!options.keep_going) break;
      if (session.stopped_at_rest()) session.ask_reset();
    } else if (options.keep_going && console.operator_interface().controls().playback < 0) {
      (void)console.operator_interface().apply({OperatorRequest::Kind::kPlayback, hand, 0.0}, now);
    }
  }
  return exit_code;
}

Status run(Options options, int& exit_code) {
  SessionSettings settings;
  SettingsTable table = describe(settings);
  const Result<Chosen> chosen = choose(options, Places::standard(), table, settings);
  if (!chosen) return chosen.error();
  const RobotModel& model = chosen->model;

  const StopSignals signals;
  OutputQueue out(STDOUT_FILENO);  // from here on nothing waits for its reader
  MonotonicClock clock;
  const Result<std::unique_ptr<Arm>> arm = make_arm(options.arm, model, settings, clock);
  if (!arm) return arm.error();
  std::string without_cameras;
  const auto cameras = open_cameras(options.cameras, settings.task, settings.camera, **arm, clock, without_cameras);
  if (!cameras) return cameras.error();
  auto console_of = console_settings(options, settings, table, *chosen, **arm, cameras->get());
  if (!console_of) return console_of.error();
  Ros2Side ros2;
  ConsoleCallbacks callbacks;
  callbacks.say = [&out](const std::string& text) { out.say(text); };
  callbacks.draw = [&out](std::string picture) { out.draw(std::move(picture)); };
  callbacks.on_lease = [&ros2](std::uint64_t client) { ros2.lead_at_page(client != 0); };
  auto made = LiveConsole::make(model, *std::move(console_of), **arm, clock, std::move(callbacks));
  if (!made) return made.error();
  LiveConsole& console = **made;
  LiveSession& session = console.session();
  OperatorInterface& operator_interface = console.operator_interface();
  const EndOfRos2 end_of_ros2{ros2};
  for (const std::string& doubt : doubts_about(model)) out.say("note: " + doubt + "\n");
  if (!without_cameras.empty()) out.say("note: " + without_cameras + "\n");
  const std::string hand = chosen->recordings.front().name;
  out.say(fmt::format("{}, {} at {} Hz{}\n", (*arm)->info().name, console.profile().label, session.planner_rate_hz(),
                      !settings.ros2.hand.empty() ? ", hand: poses from " + settings.ros2.hand
                      : options.headless          ? ", hand: " + hand + ", again and again"
                                                  : ""));

  if (Status s = ros2.open(options.arm, model, settings, clock, session, operator_interface,
                           [&out](const std::string& text) { out.say(text); });
      !s)
    return s;
  // With a page too, something moves until an operator takes control. A real arm or a task never starts this way.
  const bool shows = !(*arm)->info().hardware && settings.task.name.empty();
  const bool plays = (options.headless || shows) && settings.ros2.hand.empty();
  if (plays) (void)operator_interface.apply({OperatorRequest::Kind::kPlayback, hand, 0.0}, clock.now());
  if (Status s = console.start(); !s) return s;
  if (options.headless && settings.live.realtime) {
    (void)make_realtime(kServerPriority);  // in the server's place, this thread plays the hand
  }
  exit_code = lead(options, hand, console, ros2, signals, clock);
  stop(session, signals, clock);
  console.close_page();
  ros2.close();
  const LiveSummary summary = console.finish();
  out.say(format_summary(summary));
  if (*cameras) out.say(format_cameras(**cameras));
  console.say_notices();
  if (exit_code == kHalted) out.say("ended because the arm was stopped\n");
  return out.finish(kReaderPatience) ? Status(Done{}) : Error{"cannot write all of it to stdout"};
}

}  // namespace

void add_demo_command(CommandLine& app, Command& chosen, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CommandLine* command = app.add_subcommand("demo", "Run a live session: an arm follows a hand");
  command->add_flag("--headless", options->headless,
                    "Without a page: a recorded hand, over and over, until Ctrl-C or until the arm stops");
  command->add_flag("--keep-going", options->keep_going,
                    "With --headless and a simulated arm: reset after each stop, and play again");
  command->add_flag("--hand-on-hardware", options->hand_on_hardware,
                    "Allow --headless to move a real arm with the recorded hand");
  command->add_flag("--no-browser", options->no_browser, "Do not open the page");
  command->add_option("--tip", options->tip, kTipHelp);
  command->add_flag("--no-fit", options->no_fit, kNoFitHelp);
  command->add_option("--page", options->page, "Serve the page from this folder instead of the built-in one");
  command->add_option("--input", options->input,
                      "Recording that may play the hand (formats: see replay); default: bundled hands");
  command->add_option("--track", options->range.track, "Key of the hand in a motion-capture file (default: rhand)");
  command->add_option("--from", options->range.from, "Start at this time of the recording, s");
  command->add_option("--until", options->range.until, "End at this time of the recording, s");
  command->add_option("--seconds", options->seconds, "End after this time, s; 0: at Ctrl-C")->capture_default_str();
  add_settings_options(*command, options->settings);
  add_arm_options(*command, options->arm);
  add_camera_options(*command, options->cameras);
  command->footer("Ctrl-C stops the arm and prints a summary of the session.");
  command->callback(
      [options, &chosen, &exit_code] { chosen = [options, &exit_code] { return run(*options, exit_code); }; });
}

}  // namespace steadyhand

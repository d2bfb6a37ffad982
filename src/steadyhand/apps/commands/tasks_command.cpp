#ifdef STEADYHAND_MUJOCO
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <numeric>

#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/apps/commands/settings_options.hpp"
#include "steadyhand/apps/commands/task_choice.hpp"
#include "steadyhand/apps/simulate/task_run.hpp"
#include "steadyhand/files/archive/recording_folder.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/places.hpp"

namespace steadyhand {

namespace {

constexpr double kRate = 50.0;  // Hz, of planning, if the settings have none
constexpr int kMostEpisodes = 100000;

struct TasksOptions {
  SettingsOptions settings;
  std::vector<std::string> tasks;
  std::vector<std::string> profiles{"tracking", "carry"};
  int episodes = 10;
  bool each = false;
};

/// How one episode went.
struct Outcome {
  bool success = false;
  double time = 0.0;                        ///< s, until it was decided
  double spilled = 0.0;                     ///< share of the liquid
  std::uint64_t beyond = 0, forbidden = 0;  ///< commands and speeds beyond a limit; contacts that the task forbids
  std::uint64_t plans = 0, refused = 0;     ///< refused: that failed, or came too late
  std::string missed;                       ///< what did not hold at the end
};

std::string unmet(const Task& task, std::uint32_t held) {
  std::string all;
  for (std::size_t i = 0; i < task.success.size(); ++i) {
    if ((held >> i & 1u) == 0) all += (all.empty() ? "" : ", ") + task.success[i].text;
  }
  return all;
}

/// Where episodes are recorded.
struct Recordings {
  RecordingSettings settings;
  RecordingFolderSettings folder;
  SessionRecorder::Metadata metadata;
};

/// One episode in virtual time.
/// @param recordings null: it is not recorded
Result<Outcome> run_episode(const TaskStage& stage, std::uint32_t seed, const Recordings* recordings) {
  auto made = TaskRun::make(stage, seed);
  if (!made) return made.error();
  TaskRun& run = **made;
  if (recordings) {
    SessionRecorder::Metadata metadata = recordings->metadata;
    metadata["task"]["seed"] = fmt::format("{}", seed);
    Status s = run.record(std::make_unique<RecordingFolder>(recordings->folder), recordings->settings, metadata);
    if (!s) return s.error();
  }
  ScriptedOperator hand(stage.task);
  run.on_look = [&](const SessionSnapshot& look) { run.operate(hand, look); };
  while (!run.is_over()) run.step();
  for (const std::string& line : run.finish_recording()) std::cerr << line << "\n";

  const LiveSummary summary = run.session().summary();
  Outcome outcome;
  outcome.success = run.progress().success.value_or(false);
  outcome.time = run.progress().time;
  outcome.spilled = run.progress().spilled;
  outcome.beyond = summary.monitor.beyond_limits + summary.monitor.too_fast;
  outcome.forbidden = run.scene().forbidden;
  outcome.plans = summary.plans;
  outcome.refused = summary.failed_plans + summary.late_plans;
  if (!run.fault()) {
    outcome.missed = run.fault().error().message;
  } else if (run.session().is_halted()) {
    outcome.missed = run.session().snapshot().reason;
  } else if (!outcome.success) {
    outcome.missed = unmet(stage.task, run.progress().held);
  }
  return outcome;
}

/// Wilson's interval of a share, 95 %.
std::array<double, 2> interval(int successes, int of) {
  constexpr double z = 1.96;
  const double p = static_cast<double>(successes) / of, spread = z * z / of;
  const double middle = (p + spread / 2.0) / (1.0 + spread);
  const double half = z * std::sqrt(p * (1.0 - p) / of + spread / (4.0 * of)) / (1.0 + spread);
  return {std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

void print_header() {
  std::cout
      << "| task | profile | success, 95 % interval | time, median, s | longest, s | spilled, mean | beyond limits | "
         "forbidden contacts | plans refused | real-time factor |\n|---|---|---|---|---|---|---|---|---|---|\n"
      << std::flush;
}

void print_row(const std::string& task, const std::string& profile, std::vector<Outcome> all, double wall) {
  const int count = static_cast<int>(all.size());
  const auto sum = [&](auto of) {
    return std::accumulate(all.begin(), all.end(), 0.0, [&](double a, const Outcome& o) { return a + double(o.*of); });
  };
  const int successes =
      static_cast<int>(std::count_if(all.begin(), all.end(), [](const auto& o) { return o.success; }));
  const auto [low, high] = interval(successes, count);
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.time < b.time; });
  const double plans = sum(&Outcome::plans), refused = sum(&Outcome::refused);
  std::cout << fmt::format(
                   "| `{}` | {} | {} of {}, {:.0f} to {:.0f} % | {:.1f} | {:.1f} | {:.1f} % | {} | {} | {:.2f} % | "
                   "{:.1f} |\n",
                   task, profile, successes, count, 100.0 * low, 100.0 * high, all[all.size() / 2].time,
                   all.back().time, 100.0 * sum(&Outcome::spilled) / count, sum(&Outcome::beyond),
                   sum(&Outcome::forbidden), 100.0 * refused / std::max(1.0, plans + refused),
                   sum(&Outcome::time) / wall)
            << std::flush;
}

Status run_task(const TasksOptions& options, const std::string& name, const Places& places) {
  SessionSettings settings;
  SettingsTable table = describe(settings);
  if (Status s = options.settings.apply(table); !s) return s;
  if (Status s = settings.resolve(table); !s) return s;
  settings.task_name = name;
  if (table.origin("planner.rate") == "default") settings.live.planner_rate_hz = kRate;
  ArmChoice choice;
  choice.arm = kMujoco.name;
  if (Status s = choose_task(choice, places, table, settings); !s) return s;
  if (settings.task.moves.empty()) {
    return Error{fmt::format("task '{}' has no 'moves' that a scripted operator could do", name)};
  }
  for (const std::string& wanted : options.profiles) {
    auto opened = TaskStage::open(name, settings.robot, wanted, settings.live.planner_rate_hz, places);
    if (!opened) return opened.error();
    TaskStage& stage = *opened;
    const Result<Cell> cell = open_cell(settings.cell, places);
    if (!cell) return cell.error();
    const RetargetSettings retarget = stage.live.planning.retarget;
    stage.live = settings.live;
    stage.live.planning.retarget.scale = retarget.scale;
    stage.live.planning.retarget.yaw = retarget.yaw;
    stage.live.time_budget = false;
    stage.live.cell = in_base(*cell, stage.model);
    stage.mujoco = settings.mujoco;
    Profile& profile = stage.profile;
    if (settings.solver != "profile") profile.solver = settings.solver;
    Recordings recordings{settings.recording, settings.recording_place, {{"settings", table.values()}}};
    recordings.metadata["run"] = {{"arm", std::string(kMujoco.name)}};
    recordings.metadata["task"] = describe_task(stage.task);
    const bool records = table.origin("recording.folder") != "default" && settings.recording.enabled;
    std::vector<Outcome> all;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < options.episodes; ++i) {
      const std::uint32_t seed = stage.mujoco.seed + static_cast<std::uint32_t>(i);
      const Result<Outcome> outcome = run_episode(stage, seed, records ? &recordings : nullptr);
      if (!outcome) return outcome.error();
      all.push_back(*outcome);
      if (options.each || !outcome->success) {
        std::cerr << fmt::format("{} {} seed {}: {} after {:.1f} s{}{}\n", name, profile.name, seed,
                                 outcome->success ? "done" : "failed", outcome->time,
                                 outcome->missed.empty() ? "" : ", not: ", outcome->missed);
      }
    }
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    print_row(stage.task.name, profile.name, std::move(all), wall.count());
  }
  return Done{};
}

Status run_tasks(const TasksOptions& options) {
  if (options.episodes < 1 || options.episodes > kMostEpisodes) {
    return Error{fmt::format("--episodes is {}; it must be from 1 to {}", options.episodes, kMostEpisodes)};
  }
  const Places places = Places::standard();
  print_header();
  for (const std::string& name : options.tasks.empty() ? names_in(places, "tasks") : options.tasks) {
    if (Status s = run_task(options, name, places); !s) return s;
  }
  return Done{};
}

}  // namespace

void add_tasks_command(CommandLine& app, Command& chosen) {
  const auto options = std::make_shared<TasksOptions>();
  CommandLine* command = app.add_subcommand(
      "tasks", "Run tasks in scenes with contact, with a scripted operator (docs/reference/tasks.md)");
  command->add_option("tasks", options->tasks, "Names of tasks/, or task files; default: all of tasks/");
  command->add_option("--episodes", options->episodes, "Episodes for each task and profile, with consecutive seeds")
      ->capture_default_str();
  command->add_option("--profiles", options->profiles, "Profiles")->expected(1, -1)->capture_default_str();
  command->add_flag("--each", options->each, "Print the result of each episode to stderr, not only failures");
  add_settings_options(*command, options->settings, OptionsFor::kTasks);
  command->footer(
      "Runs in virtual time, as fast as possible, with 50 plans per second (--rate changes that). The first seed is "
      "mujoco.seed. With --sessions each episode is recorded, which `dataset` reads.\n"
      "Examples:\n"
      "  steadyhand tasks stack --episodes 100 --profiles tracking carry\n"
      "  steadyhand tasks --episodes 3 --each --set mujoco.seed=7\n"
      "  steadyhand tasks stack --episodes 50 --profiles carry --sessions scripted");
  command->callback([options, &chosen] { chosen = [options] { return run_tasks(*options); }; });
}

}  // namespace steadyhand
#endif

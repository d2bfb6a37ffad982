#ifdef STEADYHAND_MUJOCO
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <numeric>

#include "steadyhand/app/commands.hpp"
#include "steadyhand/app/robot_choice.hpp"
#include "steadyhand/app/session_choice.hpp"
#include "steadyhand/app/settings_options.hpp"
#include "steadyhand/app/task_choice.hpp"
#include "steadyhand/browser/one_thread_session.hpp"
#include "steadyhand/config/cell_file.hpp"
#include "steadyhand/config/places.hpp"
#include "steadyhand/config/robot_file.hpp"
#include "steadyhand/console/scene_things.hpp"
#include "steadyhand/desk/session_setup.hpp"
#include "steadyhand/mujoco/mujoco_arm.hpp"
#include "steadyhand/ocp/objectives.hpp"
#include "steadyhand/task/scripted_operator.hpp"

namespace steadyhand {

namespace {

constexpr double kRate = 50.0;  // Hz, of planning, where the settings do not say it
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

/// What all episodes of a task have in common.
struct Stage {
  RobotModel model;
  ChainDynamics dynamics;
  SessionSettings settings;
  std::vector<std::pair<int, CellObject>> solids;
};

std::string unmet(const Task& task, std::uint32_t held) {
  std::string all;
  for (std::size_t i = 0; i < task.success.size(); ++i) {
    if ((held >> i & 1u) == 0) all += (all.empty() ? "" : ", ") + task.success[i].text;
  }
  return all;
}

/// One episode in virtual time: session, arm and operator take turns on this thread.
Result<Outcome> run_episode(const Stage& stage, const Profile& profile, std::uint32_t seed) {
  SessionSettings settings = stage.settings;
  settings.mujoco.seed = seed;
  if (Status s = take_task(stage.model, settings); !s) return s.error();
  take_profiles({profile}, 0, settings.live);
  SteppedClock clock(nullptr);
  auto arm = MujocoArm::make(stage.model, stage.dynamics, settings.live.cell, settings.task, settings.mujoco, clock);
  if (!arm) return arm.error();
  auto made = OneThreadSession::make(stage.model, settings.live, **arm, clock);
  if (!made) return made.error();
  OneThreadSession& session = **made;
  OperatorInterface desk(session, {profile}, 0, settings.live.planning.retarget, settings.live.glass, {});

  TaskJudge judge(settings.task);
  SceneThings things(stage.solids);
  ScriptedOperator hand(settings.task);
  SceneState scene;
  Status fault = Done{};
  LiveTaps taps;
  taps.look = [&](const SessionSnapshot& look) {
    if (look.state == SupervisionState::kIdle || !(*arm)->read_scene(scene)) return;
    judge.update(scene, look.liquid.spilled_share);
    if (Status s = things.follow(scene, session); !s && fault) fault = s;
    const double gripper = look.measured.gripper.value_or(std::numeric_limits<double>::quiet_NaN());
    session.feed(hand.update(look.now, scene, look.X_base_tool, gripper));
  };
  session.start(std::move(taps));
  while (!judge.progress().success && !session.is_halted() && fault) session.step();

  const SessionSnapshot last = session.snapshot();
  const LiveSummary summary = session.summary();
  Outcome outcome;
  outcome.success = judge.progress().success.value_or(false);
  outcome.time = judge.progress().time;
  outcome.spilled = judge.progress().spilled;
  outcome.beyond = summary.monitor.beyond_limits + summary.monitor.too_fast;
  outcome.forbidden = scene.forbidden;
  outcome.plans = summary.plans;
  outcome.refused = summary.failed_plans + summary.late_plans;
  if (!fault) {
    outcome.missed = fault.error().message;
  } else if (session.is_halted()) {
    outcome.missed = last.reason;
  } else if (!outcome.success) {
    outcome.missed = unmet(settings.task, judge.progress().held);
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
  Stage stage;
  SettingsTable table = describe(stage.settings);
  if (Status s = options.settings.apply(table); !s) return s;
  if (Status s = stage.settings.resolve(table); !s) return s;
  SessionSettings& settings = stage.settings;
  settings.task_name = name;
  settings.live.planning.retarget.scale = 1.0;
  settings.live.planning.retarget.yaw = 0.0;
  if (table.origin("planner.rate") == "default") settings.live.planner_rate_hz = kRate;
  settings.live.time_budget = false;
  ArmChoice choice;
  choice.arm = kMujoco.name;
  if (Status s = choose_task(choice, places, table, settings); !s) return s;
  if (settings.task.moves.empty()) {
    return Error{fmt::format("task '{}' has no 'moves' that a scripted operator could do", name)};
  }
  Result<RobotModel> model = choose_robot(settings.robot, "", places, false);
  if (!model) return model.error();
  stage.model = *std::move(model);
  Result<ChainDynamics> dynamics = open_dynamics(settings.robot, places);
  if (!dynamics) return dynamics.error();
  stage.dynamics = *std::move(dynamics);
  Result<Cell> cell = open_cell(settings.cell, places);
  if (!cell) return cell.error();
  settings.live.cell = in_base(*std::move(cell), stage.model);
  auto solids = solids_of(settings.task, stage.model);
  if (!solids) return solids.error();
  stage.solids = *std::move(solids);

  for (const std::string& wanted : options.profiles) {
    int index = 0;
    Result<std::vector<Profile>> profiles = all_profiles(wanted, places, index);
    if (!profiles) return profiles.error();
    Profile profile = (*profiles)[static_cast<std::size_t>(index)];
    add_posture_where_redundant(profile.ocp, stage.model);
    std::vector<Outcome> all;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < options.episodes; ++i) {
      const std::uint32_t seed = stage.settings.mujoco.seed + static_cast<std::uint32_t>(i);
      const Result<Outcome> outcome = run_episode(stage, profile, seed);
      if (!outcome) return outcome.error();
      all.push_back(*outcome);
      if (options.each || !outcome->success) {
        std::cerr << fmt::format("{} {} seed {}: {} after {:.1f} s{}{}\n", name, profile.name, seed,
                                 outcome->success ? "done" : "failed", outcome->time,
                                 outcome->missed.empty() ? "" : ", not: ", outcome->missed);
      }
    }
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
    print_row(settings.task.name, profile.name, std::move(all), wall.count());
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
  CommandLine* command =
      app.add_subcommand("tasks", "A scripted operator does tasks in scenes with contact (docs/tasks.md)");
  command->add_option("tasks", options->tasks, "Names of tasks/, or task files; default: all of tasks/");
  command->add_option("--episodes", options->episodes, "Of each task under each profile, seed after seed")
      ->capture_default_str();
  command->add_option("--profiles", options->profiles, "Under which profiles")->expected(1, -1)->capture_default_str();
  command->add_flag("--each", options->each, "Say on stderr how each episode went, not only those that failed");
  add_settings_options(*command, options->settings);
  command->footer(
      "In virtual time, as fast as this machine can, planning at 50 Hz unless --rate says another; the first seed is "
      "mujoco.seed.\n"
      "Examples:\n"
      "  steadyhand tasks stack --episodes 100 --profiles tracking carry\n"
      "  steadyhand tasks --episodes 3 --each --set mujoco.seed=7");
  command->callback([options, &chosen] { chosen = [options] { return run_tasks(*options); }; });
}

}  // namespace steadyhand
#endif

#include "steadyhand/apps/commands/task_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>

#include "steadyhand/files/config/task_file.hpp"
#ifdef STEADYHAND_MUJOCO
#include "steadyhand/arms/mujoco/scene_model.hpp"
#endif

namespace steadyhand {

Status choose_task(const ArmChoice& choice, const Places& places, const SettingsTable& table,
                   SessionSettings& settings) {
  const bool has_contact = choice.kind() == &kMujoco;
  if (!has_contact) {
    if (settings.task_name == "none") return Done{};
    return Error{
        fmt::format("task is '{}', and the arm '{}' has no contact; --arm mujoco has", settings.task_name, choice.arm)};
  }
  if (Status s = has_mujoco(places); !s) return s;
  if (settings.mujoco.contact != ContactPolicy::kStop) {
    settings.live.control.path_tolerance = std::numeric_limits<double>::infinity();
  }
  Result<Task> task = open_task(settings.task_name, places);
  if (!task) return task.error();
  settings.task = *std::move(task);
  if (!settings.task.robot.empty() && table.origin("robot") == "default") settings.robot = settings.task.robot;
  return Done{};
}

#ifdef STEADYHAND_MUJOCO
Status take_task(const RobotModel& model, SessionSettings& settings) {
  const auto solids = placed_solids(settings.task, model);
  if (!solids) return solids.error();
  return furnish(settings.task, *solids, settings.mujoco.seed, settings.live.cell);
}

Result<std::vector<std::pair<int, CellObject>>> solids_of(const Task& task, const RobotModel& model) {
  return placed_solids(task, model);
}
#else
Status take_task(const RobotModel&, SessionSettings&) { return Done{}; }

Result<std::vector<std::pair<int, CellObject>>> solids_of(const Task&, const RobotModel&) {
  return std::vector<std::pair<int, CellObject>>();
}
#endif

std::map<std::string, std::string> describe_task(const Task& task) {
  std::vector<std::string> conditions;
  for (const Condition& condition : task.success) conditions.push_back(condition.text);
  return {{"name", task.name},
          {"instruction", task.instruction},
          {"things", fmt::format("{}", fmt::join(task.things, ","))},
          {"conditions", fmt::format("{}", fmt::join(conditions, ", "))},
          {"time_limit_s", fmt::format("{}", task.time_limit)}};
}

}  // namespace steadyhand

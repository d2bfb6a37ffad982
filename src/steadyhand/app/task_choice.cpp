#include "steadyhand/app/task_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>

#include "steadyhand/config/task_file.hpp"
#ifdef STEADYHAND_MUJOCO
#include "steadyhand/mujoco/scene_model.hpp"
#endif

namespace steadyhand {

Status take_task(const ArmChoice& choice, const Places& places, SessionSettings& settings) {
  const bool has_contact = choice.kind() == &kMujoco;
  if (!has_contact) {
    if (settings.task_name == "none") return Done{};
    return Error{
        fmt::format("task is '{}', and the arm '{}' has no contact; --arm mujoco has", settings.task_name, choice.arm)};
  }
  if (settings.mujoco.contact != ContactPolicy::kStop) {
    settings.live.control.path_tolerance = std::numeric_limits<double>::infinity();
  }
  Result<Task> task = open_task(settings.task_name, places);
  if (!task) return task.error();
  settings.task = *std::move(task);
#ifdef STEADYHAND_MUJOCO
  Result<std::vector<CellObject>> objects = kept_off(settings.task);
  if (!objects) return objects.error();
  std::vector<CellObject>& cell = settings.live.cell.objects;
  cell.insert(cell.end(), objects->begin(), objects->end());
#endif
  return Done{};
}

#ifdef STEADYHAND_MUJOCO
Result<std::vector<std::pair<int, CellObject>>> solids_of(const Task& task, const RobotModel& model) {
  return placed_solids(task, model);
}
#else
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

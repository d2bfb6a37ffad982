#include "steadyhand/app/task_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>

#include "steadyhand/config/task_file.hpp"
#ifdef STEADYHAND_MUJOCO
#include "steadyhand/mujoco/scene_model.hpp"
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
  if (settings.mujoco.contact != ContactPolicy::kStop) {
    settings.live.control.path_tolerance = std::numeric_limits<double>::infinity();
  }
  Result<Task> task = open_task(settings.task_name, places);
  if (!task) return task.error();
  settings.task = *std::move(task);
  if (!settings.task.robot.empty() && table.origin("robot") == "default") settings.robot = settings.task.robot;
  return Done{};
}

Status take_task(const RobotModel& model, SessionSettings& settings) {
#ifdef STEADYHAND_MUJOCO
  const Task& task = settings.task;
  std::vector<CellObject>& cell = settings.live.cell.objects;
  Result<std::vector<CellObject>> objects = kept_off(task);
  if (!objects) return objects.error();
  cell.insert(cell.end(), objects->begin(), objects->end());
  const auto solids = placed_solids(task, model);
  if (!solids) return solids.error();
  const Result<std::vector<Pose>> places = draw_places(task, settings.mujoco.seed);
  if (!places) return places.error();
  for (const auto& [thing, solid] : *solids) {
    for (std::size_t i = 0; i < places->size(); ++i) {
      if (task.placings[i].thing != thing) continue;
      const Pose& at = (*places)[i];
      cell.push_back(solid);
      cell.back().origin = Eigen::Translation3d(at.p) * at.q * solid.origin;
    }
  }
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

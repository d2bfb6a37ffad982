#include "steadyhand/app/task_choice.hpp"

#include <fmt/format.h>

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

}  // namespace steadyhand

#pragma once

#include <map>
#include <string>

#include "steadyhand/apps/commands/arm_choice.hpp"
#include "steadyhand/files/config/places.hpp"

namespace steadyhand {

/// Reads the task that the settings name, and takes its robot if none was chosen. If contact is not to stop the arm,
/// deviation from the commands is no fault. Fails if the chosen arm has no contact, or as load_task.
Status choose_task(const ArmChoice& choice, const Places& places, const SettingsTable& table,
                   SessionSettings& settings);

/// The task's scene joins the cell, see furnish and placed_solids.
Status take_task(const RobotModel& model, SessionSettings& settings);

/// What the page draws of the things that the task places, see placed_solids.
Result<std::vector<std::pair<int, CellObject>>> solids_of(const Task& task, const RobotModel& model);

/// A task's metadata in a recording.
std::map<std::string, std::string> describe_task(const Task& task);

}  // namespace steadyhand

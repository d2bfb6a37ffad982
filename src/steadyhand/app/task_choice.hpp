#pragma once

#include "steadyhand/app/arm_choice.hpp"
#include "steadyhand/config/places.hpp"

namespace steadyhand {

/// Reads the task that the settings name. Its objects that the planner keeps off join the cell, and where contact is
/// not to stop the arm its way off the commands is no fault. Fails where the arm that was chosen has no contact, or as
/// load_task and kept_off.
Status take_task(const ArmChoice& choice, const Places& places, SessionSettings& settings);

}  // namespace steadyhand

#pragma once

#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

/// The robot that the user chose for a command. A bare URDF gets bodies fitted to its meshes, unless `no_fit`; stderr
/// reports it.
/// @param tip link of a bare URDF that carries the tool, or several, see tools_on(); empty: the end of its longest
/// chain
Result<RobotModel> choose_robot(const std::string& name, const std::string& tip, const Places& places, bool no_fit);

/// The arm at home; the model must outlive it.
Kinematics at_home(const RobotModel& model);

/// Help of the option that sets tip.
inline constexpr const char* kTipHelp =
    "Link of a bare URDF that carries the tool, or LINK,LINK for two arms (default: the end of the longest chain)";
/// Help of the flag that sets no_fit.
inline constexpr const char* kNoFitHelp = "Accept a bare URDF without collision bodies: the arm can hit itself";

}  // namespace steadyhand

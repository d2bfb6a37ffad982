#pragma once

#include <functional>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// As open_robot(), with the tool on link `tip` of a bare URDF, or tools on several, see tools_on(); empty: at the end
/// of its longest chain.
Result<RobotModel> open_urdf(const std::string& name, const std::string& tip, const Places& places);

/// As open_urdf(), but that a bare URDF with geometry gets bodies: fitted to it, and kept in the folder
/// $XDG_CACHE_HOME/steadyhand (~/.cache/steadyhand) for the next time, under what URDF and meshes hold.
/// @param say one line of what was done, without line feed
/// @param progress as FitSettings::progress; may be empty
Result<RobotModel> open_fitted_robot(const std::string& name, const std::string& tip, const Places& places,
                                     const std::function<void(const std::string&)>& say,
                                     const std::function<void(const std::string&, double)>& progress);

}  // namespace steadyhand

#pragma once

#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"
#include "steadyhand/planning/pipeline/profile.hpp"

namespace steadyhand {

/// A profile by name ("tracking") or path, that may weigh these objectives. Keys: name, label, weights, horizon, dt,
/// prediction, tilt, liquid, solver, tolerance, limits. Refuses with file and line: keys and terms that do not exist
/// (and lists those that do), negative weights, values out of range.
Result<Profile> load_profile(const std::string& name, const Places& places = Places::standard(),
                             const Objectives& objectives = default_objectives());

}  // namespace steadyhand

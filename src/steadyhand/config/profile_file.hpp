#pragma once

#include <string>

#include "steadyhand/config/places.hpp"
#include "steadyhand/config/profile.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/ocp/settings.hpp"

namespace steadyhand {

/// A profile by name ("tracking") or path, that may weigh these objectives. Keys: name, label, weights, horizon, dt,
/// prediction, tilt, liquid, solver, tolerance, limits. Refuses with file and line: keys and terms that do not exist
/// (and lists those that do), negative weights, values out of range.
Result<Profile> load_profile(const std::string& name, const Places& places = Places::standard(),
                             const Objectives& objectives = default_objectives());

}  // namespace steadyhand

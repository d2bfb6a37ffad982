#pragma once

#include <memory>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/config/places.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/planning/pipeline/pipeline.hpp"

namespace steadyhand {

/// A robot by name ("ur5e"), by the path of a robot file (*.yaml), or by that of a URDF (anything else): a bare URDF
/// has no spheres, its tool is the end of its longest chain, and its home the middle of the limits.
Result<RobotModel> open_robot(const std::string& name, const Places& places = Places::standard());

/// A cell by name ("table") or by the path of its file; "none" is empty.
Result<Cell> open_cell(const std::string& name, const Places& places = Places::standard());

/// A profile by name ("tracking") or path, that may weigh these objectives. Keys: name, label, weights, horizon, dt,
/// prediction, tilt, liquid, solver, tolerance, limits. Refuses with file and line: keys and terms that do not exist
/// (and lists those that do), negative weights, values out of range.
Result<Profile> load_profile(const std::string& name, const Places& places = Places::standard(),
                             const Objectives& objectives = default_objectives());

/// A pipeline of a robot and a profile, each by name or file, as the program takes them. Fails where those cannot be
/// read, with the reason.
Result<std::unique_ptr<Pipeline>> open_pipeline(const std::string& robot, const std::string& profile,
                                                const Places& places = Places::standard());

}  // namespace steadyhand

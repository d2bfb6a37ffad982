#pragma once

#include <string>

#include "steadyhand/files/config/places.hpp"
#include "steadyhand/geometry/robot/loading.hpp"
#include "steadyhand/geometry/robot/urdf_dynamics.hpp"

namespace steadyhand {

/// Reads robots/NAME.yaml (its keys: docs/how-to/add-a-robot.md). Fails as YamlMap says; a URDF in a package must be
/// installed.
Result<RobotSettings> load_robot_settings(const std::filesystem::path& file, const Places& places);

/// Otherwise it is a URDF.
bool is_robot_file(const std::filesystem::path& file);

/// The masses and largest efforts of the same robot. Fails as read_chain_dynamics.
Result<ChainDynamics> open_dynamics(const std::string& name, const Places& places = Places::standard());

}  // namespace steadyhand

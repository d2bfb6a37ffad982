#pragma once

#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/config/places.hpp"

namespace steadyhand {

/// The visual geometry of a robot (as open_urdf takes its name) for the page: a binary glTF file with a node "linkK"
/// for each link frame of the chain that shows anything. Corners are merged on a grid so fine that an arm has at most
/// some 100,000 triangles. Empty: the URDF shows nothing. Refuses what load_mesh and read_urdf_chain do.
Result<std::string> arm_scene(const std::string& robot, const std::string& tip, const Places& places);

}  // namespace steadyhand

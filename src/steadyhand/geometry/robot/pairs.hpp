#pragma once

#include <vector>

#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// The pairs of bodies that the arm must keep apart: all but those on one link, on neighbouring links, and those that
/// overlap in every configuration (docs/explanation/formulation.md). Whether a pair ever comes apart is decided by
/// seeded sampling of the joints between its links, inside their position limits, followed by a local ascent of the
/// distance; the same model always gives the same pairs. Reads joints, limits and bodies. Sorted.
std::vector<BodyPair> default_pairs(const RobotModel& model);

}  // namespace steadyhand

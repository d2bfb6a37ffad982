#pragma once

#include <functional>
#include <vector>

#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Whether bodies on two links can be a pair: another link is between them, and `first` has the lower index.
inline bool may_be_pair(const RobotModel& model, int first, int last) {
  return first < last && model.parent(last - 1) != first;
}

/// Pose of the link at the end of a way (way_between) in the link at its beginning. q: of the joints on the way.
Eigen::Isometry3d pose_along(const RobotModel& model, const std::vector<SignedJoint>& way, const JointVector& q);

/// The pairs of bodies that the arm must keep apart: all but those on one link, on neighbouring links, and those that
/// overlap in every configuration (docs/explanation/formulation.md). Whether a pair ever comes apart is decided by
/// seeded sampling of the joints between its links, inside their position limits, followed by a local ascent of the
/// distance; the same model always gives the same pairs. Reads joints, limits and bodies. Sorted.
/// @param wanted whether to consider two bodies, by index; absent: all
std::vector<BodyPair> default_pairs(const RobotModel& model, const std::function<bool(int, int)>& wanted = {});

}  // namespace steadyhand

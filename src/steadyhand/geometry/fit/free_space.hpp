#pragma once

#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/fit/cover.hpp"
#include "steadyhand/geometry/fit/fit.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"

namespace steadyhand {

/// A convex part on a link of the chain.
struct Part {
  int link = 0;
  std::size_t row = 0;  ///< of FitResult::links
  Points corners;       ///< in the frame of that link
  Vector3 center = Vector3::Zero();
  double extent = 0.0;
};

using Poses = std::vector<Eigen::Isometry3d>;  ///< by link of the chain, base frame

Poses poses_at(const RobotModel& model, const JointVector& q);

/// Pairs of rows of FitResult::links.
using RowPairs = std::set<std::pair<std::size_t, std::size_t>>;

/// @param directions corners kept of each part, the outermost in so many directions; 0: all
std::vector<Part> make_parts(const std::vector<FittedLink>& links, const UrdfChain& chain, int directions);

Nearest nearest_of(const Part& a, const Part& b, const Poses& poses, double enough);

/// Whether convex parts of two links that are not neighbours touch. The pairs of rows in `but` are not checked.
bool parts_touch(const RobotModel& model, const std::vector<Part>& parts, const Poses& poses, const RowPairs& but);

/// Pairs of rows whose convex parts touch in each of some random configurations, e.g. a shoulder in its torso's shell:
/// the arm cannot avoid it.
RowPairs links_together(const RobotModel& model, const std::vector<Part>& parts, std::uint32_t seed);

/// Random configurations in which the convex parts are apart. The pairs of rows in `together` may touch.
std::vector<Poses> free_poses(const RobotModel& model, const std::vector<Part>& parts, const RowPairs& together,
                              std::uint32_t seed, const std::function<void(double)>& progress);

/// Pairs of rows that are apart in every configuration, the first one nearer to the base. Only links with two joints
/// between them: with more, the search does not end.
RowPairs links_apart(const RobotModel& model, const std::vector<Part>& parts);

/// The bodies of a link, placed: a core's corners and a radius about them.
struct Fitted : Part {
  double radius = 0.0;
};

std::vector<Fitted> cores_of(const std::vector<FittedSolid>& solids, std::size_t row, const UrdfChain::Frame& frame);

/// Where other links come near one of them: near their bodies if they have some, otherwise near their convex parts.
/// @param bodies by row
std::vector<CoverProbe> probes_of(const RobotModel& model, std::size_t row, const std::vector<Part>& parts,
                                  const std::vector<std::vector<Fitted>>& bodies, const std::vector<Poses>& free,
                                  const RowPairs& left_out, const UrdfChain::Frame& frame, std::uint32_t seed);

/// Probes evenly over the surface of the convex parts.
void add_probes_around(const std::vector<Hull>& parts, std::uint32_t seed, std::vector<CoverProbe>& probes);

/// Configurations that the bodies refuse.
int count_refused(const RobotModel& model, const std::vector<std::vector<Fitted>>& bodies,
                  const std::vector<Poses>& free, const RowPairs& left_out);

}  // namespace steadyhand

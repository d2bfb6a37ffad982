#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/geometry/robot/urdf_text.hpp"

namespace steadyhand {

/// Limits of one moving joint in a URDF; absent if the URDF has none.
struct UrdfLimits {
  /// From a lower limit to an upper one.
  struct Range {
    double lower;  ///< rad (m)
    double upper;  ///< rad (m)
  };
  std::optional<double> lower;     ///< rad (m)
  std::optional<double> upper;     ///< rad (m)
  std::optional<double> velocity;  ///< rad/s (m/s)
  /// The URDF's limit element, if the soft limits of its safety_controller are narrower: these are lower and upper.
  std::optional<Range> beyond_soft;
};

/// The joints of a URDF on the ways from its root to the tools, with fixed joints merged away: one chain, or a tree.
struct UrdfChain {
  /// Where a URDF link's frame is: fixed to link 0..n of the chain.
  struct Frame {
    int link = 0;                                                    ///< 0 is the base
    Eigen::Isometry3d X_link_frame = Eigen::Isometry3d::Identity();  ///< fixed
  };

  std::string robot_name;               ///< the URDF's
  std::vector<std::string> tool_links;  ///< where the ways end
  std::vector<Joint> joints;            ///< n: those on the way to the first tool, then what the next one adds
  std::vector<UrdfLimits> limits;       ///< n
  std::vector<std::string> link_names;  ///< n + 1; first the root link, whose frame is the base
  std::map<std::string, Frame> frames;  ///< by link of the URDF
  /// Assumed positions, rad (m), of moving joints that are not on the chain and have no given position.
  std::map<std::string, double> assumed;
  std::vector<std::string> notes;  ///< for users: parts of the URDF that were left out or are ambiguous, a line each
};

/// Continuous joints turn without end; the solver's bounds are finite. Their limit is 100 turns either way, which no
/// session reaches.
inline constexpr double kContinuousLimit = 200.0 * M_PI;

/// Reads the chain from the root link to each of `tool_links`. None, or an empty one: the end of the chain with most
/// moving joints, but no further than where moving joints branch after four of them, like a gripper's fingers.
/// Revolute, continuous, prismatic and fixed joints, 1 to kMaxJoints moving ones, none of which mimics; each of several
/// tools has a joint that moves it alone. An axis may miss unit length by 1 % and is normalised. A continuous joint has
/// the limits of its limit element if that gives a range, otherwise kContinuousLimit. Not read: dynamics.
/// @param locked positions, rad (m), of moving joints that are not on the chain, by name. A joint that mimics another
///        follows it; the others are at 0, or at the limit nearest to 0.
Result<UrdfChain> read_urdf_chain(const std::filesystem::path& file, const std::vector<std::string>& tool_links,
                                  const std::map<std::string, double>& locked = {}, Xacro xacro = Xacro::kIfNamed);

}  // namespace steadyhand

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

/// Used where a robot's file gives no acceleration limit, rad/s^2 (m/s^2).
inline constexpr double kDefaultAcceleration = 15.0;

/// What a robot file says (robots/ur5e.yaml); the rest comes from the URDF.
struct RobotSettings {
  /// A body by the name of its link.
  struct BodyOnLink {
    std::string name;                                          ///< for `pairs` and messages
    std::string link;                                          ///< URDF link, also one behind fixed joints
    Shape shape;                                               ///< not a half-space
    Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< pose of the shape in that link's frame
  };

  std::string name;                                         ///< empty: the URDF's
  std::string meshes;                                       ///< whose the page draws; empty: those of the robot's name
  std::filesystem::path urdf;                               ///< the file
  Xacro xacro = Xacro::kIfNamed;                            ///< whether xacro expands it
  Eigen::Isometry3d mount = Eigen::Isometry3d::Identity();  ///< pose of the URDF's root in the base, whose z is up
  std::string tool_name = "tool";                           ///< for messages
  std::string tool_link;  ///< URDF link that carries the tool and ends the chain; empty: the end of the longest chain
  /// Positions of moving joints that are not on the chain, by name, rad (m); see read_urdf_chain.
  std::map<std::string, double> locked;
  Eigen::Isometry3d tool_origin = Eigen::Isometry3d::Identity();  ///< in the frame of tool_link
  std::optional<std::vector<double>> home;                        ///< n, rad (m); absent: the middle of the limits
  std::optional<std::vector<double>> acceleration_max;            ///< n, rad/s^2 (m/s^2); absent: kDefaultAcceleration
  std::optional<std::vector<double>> velocity_max;                ///< n, rad/s (m/s); absent: the URDF's
  std::optional<std::vector<double>> position_min;                ///< n, rad (m); absent: the URDF's
  std::optional<std::vector<double>> position_max;                ///< n, rad (m); absent: the URDF's
  std::vector<BodyOnLink> bodies;                                 ///< none: no self-collision
  std::optional<double> gripper_time;                             ///< s, see RobotModel
  /// Names of bodies; absent: default_pairs().
  std::optional<std::vector<std::pair<std::string, std::string>>> pairs;
};

/// Reads the URDF and joins it with the settings. Refuses, with the reason: a file that is missing or is no URDF, a
/// chain with a loop, 0 or more than 8 moving joints on the way to the tool, joint types
/// other than revolute, continuous, prismatic and fixed, missing meshes, limits that are absent or empty, wrong sizes,
/// bodies on unknown links or without size, and a home pose outside the limits or in self-collision.
Result<RobotModel> load_robot(const RobotSettings& settings);

}  // namespace steadyhand

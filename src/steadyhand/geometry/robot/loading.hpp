#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/geometry/robot/urdf_text.hpp"

namespace steadyhand {

/// Used where a robot's file gives no acceleration limit, rad/s^2 (m/s^2).
inline constexpr double kDefaultAcceleration = 15.0;

/// Link 0 of arms on one base; its frame is the base.
inline constexpr const char* kBaseLink = "world";

/// What a robot file says (robots/ur5e.yaml); the rest comes from the URDF.
struct RobotSettings {
  /// A body by the name of its link.
  struct BodyOnLink {
    std::string name;                                          ///< for `pairs` and messages
    std::string link;                                          ///< URDF link, also one behind fixed joints
    Shape shape;                                               ///< not a half-space
    Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< pose of the shape in that link's frame
  };

  /// A tool by the name of its link.
  struct ToolOnLink {
    std::string name = "tool";                                 ///< for messages; of several each has its own
    std::string link;                                          ///< URDF link that carries it, see read_urdf_chain
    Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< in the frame of the link
    std::optional<double> gripper_time{};                      ///< s, see Tool
  };
  /// A number for each joint, in the order of the joints, or for some joints, by name.
  using PerJoint = std::variant<std::vector<double>, std::map<std::string, double>>;

  std::string name;                                         ///< empty: the URDF's
  std::string meshes;                                       ///< whose the page draws; empty: those of the robot's name
  std::filesystem::path urdf;                               ///< the file
  Xacro xacro = Xacro::kIfNamed;                            ///< whether xacro expands it
  Eigen::Isometry3d mount = Eigen::Isometry3d::Identity();  ///< pose of the URDF's root in the base, whose z is up
  std::vector<ToolOnLink> tools = std::vector<ToolOnLink>(1);  ///< one for each arm
  /// Positions of moving joints that are not on the chain, by name, rad (m); see read_urdf_chain.
  std::map<std::string, double> locked;
  std::optional<PerJoint> home;              ///< rad (m); absent: the middle of the limits
  std::optional<PerJoint> acceleration_max;  ///< rad/s^2 (m/s^2); absent: kDefaultAcceleration
  std::optional<PerJoint> velocity_max;      ///< rad/s (m/s); absent: the URDF's
  std::optional<PerJoint> position_min;      ///< rad (m); absent: the URDF's
  std::optional<PerJoint> position_max;      ///< rad (m); absent: the URDF's
  std::vector<BodyOnLink> bodies;            ///< none: no self-collision
  /// Names of bodies; absent: default_pairs().
  std::optional<std::vector<std::pair<std::string, std::string>>> pairs;
  /// Arms on one base, each a robot with one tool. Then only name, meshes and bodies, on kBaseLink, are used.
  std::vector<RobotSettings> arms{};
};

/// Reads the URDF and joins it with the settings. Refuses, with the reason: a file that is missing or is no URDF, a
/// chain with a loop, 0 or more than kMaxJoints moving joints on the ways to the tools, two tools of one name or on one
/// chain, joint types other than revolute, continuous, prismatic and fixed, missing meshes, limits that are absent or
/// empty, wrong sizes, bodies on unknown links or without size, and a home pose outside the limits or in
/// self-collision.
///
/// The function loads each of settings.arms by itself and joins them: their joints, links and bodies get the arm's name
/// and '_' as prefix, each tool the arm's name. Pairs of one arm are its own; between arms, and between an arm and the
/// bodies of the base, they are default_pairs(). Refuses other than kMaxTools arms, and arms that collide at home.
Result<RobotModel> load_robot(const RobotSettings& settings);

/// Tools of a bare URDF, on the links that `tips` names, separated by commas; empty: at the end of its longest chain.
std::vector<RobotSettings::ToolOnLink> tools_on(const std::string& tips);

/// The links of tools, for read_urdf_chain.
std::vector<std::string> links_of(const std::vector<RobotSettings::ToolOnLink>& tools);

}  // namespace steadyhand

#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/geometry/collision/shape.hpp"

namespace steadyhand {

/// Turns about its axis, or slides along it.
enum class JointType { kRevolute, kPrismatic };

/// Joint k (0-based) moves link k + 1 relative to link k: T_{k+1} = T_k * origin * motion(axis, q_k). T_0 is the
/// identity: link 0 does not move, and its frame is the base.
struct Joint {
  std::string name;                                          ///< the URDF's
  JointType type = JointType::kRevolute;                     ///< a continuous one is revolute with far limits
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< joint frame in the frame of link k, at q_k = 0
  Vector3 axis = Vector3::UnitZ();                           ///< unit, in the joint frame
};

/// The controlled frame (the glass), fixed to the last link: origin at its centre, z along its axis, out of the
/// opening.
struct Tool {
  std::string name;                                          ///< for messages
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< in the frame of link n
};

/// A solid that covers part of a link.
struct Body {
  std::string name;                                          ///< for messages and pairs
  int link = 0;                                              ///< 0 does not move, k is the link behind joint k - 1
  Shape shape;                                               ///< not a half-space
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< pose of the shape's frame, in the link's

  /// A sphere. center: m, link frame; radius: m
  static Body sphere(std::string name, int link, const Vector3& center, double radius) {
    return {std::move(name), link, Shape::sphere(radius), Eigen::Isometry3d(Eigen::Translation3d(center))};
  }
};

/// Two bodies that must not overlap, as indices into RobotModel::bodies; first.link < second.link.
using BodyPair = std::pair<int, int>;

/// A serial arm. Never changes after loading; every thread may read it.
struct RobotModel {
  std::string name;    ///< for tables and files
  std::string meshes;  ///< name of the robot whose meshes the page draws
  /// Pose of the URDF's root in the base, whose z is up; the first joint's origin and the bodies on link 0 have it.
  Eigen::Isometry3d mount = Eigen::Isometry3d::Identity();
  std::vector<Joint> joints;               ///< n of them, from the base
  std::vector<std::string> link_names;     ///< n + 1, the URDF's name of the link that each joint moves; first the base
  Tool tool;                               ///< on the last link
  JointVector home;                        ///< rad (m)
  JointVector position_min;                ///< rad (m)
  JointVector position_max;                ///< rad (m)
  JointVector velocity_max;                ///< rad/s (m/s)
  JointVector acceleration_max;            ///< rad/s^2 (m/s^2)
  std::vector<Body> bodies;                ///< that cover the arm and what it holds
  std::vector<BodyPair> pairs;             ///< of bodies that are kept apart
  std::optional<double> gripper_time{};    ///< s, in which the tool, a gripper, closes; absent: it is none
  std::vector<std::string> assumptions{};  ///< for people: assumptions of the loader, a line each

  int dof() const { return static_cast<int>(joints.size()); }  ///< n
};

/// What a model lacks for the usual functions, a line for each; most for a plain URDF without a robot file.
std::vector<std::string> doubts_about(const RobotModel& model);

/// The ball that holds every position the tool can take.
struct Reach {
  Vector3 center = Vector3::Zero();  ///< m, base frame; on the first joint's axis
  double radius = 0.0;               ///< m
};

/// The smallest such ball with its centre on the axis of the first joint, which for a revolute one is where symmetry
/// puts it: found by seeded sampling of the joints inside their limits, then a local ascent of the distance from the
/// samples farthest out, and 0.1 mm on top. Deterministic. Takes some 50 ms: for set-up, not for the loop.
Reach compute_reach(const RobotModel& model);

/// The point itself, or where the line from the centre to it leaves the ball. Allocates nothing.
Vector3 clip(const Reach& reach, const Vector3& point);

}  // namespace steadyhand

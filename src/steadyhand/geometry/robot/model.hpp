#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/core/math.hpp"
#include "steadyhand/geometry/collision/shape.hpp"

namespace steadyhand {

/// Turns about its axis, or slides along it.
enum class JointType { kRevolute, kPrismatic };

/// Joint k (0-based) moves link k + 1 relative to its parent link p <= k: T_{k+1} = T_p * origin * motion(axis, q_k).
/// T_0 is the identity: link 0 does not move, and its frame is the base.
struct Joint {
  std::string name;                                          ///< the URDF's
  JointType type = JointType::kRevolute;                     ///< a continuous one is revolute with far limits
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< joint frame in that of the parent link, at q_k = 0
  Vector3 axis = Vector3::UnitZ();                           ///< unit, in the joint frame
  int parent = kBefore;                                      ///< link, 0 to k; see RobotModel::parent

  static constexpr int kBefore = -1;  ///< as parent: link k, which the joint before moves
};

/// A controlled frame (a glass), fixed to a link: origin at its centre, z along its axis, out of the opening.
struct Tool {
  std::string name;                                          ///< for messages; of several each has its own
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< in the frame of the link
  int link = 0;                                              ///< that carries it, 1 to n
  std::optional<double> gripper_time{};  ///< s, in which the tool, a gripper, closes; absent: it is none
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

/// Some of a robot's joints, by their index.
using JointSet = std::bitset<kMaxJoints>;

/// Two bodies that must not overlap, as indices into RobotModel::bodies; first.link < second.link.
using BodyPair = std::pair<int, int>;

/// One arm, or several that share a base: a tree of joints with a tool at the end of each arm. Never changes after
/// loading; every thread may read it.
struct RobotModel {
  std::string name;    ///< for tables and files
  std::string meshes;  ///< name of the robot whose meshes the page draws
  /// Pose of the URDF's root in the base, whose z is up; the first joint's origin and the bodies on link 0 have it.
  Eigen::Isometry3d mount = Eigen::Isometry3d::Identity();
  std::vector<Joint> joints;               ///< n of them, each behind its parent
  std::vector<std::string> link_names;     ///< n + 1, the URDF's name of the link that each joint moves; first the base
  std::vector<Tool> tools;                 ///< one for each arm, 1 to kMaxTools
  JointVector home;                        ///< rad (m)
  JointVector position_min;                ///< rad (m)
  JointVector position_max;                ///< rad (m)
  JointVector velocity_max;                ///< rad/s (m/s)
  JointVector acceleration_max;            ///< rad/s^2 (m/s^2)
  std::vector<Body> bodies;                ///< that cover the arm and what it holds
  std::vector<BodyPair> pairs;             ///< of bodies that are kept apart
  std::vector<std::string> assumptions{};  ///< for people: assumptions of the loader, a line each

  int dof() const { return static_cast<int>(joints.size()); }        ///< n
  int tool_count() const { return static_cast<int>(tools.size()); }  ///< how many arms
  const Tool& tool() const { return tools.front(); }                 ///< the first
  /// Link from which joint k moves its own, k + 1.
  int parent(int k) const { return joints[k].parent == Joint::kBefore ? k : joints[k].parent; }
  /// Joints that move a link, from the base on: indices increase.
  std::vector<int> chain(int link) const;
};

/// A joint on the way from one link to another.
struct SignedJoint {
  int joint;    ///< its index
  double sign;  ///< -1 where the way goes towards the base, 1 where it goes away from it
};
/// The joints that move link `last` relative to link `first`, in the order in which the way passes them. The motion of
/// `last`, seen from `first`, is that of a serial arm of these joints, with the sign of each.
std::vector<SignedJoint> way_between(const RobotModel& model, int first, int last);

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
Reach compute_reach(const RobotModel& model, int tool = 0);
std::vector<Reach> compute_reaches(const RobotModel& model);  ///< of each tool

/// The point itself, or where the line from the centre to it leaves the ball. Allocates nothing.
Vector3 clip(const Reach& reach, const Vector3& point);

}  // namespace steadyhand

#include "steadyhand/robot/urdf_chain.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <urdf_model/joint.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "steadyhand/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

constexpr double kAxisTolerance = 0.01;

bool moves(const urdf::Joint& joint) { return joint.type != urdf::Joint::FIXED; }

const char* type_name(const urdf::Joint& joint) {
  switch (joint.type) {
    case urdf::Joint::REVOLUTE:
      return "revolute";
    case urdf::Joint::CONTINUOUS:
      return "continuous";
    case urdf::Joint::PRISMATIC:
      return "prismatic";
    case urdf::Joint::FLOATING:
      return "floating";
    case urdf::Joint::PLANAR:
      return "planar";
    case urdf::Joint::FIXED:
      return "fixed";
    default:
      return "unknown";
  }
}

Eigen::Isometry3d to_eigen(const urdf::Pose& pose) {
  const urdf::Rotation& r = pose.rotation;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Quaternion(r.w, r.x, r.y, r.z).normalized().toRotationMatrix();
  T.translation() = Vector3(pose.position.x, pose.position.y, pose.position.z);
  return T;
}

/// Joints from the root to a link.
std::vector<const urdf::Joint*> path_to(const urdf::ModelInterface& model, const urdf::Link& link) {
  std::vector<const urdf::Joint*> path;
  for (const urdf::Link* at = &link; at->parent_joint; at = model.getLink(at->parent_joint->parent_link_name).get()) {
    path.push_back(at->parent_joint.get());
  }
  std::reverse(path.begin(), path.end());
  return path;
}

/// The end of the chain with most moving joints; of equal ones that with most joints, then the first by name.
const urdf::Link* longest_chain_end(const urdf::ModelInterface& model) {
  const urdf::Link* best = nullptr;
  std::pair<std::ptrdiff_t, std::size_t> longest{-1, 0};
  for (const auto& [name, link] : model.links_) {
    const auto path = path_to(model, *link);
    const auto moving = std::count_if(path.begin(), path.end(), [](const urdf::Joint* joint) { return moves(*joint); });
    if (const std::pair length{moving, path.size()}; length > longest) {
      longest = length;
      best = link.get();
    }
  }
  return best;
}

/// Reads one moving joint of the chain. `X_link_parent`: what fixed joints stand between.
Result<Joint> read_joint(const std::string& file, const urdf::Joint& urdf_joint,
                         const Eigen::Isometry3d& X_link_parent) {
  const auto refuse = [&](const std::string& reason) {
    return Error{fmt::format("{}: joint '{}' {}", file, urdf_joint.name, reason)};
  };
  Joint joint;
  joint.name = urdf_joint.name;
  switch (urdf_joint.type) {
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      joint.type = JointType::kRevolute;
      break;
    case urdf::Joint::PRISMATIC:
      joint.type = JointType::kPrismatic;
      break;
    default:
      return refuse(
          fmt::format("is {}; an arm's joints are revolute, continuous, prismatic or fixed", type_name(urdf_joint)));
  }
  if (urdf_joint.mimic)
    return refuse(fmt::format("mimics '{}'; every joint must move freely", urdf_joint.mimic->joint_name));
  const Vector3 axis(urdf_joint.axis.x, urdf_joint.axis.y, urdf_joint.axis.z);
  if (!(std::abs(axis.norm() - 1.0) <= kAxisTolerance)) {
    return refuse(fmt::format("has axis [{}, {}, {}] of length {:.6g}; it must have length 1", axis.x(), axis.y(),
                              axis.z(), axis.norm()));
  }
  joint.axis = axis.normalized();
  joint.origin = X_link_parent * to_eigen(urdf_joint.parent_to_joint_origin_transform);
  return joint;
}

UrdfLimits read_limits(const urdf::Joint& joint) {
  UrdfLimits limits;
  if (joint.type == urdf::Joint::CONTINUOUS) {
    limits.lower = -kContinuousLimit;
    limits.upper = kContinuousLimit;
  } else if (joint.limits) {
    limits.lower = joint.limits->lower;
    limits.upper = joint.limits->upper;
  }
  if (joint.limits) limits.velocity = joint.limits->velocity;
  return limits;
}

Status check_origins_finite(const std::string& file, const urdf::ModelInterface& model) {
  for (const auto& [name, joint] : model.joints_) {
    if (!to_eigen(joint->parent_to_joint_origin_transform).matrix().allFinite()) {
      return Error{fmt::format("{}: the origin of joint '{}' holds a number that is not finite", file, name)};
    }
  }
  return Done{};
}

/// The link that every moving joint moves, if there is one: the end of a serial arm.
std::string end_of_all_joints(const urdf::ModelInterface& model) {
  const urdf::Link* end = longest_chain_end(model);
  if (end == nullptr) return {};
  const auto path = path_to(model, *end);
  const std::set<const urdf::Joint*> on_path(path.begin(), path.end());
  const bool serial = std::all_of(model.joints_.begin(), model.joints_.end(), [&](const auto& entry) {
    return !moves(*entry.second) || on_path.contains(entry.second.get());
  });
  return serial ? end->name : std::string();
}

Status check_side_branches(const std::string& file, const urdf::ModelInterface& model,
                           const std::set<const urdf::Joint*>& chain, const std::string& tool_link) {
  const std::string serial_end = end_of_all_joints(model);
  for (const auto& [name, joint] : model.joints_) {
    if (chain.contains(joint.get()) || !moves(*joint)) continue;
    const std::string help = serial_end.empty() ? "make this joint fixed, as a gripper's fingers are to the planner"
                                                : "choose tool link '" + serial_end + "', which all joints move";
    return Error{fmt::format(
        "{}: joint '{}' ({}) moves link '{}', which is not on the chain from '{}' to tool link '{}'; steadyhand drives "
        "serial arms: {}",
        file, name, type_name(*joint), joint->child_link_name, model.getRoot()->name, tool_link, help)};
  }
  return Done{};
}

std::map<std::string, UrdfChain::Frame> link_frames(const urdf::ModelInterface& model) {
  std::map<std::string, UrdfChain::Frame> frames;
  for (const auto& [name, link] : model.links_) {
    UrdfChain::Frame frame;
    for (const urdf::Joint* joint : path_to(model, *link)) {
      if (moves(*joint)) {
        frame = {frame.link + 1, Eigen::Isometry3d::Identity()};
      } else {
        frame.X_link_frame = frame.X_link_frame * to_eigen(joint->parent_to_joint_origin_transform);
      }
    }
    frames.emplace(name, frame);
  }
  return frames;
}

}  // namespace

Result<UrdfChain> read_urdf_chain(const std::filesystem::path& path, const std::string& tool_link) {
  const Result<urdf::ModelInterfaceSharedPtr> parsed = read_urdf(path);
  if (!parsed) return parsed.error();
  const urdf::ModelInterface& model = **parsed;
  const std::string file = path.string();
  if (Status status = check_origins_finite(file, model); !status) return status.error();

  const urdf::Link* tool = tool_link.empty() ? longest_chain_end(model) : model.getLink(tool_link).get();
  if (tool == nullptr) {
    std::vector<std::string> names;
    for (const auto& [name, link] : model.links_) names.push_back(name);
    return Error{
        fmt::format("{} has no link '{}' to carry the tool; its links: {}", file, tool_link, fmt::join(names, ", "))};
  }

  UrdfChain chain;
  chain.robot_name = model.getName();
  chain.tool_link = tool->name;
  chain.link_names = {model.getRoot()->name};
  const auto joints = path_to(model, *tool);
  Eigen::Isometry3d X_link_parent = Eigen::Isometry3d::Identity();
  for (const urdf::Joint* urdf_joint : joints) {
    if (!moves(*urdf_joint)) {
      X_link_parent = X_link_parent * to_eigen(urdf_joint->parent_to_joint_origin_transform);
      continue;
    }
    Result<Joint> joint = read_joint(file, *urdf_joint, X_link_parent);
    if (!joint) return joint.error();
    chain.joints.push_back(*joint);
    chain.limits.push_back(read_limits(*urdf_joint));
    chain.link_names.push_back(urdf_joint->child_link_name);
    X_link_parent.setIdentity();
  }
  if (chain.joints.empty() || chain.joints.size() > static_cast<std::size_t>(kMaxJoints)) {
    return Error{fmt::format("{}: the chain from '{}' to '{}' has {} moving joints; an arm has 1 to {}", file,
                             chain.link_names[0], tool->name, chain.joints.size(), kMaxJoints)};
  }
  const std::set<const urdf::Joint*> on_chain(joints.begin(), joints.end());
  if (Status status = check_side_branches(file, model, on_chain, tool->name); !status) return status.error();
  chain.frames = link_frames(model);
  return chain;
}

}  // namespace steadyhand

#include "steadyhand/geometry/robot/urdf_chain.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <urdf_model/joint.h>
#include <urdf_model/link.h>
#include <urdf_model/model.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <string_view>

#include "steadyhand/core/nearest.hpp"
#include "steadyhand/core/texts.hpp"
#include "steadyhand/geometry/robot/urdf_file.hpp"

namespace steadyhand {

namespace {

constexpr double kAxisTolerance = 0.01;

bool moves(const urdf::Joint& joint) { return joint.type != urdf::Joint::FIXED; }

std::string_view type_name(const urdf::Joint& joint) {
  static constexpr std::pair<int, std::string_view> kTypes[] = {
      {urdf::Joint::REVOLUTE, "revolute"},   {urdf::Joint::CONTINUOUS, "continuous"},
      {urdf::Joint::PRISMATIC, "prismatic"}, {urdf::Joint::FLOATING, "floating"},
      {urdf::Joint::PLANAR, "planar"},       {urdf::Joint::FIXED, "fixed"}};
  return text_of(kTypes, static_cast<int>(joint.type));
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

bool anything_moves(const urdf::Link& link) {
  return std::any_of(link.child_links.begin(), link.child_links.end(), [](const urdf::LinkSharedPtr& child) {
    return moves(*child->parent_joint) || anything_moves(*child);
  });
}

/// Where the arm of a URDF ends that does not say it.
const urdf::Link* arm_end(const urdf::ModelInterface& model) {
  constexpr int kLeast = 4;  // moving joints: what parts ways before is another arm
  const urdf::Link* end = longest_chain_end(model);
  if (end == nullptr) return end;
  int moving = 0;
  for (const urdf::Joint* joint : path_to(model, *end)) {
    const urdf::Link* link = model.getLink(joint->parent_link_name).get();
    const auto ways = std::count_if(link->child_links.begin(), link->child_links.end(), [](const auto& child) {
      return moves(*child->parent_joint) || anything_moves(*child);
    });
    if (moving >= kLeast && ways > 1) return link;
    moving += moves(*joint);
  }
  return end;
}

/// Reads one moving joint of the chain. `X_link_parent`: transform of the fixed joints in between.
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

/// A continuous joint may have one, too: its <limit> says how far the cables let it turn.
bool has_range(const urdf::Joint& joint) { return joint.limits && joint.limits->lower < joint.limits->upper; }

UrdfLimits read_limits(const urdf::Joint& joint) {
  UrdfLimits limits;
  if (joint.limits) {
    limits.lower = joint.limits->lower;
    limits.upper = joint.limits->upper;
    limits.velocity = joint.limits->velocity;
  }
  if (joint.type == urdf::Joint::CONTINUOUS && !has_range(joint)) {
    limits.lower = -kContinuousLimit;
    limits.upper = kContinuousLimit;
  }
  if (!joint.safety || !limits.lower) return limits;
  // Soft limits that leave no range are ignored: urdfdom reads absent ones as 0.
  const double lower = std::max(*limits.lower, joint.safety->soft_lower_limit);
  const double upper = std::min(*limits.upper, joint.safety->soft_upper_limit);
  if (!(lower < upper) || (lower == *limits.lower && upper == *limits.upper)) return limits;
  limits.beyond_soft = {*limits.lower, *limits.upper};
  limits.lower = lower;
  limits.upper = upper;
  return limits;
}

bool names_a_gripper(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto says = [&](std::string_view word) { return name.find(word) != std::string::npos; };
  return says("grip") || says("finger") || says("jaw") || says("claw") || says("thumb");
}

/// A gripper that one joint moves looks like the arm's last joint.
void note_gripper(const std::vector<const urdf::Joint*>& joints, UrdfChain& chain) {
  const auto last = std::find_if(joints.rbegin(), joints.rend(), [](const auto* joint) { return moves(*joint); });
  if (last == joints.rend()) return;
  const urdf::Joint& joint = **last;
  if (!names_a_gripper(joint.name)) return;
  chain.notes.push_back(fmt::format(
      "joint '{}' counts as joint {} of the arm, and by its name it moves a gripper: if so, let the arm end before it, "
      "by --tip {} or tool.link in a robot file (docs/how-to/add-a-robot.md)",
      joint.name, chain.joints.size(), joint.parent_link_name));
}

void note_unread(const std::vector<UnreadElement>& unread, UrdfChain& chain) {
  constexpr std::size_t kMostNamed = 3;
  std::vector<std::string> named;
  for (const UnreadElement& each : unread) {
    if (named.size() == kMostNamed) break;
    named.push_back(fmt::format("<{}> of link '{}' ({}: {})", each.element, each.link, each.where, each.reason));
  }
  if (unread.empty()) return;
  const std::size_t more = unread.size() - named.size();
  chain.notes.push_back(fmt::format("cannot be read and is left out: {}{}", fmt::join(named, ", "),
                                    more > 0 ? fmt::format(" and {} more", more) : ""));
}

Status check_origins_finite(const std::string& file, const urdf::ModelInterface& model) {
  for (const auto& [name, joint] : model.joints_) {
    if (!to_eigen(joint->parent_to_joint_origin_transform).matrix().allFinite()) {
      return Error{fmt::format("{}: the origin of joint '{}' holds a number that is not finite", file, name)};
    }
  }
  return Done{};
}

/// Positions of the moving joints that are not on the chain.
class Locks {
 public:
  Locks(const std::string& file, const urdf::ModelInterface& model, const std::set<const urdf::Joint*>& chain,
        const std::map<std::string, double>& named)
      : file_(file), model_(model), chain_(chain), named_(named) {}

  /// The reason why a given name or value is not valid.
  Status check() const {
    for (const auto& [name, value] : named_) {
      const auto refuse = [&](const std::string& reason) {
        return Error{fmt::format("{}: locked joint '{}' {}", file_, name, reason)};
      };
      const urdf::JointConstSharedPtr joint = model_.getJoint(name);
      if (!joint) return refuse("is not a joint of the URDF; the movable joints outside the chain are: " + beside());
      if (!moves(*joint)) return refuse("is fixed");
      if (chain_.contains(joint.get()))
        return refuse("is on the chain to the tool; the movable joints outside it are: " + beside());
      const auto [low, high] = range(*joint);
      if (!(value >= low && value <= high))
        return refuse(fmt::format("is at {}; it goes from {} to {}", value, low, high));
    }
    return Done{};
  }
  /// Position of the joint, rad (m). Adds it to `assumed` if it was not given.
  double at(const urdf::Joint& joint, std::map<std::string, double>& assumed) const {
    if (const auto found = named_.find(joint.name); found != named_.end()) return found->second;
    const urdf::JointMimic* mimic = joint.mimic.get();
    const urdf::JointConstSharedPtr other = mimic ? model_.getJoint(mimic->joint_name) : nullptr;
    if (other && !chain_.contains(other.get()) && !other->mimic)
      return mimic->multiplier * at(*other, assumed) + mimic->offset;
    const auto [low, high] = range(joint);
    return assumed[joint.name] = std::clamp(0.0, low, high);
  }

 private:
  static std::pair<double, double> range(const urdf::Joint& joint) {
    const bool continuous = joint.type == urdf::Joint::CONTINUOUS && !has_range(joint);
    if (continuous || !joint.limits || !(joint.limits->lower <= joint.limits->upper))
      return {-kContinuousLimit, kContinuousLimit};
    return {joint.limits->lower, joint.limits->upper};
  }
  std::string beside() const {
    std::vector<std::string> names;
    for (const auto& [name, joint] : model_.joints_) {
      if (moves(*joint) && !chain_.contains(joint.get())) names.push_back(name);
    }
    return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
  }

  const std::string& file_;
  const urdf::ModelInterface& model_;
  const std::set<const urdf::Joint*>& chain_;
  const std::map<std::string, double>& named_;
};

/// Transform of a joint at a position `value`, rad (m).
Result<Eigen::Isometry3d> motion(const std::string& file, const urdf::Joint& joint, double value) {
  const Vector3 axis(joint.axis.x, joint.axis.y, joint.axis.z);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  if (value == 0.0) return X;
  const bool turns = joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS;
  if ((!turns && joint.type != urdf::Joint::PRISMATIC) || !(std::abs(axis.norm() - 1.0) <= kAxisTolerance)) {
    return Error{
        fmt::format("{}: joint '{}' ({}) can be at 0 only, not at {}", file, joint.name, type_name(joint), value)};
  }
  if (turns) {
    X.linear() = Eigen::AngleAxisd(value, axis.normalized()).toRotationMatrix();
  } else {
    X.translation() = value * axis.normalized();
  }
  return X;
}

/// Adds the frames of all links, and the positions assumed for joints that are not on the chain.
Status add_frames(const std::string& file, const urdf::ModelInterface& model, const Locks& locks,
                  const std::set<const urdf::Joint*>& on_chain, UrdfChain& chain) {
  for (const auto& [name, link] : model.links_) {
    UrdfChain::Frame frame;
    for (const urdf::Joint* joint : path_to(model, *link)) {
      if (on_chain.contains(joint) && moves(*joint)) {
        const auto moved = std::find(chain.link_names.begin(), chain.link_names.end(), joint->child_link_name);
        frame = {static_cast<int>(moved - chain.link_names.begin()), Eigen::Isometry3d::Identity()};
        continue;
      }
      frame.X_link_frame = frame.X_link_frame * to_eigen(joint->parent_to_joint_origin_transform);
      if (!moves(*joint)) continue;
      const Result<Eigen::Isometry3d> moved = motion(file, *joint, locks.at(*joint, chain.assumed));
      if (!moved) return moved.error();
      frame.X_link_frame = frame.X_link_frame * *moved;
    }
    chain.frames.emplace(name, frame);
  }
  return Done{};
}

/// The links that carry the tools.
Result<std::vector<const urdf::Link*>> find_tools(const std::string& file, const urdf::ModelInterface& model,
                                                  const std::vector<std::string>& names) {
  if (names.empty() || names == std::vector<std::string>{""}) return std::vector{arm_end(model)};
  std::vector<const urdf::Link*> tools;
  for (const std::string& name : names) {
    tools.push_back(model.getLink(name).get());
    if (tools.back() != nullptr) continue;
    std::vector<std::string> known;
    for (const auto& [link, pointer] : model.links_) known.push_back(link);
    return Error{fmt::format("{} has no link '{}' to carry the tool; {}", file, name, suggestion(name, known))};
  }
  return tools;
}

/// Adds the moving joints on the way to a tool that are not there yet.
Status add_way(const std::string& file, const std::vector<const urdf::Joint*>& way, UrdfChain& chain) {
  int parent = 0;
  Eigen::Isometry3d X_link_parent = Eigen::Isometry3d::Identity();
  for (const urdf::Joint* urdf_joint : way) {
    if (!moves(*urdf_joint)) {
      X_link_parent = X_link_parent * to_eigen(urdf_joint->parent_to_joint_origin_transform);
      continue;
    }
    const auto known = std::find(chain.link_names.begin(), chain.link_names.end(), urdf_joint->child_link_name);
    const int link = static_cast<int>(known - chain.link_names.begin());
    if (known == chain.link_names.end()) {
      Result<Joint> joint = read_joint(file, *urdf_joint, X_link_parent);
      if (!joint) return joint.error();
      if (parent != link - 1) joint->parent = parent;
      chain.joints.push_back(*joint);
      chain.limits.push_back(read_limits(*urdf_joint));
      chain.link_names.push_back(urdf_joint->child_link_name);
    }
    parent = link;
    X_link_parent.setIdentity();
  }
  return Done{};
}

/// Each tool must have a joint that moves it, and does not move another tool.
Status check_apart(const std::string& file, const UrdfChain& chain,
                   const std::vector<std::vector<const urdf::Joint*>>& ways) {
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const auto last = std::find_if(ways[i].rbegin(), ways[i].rend(), [](const auto* joint) { return moves(*joint); });
    if (last == ways[i].rend())
      return Error{fmt::format("{}: no joint moves link '{}', which is to carry a tool", file, chain.tool_links[i])};
    for (std::size_t k = 0; k < ways.size(); ++k) {
      if (k == i || std::find(ways[k].begin(), ways[k].end(), *last) == ways[k].end()) continue;
      return Error{fmt::format(
          "{}: the tools on links '{}' and '{}' are on one chain: every joint that moves the first moves the other; "
          "each must have a joint that moves it alone",
          file, chain.tool_links[i], chain.tool_links[k])};
    }
  }
  return Done{};
}

}  // namespace

Result<UrdfChain> read_urdf_chain(const std::filesystem::path& path, const std::vector<std::string>& tool_links,
                                  const std::map<std::string, double>& locked, Xacro xacro) {
  std::vector<UnreadElement> unread;
  const Result<urdf::ModelInterfaceSharedPtr> parsed = read_urdf(path, xacro, &unread);
  if (!parsed) return parsed.error();
  const urdf::ModelInterface& model = **parsed;
  const std::string file = path.string();
  if (Status status = check_origins_finite(file, model); !status) return status.error();

  const Result<std::vector<const urdf::Link*>> tools = find_tools(file, model, tool_links);
  if (!tools) return tools.error();
  UrdfChain chain;
  chain.robot_name = model.getName();
  chain.link_names = {model.getRoot()->name};
  std::vector<std::vector<const urdf::Joint*>> ways;
  std::set<const urdf::Joint*> on_chain;
  for (const urdf::Link* tool : *tools) {
    chain.tool_links.push_back(tool->name);
    ways.push_back(path_to(model, *tool));
    on_chain.insert(ways.back().begin(), ways.back().end());
    if (Status status = add_way(file, ways.back(), chain); !status) return status.error();
  }
  if (chain.joints.empty() || chain.joints.size() > static_cast<std::size_t>(kMaxJoints)) {
    return Error{fmt::format("{}: the chain from '{}' to '{}' has {} moving joints; an arm has 1 to {}", file,
                             chain.link_names[0], fmt::join(chain.tool_links, "' and '"), chain.joints.size(),
                             kMaxJoints)};
  }
  if (Status status = check_apart(file, chain, ways); !status) return status.error();
  note_unread(unread, chain);
  if (tool_links.empty() || tool_links[0].empty()) note_gripper(ways[0], chain);
  const Locks locks(file, model, on_chain, locked);
  if (Status status = locks.check(); !status) return status.error();
  if (Status status = add_frames(file, model, locks, on_chain, chain); !status) return status.error();
  return chain;
}

}  // namespace steadyhand

#include "steadyhand/geometry/robot/model_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

constexpr double kUnitTolerance = 1e-6;  ///< of axes and rotations, which loading normalises

bool is_rigid(const Eigen::Isometry3d& T) {
  return T.matrix().allFinite() && (T.linear() * T.linear().transpose()).isIdentity(kUnitTolerance) &&
         T.linear().determinant() > 0.0;
}

Status check_joints(const RobotModel& model) {
  const int n = model.dof();
  if (n < 1 || n > kMaxJoints) {
    return Error{fmt::format("robot '{}' has {} joints; it must have 1 to {}", model.name, n, kMaxJoints)};
  }
  for (int k = 0; k < n; ++k) {
    const Joint& joint = model.joints[k];
    if (model.parent(k) < 0 || model.parent(k) > k) {
      return Error{fmt::format("robot '{}': joint '{}' has parent link {}; it must be 0 to {}, a link before its own",
                               model.name, joint.name, joint.parent, k)};
    }
    if (!(std::abs(joint.axis.norm() - 1.0) <= kUnitTolerance)) {
      return Error{fmt::format("robot '{}': the axis of joint '{}' is [{}, {}, {}]; it must have length 1", model.name,
                               joint.name, joint.axis.x(), joint.axis.y(), joint.axis.z())};
    }
    if (!is_rigid(joint.origin)) {
      return Error{fmt::format("robot '{}': the origin of joint '{}' is no rotation and finite position", model.name,
                               joint.name)};
    }
  }
  if (!is_rigid(model.mount))
    return Error{fmt::format("robot '{}': the mount is no rotation and finite position", model.name)};
  if (static_cast<int>(model.link_names.size()) != n + 1) {
    return Error{fmt::format("robot '{}' has {} link_names; it must have {}, one more than joints", model.name,
                             model.link_names.size(), n + 1)};
  }
  return Done{};
}

Status check_tools(const RobotModel& model) {
  if (model.tools.empty() || model.tool_count() > kMaxTools) {
    return Error{
        fmt::format("robot '{}' has {} tools; it must have 1 to {}", model.name, model.tools.size(), kMaxTools)};
  }
  for (const Tool& tool : model.tools) {
    const std::string where = fmt::format("robot '{}': tool '{}'", model.name, tool.name);
    if (tool.link < 1 || tool.link > model.dof())
      return Error{fmt::format("{} is on link {}; the links that move are 1 to {}", where, tool.link, model.dof())};
    if (!is_rigid(tool.origin)) return Error{where + " has an origin that is no rotation and finite position"};
    for (const Tool& other : model.tools) {
      if (&other == &tool) continue;
      if (other.name == tool.name)
        return Error{
            fmt::format("robot '{}': two tools are called '{}'; each needs another name", model.name, tool.name)};
      const std::vector<int> chain = model.chain(other.link);
      if (std::find(chain.begin(), chain.end(), tool.link - 1) == chain.end()) continue;
      return Error{fmt::format("{} and tool '{}' are on one chain; each must have a joint that moves it alone", where,
                               other.name)};
    }
  }
  return Done{};
}

Status check_numbers(const RobotModel& model) {
  const std::pair<const char*, const JointVector&> all[] = {{"home", model.home},
                                                            {"position_min", model.position_min},
                                                            {"position_max", model.position_max},
                                                            {"velocity_max", model.velocity_max},
                                                            {"acceleration_max", model.acceleration_max}};
  for (const auto& [key, values] : all) {
    if (values.size() == model.dof() && values.allFinite()) continue;
    return Error{
        fmt::format("robot '{}': {} must be {} finite numbers, one for each joint", model.name, key, model.dof())};
  }
  for (int k = 0; k < model.dof(); ++k) {
    const std::string where = fmt::format("robot '{}': joint '{}'", model.name, model.joints[k].name);
    if (!(model.position_min[k] < model.position_max[k])) {
      return Error{fmt::format("{} may move from {} to {}; the lower limit must be below the upper one", where,
                               model.position_min[k], model.position_max[k])};
    }
    if (!(model.velocity_max[k] > 0.0) || !(model.acceleration_max[k] > 0.0)) {
      return Error{fmt::format("{} has velocity_max {} and acceleration_max {}; both must be positive", where,
                               model.velocity_max[k], model.acceleration_max[k])};
    }
  }
  return Done{};
}

Status check_bodies(const RobotModel& model) {
  if (model.bodies.size() > kMaxBodies) {
    return Error{
        fmt::format("robot '{}': {} bodies; an arm has at most {}", model.name, model.bodies.size(), kMaxBodies)};
  }
  for (const Body& body : model.bodies) {
    const std::string where = fmt::format("robot '{}': body '{}'", model.name, body.name);
    if (body.link < 0 || body.link > model.dof()) {
      return Error{fmt::format("{} is on link {}; the links are 0 to {}", where, body.link, model.dof())};
    }
    if (body.shape.kind == ShapeKind::kHalfSpace) return Error{where + " is a half_space, which only a cell can have"};
    if (const Status s = check(body.shape); !s) return Error{where + ": " + s.error().message};
    if (!is_rigid(body.origin)) return Error{where + " must have a finite origin whose orientation is a rotation"};
  }
  const int count = static_cast<int>(model.bodies.size());
  for (const auto& [first, second] : model.pairs) {
    const bool exist = first >= 0 && first < count && second >= 0 && second < count;
    if (exist && model.bodies[first].link < model.bodies[second].link) continue;
    return Error{fmt::format("robot '{}': the pair ({}, {}) must be two of its {} bodies, the first on a lower link",
                             model.name, first, second, count)};
  }
  return Done{};
}

}  // namespace

Status check(const RobotModel& model) {
  if (Status s = check_joints(model); !s) return s;
  if (Status s = check_tools(model); !s) return s;
  if (Status s = check_numbers(model); !s) return s;
  return check_bodies(model);
}

}  // namespace steadyhand

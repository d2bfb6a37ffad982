#include "steadyhand/geometry/robot/cell.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "steadyhand/core/text.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"

namespace steadyhand {

namespace {

/// Lets bodies of this name, or on a link of this name, and the object of this name if it is carried, touch obstacle
/// `index`; false if there are none.
bool ignore(const RobotModel& model, const Cell& cell, const std::string& name, int index, Obstacles& obstacles) {
  Obstacle& obstacle = obstacles.list[index];
  bool found = std::count(model.link_names.begin(), model.link_names.end(), name) > 0;
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.name != name && model.link_names[body.link] != name) continue;
    obstacle.ignores.set(i);
    found = true;
  }
  for (int other = 0; other < std::ssize(cell.objects); ++other) {
    if (other == index || cell.objects[other].name != name) continue;
    obstacle.ignores.set(solid_of(other));
    obstacles.list[other].ignores.set(solid_of(index));
    found = true;
  }
  return found;
}

/// s, until what moves is as far away as an object may be; infinite if it stands.
double leaves_after(const CellObject& object) {
  constexpr double kEnd = (1.0 - 1e-9) * Obstacles::kFarthest;  // m, less rounding
  const Vector3& p = object.origin.translation();
  const double a = object.velocity.squaredNorm(), b = p.dot(object.velocity);
  const double c = p.squaredNorm() - kEnd * kEnd;
  if (!(a > 0.0)) return std::numeric_limits<double>::infinity();
  return c < 0.0 ? (std::sqrt(b * b - a * c) - b) / a : 0.0;
}

}  // namespace

Cell in_base(Cell cell, const RobotModel& model) {
  for (CellObject& object : cell.objects) {
    if (!object.in_root || object.attached) continue;
    object.origin = model.mount * object.origin;
    object.velocity = model.mount.linear() * object.velocity;
    object.in_root = false;
  }
  return cell;
}

Cell cell_after(Cell cell, double t) {
  for (CellObject& object : cell.objects) {
    if (object.attached) continue;
    const double left = leaves_after(object);
    object.origin.pretranslate(std::min(t, left) * object.velocity);
    if (t >= left) object.velocity.setZero();
  }
  return cell;
}

namespace {

/// The object of this name, if the tool carries it, or does not, as `attached` says.
Result<CellObject*> find(Cell& cell, const std::string& name, bool attached) {
  const auto object = std::find_if(cell.objects.begin(), cell.objects.end(),
                                   [&](const CellObject& candidate) { return candidate.name == name; });
  if (object == cell.objects.end()) return Error{fmt::format("there is no object '{}'", name)};
  if (object->attached != attached)
    return Error{fmt::format("object '{}' is {}carried by the tool", name, attached ? "not " : "already ")};
  return &*object;
}

Eigen::Isometry3d tool_pose(const Kinematics& arm, int tool) {
  return Eigen::Translation3d(arm.p(tool)) * Eigen::Isometry3d(Quaternion(arm.R(tool)));
}

}  // namespace

Status check_carried(const Cell& cell, const Kinematics& arm) {
  constexpr double kOverlap = 2e-3;  // m
  const Result<Obstacles> obstacles = obstacles_of(cell, arm.model());
  if (!obstacles) return obstacles.error();
  for (int i = 0; i < obstacles->count; ++i) {
    if (!obstacles->list[i].carried) continue;
    const auto [body, distance] = nearest_body(arm, *obstacles, i, 0.0);
    if (distance >= -kOverlap) continue;
    const std::string other = body < kMaxBodies ? arm.model().bodies[body].name
                                                : fmt::format("object '{}'", cell.objects[body - kMaxBodies].name);
    return Error{fmt::format("object '{}' overlaps {} by {:.1f} mm, which must not touch it", cell.objects[i].name,
                             other, -1e3 * distance)};
  }
  return Done{};
}

Result<Cell> attach(Cell cell, const std::string& name, const Kinematics& arm, int tool) {
  cell = in_base(std::move(cell), arm.model());
  const Result<CellObject*> found = find(cell, name, false);
  if (!found) return found.error();
  CellObject& object = **found;
  if (object.holds_only_tool) return Error{fmt::format("object '{}' keeps the tool in, and cannot be carried", name)};
  object.origin = tool_pose(arm, tool).inverse() * object.origin;
  object.tool = tool;
  object.velocity.setZero();
  object.attached = true;
  if (Status s = check_carried(cell, arm); !s) return s.error();
  return cell;
}

Result<Cell> detach(Cell cell, const std::string& name, const Kinematics& arm) {
  const Result<CellObject*> found = find(cell, name, true);
  if (!found) return found.error();
  CellObject& object = **found;
  object.origin = tool_pose(arm, object.tool) * object.origin;
  object.attached = false;
  object.in_root = false;
  return cell;
}

Result<Cell> without(Cell cell, const std::string& name) {
  if (std::erase_if(cell.objects, [&](const CellObject& object) { return object.name == name; }) == 0)
    return Error{fmt::format("there is no object '{}'", name)};
  for (CellObject& object : cell.objects) std::erase(object.may_be_touched_by, name);
  return cell;
}

Result<Obstacles> obstacles_of(const Cell& given, const RobotModel& model) {
  const Cell cell = in_base(given, model);
  const auto refuse = [&](const std::string& reason) { return Error{fmt::format("cell '{}': {}", cell.name, reason)}; };
  if (std::ssize(cell.objects) > Obstacles::kMost) {
    return refuse(fmt::format("{} objects; there may be at most {}", cell.objects.size(), Obstacles::kMost));
  }
  Obstacles obstacles;
  std::set<std::string> names;
  for (const CellObject& object : cell.objects) {
    const auto refuse_object = [&](const std::string& reason) {
      return refuse(fmt::format("object '{}': {}", object.name, reason));
    };
    if (!is_name(object.name)) return refuse("an object has no name, or one with control characters");
    if (!names.insert(object.name).second) return refuse_object("there are two of this name");
    if (!(object.margin >= 0.0 && object.margin <= 1.0)) {
      return refuse_object(fmt::format("the margin is {} m; it must be from 0 to 1", object.margin));
    }
    if (const Status status = check(object.shape); !status) return refuse_object(status.error().message);
    Obstacle& obstacle = obstacles.list[obstacles.count++];
    if (object.attached && (object.tool < 0 || object.tool >= model.tool_count()))
      return refuse_object(
          fmt::format("tool {} carries it; the tools are 0 to {}", object.tool, model.tool_count() - 1));
    obstacle.carried = object.attached;
    obstacle.tool = object.attached ? object.tool : 0;
    obstacle.margin = object.attached ? 0.0 : object.margin;
    obstacle.shape = object.shape.inflated(obstacle.margin);
    obstacle.velocity = object.velocity;
    obstacle.at = {object.origin.translation(), object.origin.linear()};
    if (const Status status = check(obstacle); !status) return refuse_object(status.error().message);
    if (object.holds_only_tool) {
      for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const auto carries = [&](const Tool& tool) { return tool.link == model.bodies[i].link; };
        if (std::none_of(model.tools.begin(), model.tools.end(), carries)) obstacle.ignores.set(i);
      }
    }
  }
  for (int i = 0; i < obstacles.count; ++i) {
    for (const std::string& name : cell.objects[i].may_be_touched_by) {
      if (ignore(model, cell, name, i, obstacles)) continue;
      return refuse(
          fmt::format("object '{}': robot '{}' has no body or link '{}', and the cell no other object of that name",
                      cell.objects[i].name, model.name, name));
    }
  }
  if (const Status status = check(obstacles); !status) return refuse(status.error().message);
  return obstacles;
}

}  // namespace steadyhand

#include "steadyhand/robot/cell.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace steadyhand {

namespace {

/// Lets bodies of this name, or on a link of this name, touch the obstacle; false if there are none.
bool ignore(const RobotModel& model, const std::string& name, Obstacle& obstacle) {
  bool found = std::count(model.link_names.begin(), model.link_names.end(), name) > 0;
  for (std::size_t i = 0; i < model.bodies.size(); ++i) {
    const Body& body = model.bodies[i];
    if (body.name != name && model.link_names[body.link] != name) continue;
    obstacle.ignores.set(i);
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
    if (!object.in_root) continue;
    object.origin = model.mount * object.origin;
    object.velocity = model.mount.linear() * object.velocity;
    object.in_root = false;
  }
  return cell;
}

Cell cell_after(Cell cell, double t) {
  for (CellObject& object : cell.objects) {
    const double left = leaves_after(object);
    object.origin.pretranslate(std::min(t, left) * object.velocity);
    if (t >= left) object.velocity.setZero();
  }
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
    if (object.name.empty()) return refuse("an object has no name");
    if (!names.insert(object.name).second) return refuse_object("there are two of this name");
    if (!(object.margin >= 0.0 && object.margin <= 1.0)) {
      return refuse_object(fmt::format("the margin is {} m; it must be from 0 to 1", object.margin));
    }
    if (const Status status = check(object.shape); !status) return refuse_object(status.error().message);
    Obstacle& obstacle = obstacles.list[obstacles.count++];
    obstacle.shape = object.shape.inflated(object.margin);
    obstacle.velocity = object.velocity;
    obstacle.margin = object.margin;
    obstacle.at = {object.origin.translation(), object.origin.linear()};
    if (const Status status = check(obstacle); !status) return refuse_object(status.error().message);
    if (object.holds_only_tool) {
      for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (model.bodies[i].link != model.dof()) obstacle.ignores.set(i);
      }
    }
    for (const std::string& name : object.may_be_touched_by) {
      if (!ignore(model, name, obstacle)) {
        return refuse_object(fmt::format("robot '{}' has no body or link '{}'", model.name, name));
      }
    }
  }
  return obstacles;
}

}  // namespace steadyhand

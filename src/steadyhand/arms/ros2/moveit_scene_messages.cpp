#include "steadyhand/arms/ros2/moveit_scene_messages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "steadyhand/core/text.hpp"

namespace steadyhand {

namespace {

constexpr double kNormSlack = 1e-3;  ///< by which the norm of a quaternion may be off

/// shape_msgs/SolidPrimitive
enum class Primitive : std::uint8_t { kBox = 1, kSphere = 2, kCylinder = 3, kCone = 4 };

template <typename Sequence>
auto elements(const Sequence& sequence) {
  return std::span(sequence._buffer, sequence._length);
}

/// An error in the message of one object.
struct Wrong {
  std::string reason;
};

Eigen::Isometry3d read_pose(const geometry_msgs_msg_dds__Pose_& message) {
  const auto& [p, q] = message;
  const Vector3 position(p.x, p.y, p.z);
  Quaternion orientation(q.w, q.x, q.y, q.z);
  if (orientation.coeffs().isZero(0.0)) orientation.setIdentity();
  if (!position.allFinite()) throw Wrong{"has a position that is not finite"};
  if (!(std::abs(orientation.norm() - 1.0) < kNormSlack)) throw Wrong{"has an orientation that is no unit quaternion"};
  return Eigen::Translation3d(position) * orientation.normalized();
}

Shape read_primitive(const shape_msgs_msg_dds__SolidPrimitive_& message) {
  const auto sizes = elements(message.dimensions);
  const auto take = [&](std::size_t count, const char* kind) {
    if (sizes.size() != count) {
      throw Wrong{fmt::format("has a {} with {} dimensions; it has {}", kind, sizes.size(), count)};
    }
  };
  switch (static_cast<Primitive>(message.type)) {
    case Primitive::kBox:
      take(3, "box");
      return Shape::box(0.5 * Vector3(sizes[0], sizes[1], sizes[2]));
    case Primitive::kSphere:
      take(1, "sphere");
      return Shape::sphere(sizes[0]);
    case Primitive::kCylinder:
      take(2, "cylinder");
      return Shape::cylinder(sizes[1], 0.5 * sizes[0]);
    case Primitive::kCone:
      take(2, "cone");
      return Shape::cylinder(sizes[1], 0.5 * sizes[0]);
    default:
      throw Wrong{fmt::format(
          "has a primitive of type {}; boxes (1), spheres (2), cylinders (3) and cones (4) are read", message.type)};
  }
}

SceneObject read_object(const CollisionObjectMessage& message) {
  SceneObject object;
  object.id = message.id;
  object.frame = message.header.frame_id;
  if (!object.frame.empty() && !is_name(object.frame)) throw Wrong{"has a frame with control characters"};
  if (message.operation > 3) throw Wrong{fmt::format("has operation {}; it is from 0 to 3", message.operation)};
  object.operation = static_cast<SceneObject::Operation>(message.operation);
  if (object.operation == SceneObject::Operation::kRemove) return object;
  if (object.id.empty()) throw Wrong{"has no id"};
  if (message.meshes._length > 0) throw Wrong{"has a mesh; meshes are not read"};
  if (message.planes._length > 0) throw Wrong{"has a plane; planes are not read"};
  object.pose = read_pose(message.pose);
  const auto shapes = elements(message.primitives);
  const auto poses = elements(message.primitive_poses);
  if (poses.size() > shapes.size()) {
    throw Wrong{fmt::format("has {} primitive_poses for {} primitives", poses.size(), shapes.size())};
  }
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    CellObject& part = object.parts.emplace_back();
    part.name = i == 0 ? object.id : fmt::format("{}/{}", object.id, i + 1);
    part.shape = read_primitive(shapes[i]);
    if (const Status good = check(part.shape); !good) throw Wrong{good.error().message};
    part.origin = i < poses.size() ? read_pose(poses[i]) : Eigen::Isometry3d::Identity();
  }
  return object;
}

SceneObject read_attached(const AttachedObjectMessage& message) {
  SceneObject object = read_object(message.object);
  object.attached = true;
  object.link = message.link_name;
  if (!object.link.empty() && !is_name(object.link)) throw Wrong{"has a link with control characters"};
  for (const char* link : elements(message.touch_links)) object.touch_links.emplace_back(link);
  return object;
}

/// Calls `read`, and puts the object's id before the error.
template <typename Message, typename Read>
SceneObject named(const Message& message, const char* id, const Read& read) {
  if (*id != '\0' && !is_name(id)) throw Wrong{"an object has an id with control characters"};
  try {
    return read(message);
  } catch (const Wrong& wrong) {
    throw Wrong{fmt::format("object '{}' {}", id, wrong.reason)};
  }
}

template <typename Make>
Result<SceneChange> change_of(const Make& make) {
  SceneChange change;
  try {
    make(change);
  } catch (const Wrong& wrong) {
    return Error{wrong.reason};
  }
  return change;
}

std::string hex(const std_msgs_msg_dds__ColorRGBA_& color) {
  const auto byte = [](float share) { return static_cast<int>(std::lround(255.0F * std::clamp(share, 0.0F, 1.0F))); };
  if (!std::isfinite(color.r + color.g + color.b)) return {};
  return fmt::format("#{:02x}{:02x}{:02x}", byte(color.r), byte(color.g), byte(color.b));
}

/// Whether it is a part of the object with this id.
bool is_part(const CellObject& object, const std::string& id) {
  return object.name == id || object.name.starts_with(id + "/");
}

/// Names of the object's parts in the cell.
std::vector<std::string> parts_of(const Cell& cell, const std::string& id) {
  std::vector<std::string> names;
  for (const CellObject& each : cell.objects) {
    if (is_part(each, id)) names.push_back(each.name);
  }
  return names;
}

Error refusal(const SceneObject& object, const std::string& reason) {
  return Error{fmt::format("object '{}': {}", object.id, reason)};
}

/// attach() or detach(), of each of these.
template <typename Act>
Result<Cell> for_each_name(const std::vector<std::string>& names, Result<Cell> cell, const Act& act,
                           const Kinematics& arm) {
  for (std::size_t i = 0; cell && i < names.size(); ++i) cell = act(*std::move(cell), names[i], arm);
  return cell;
}

/// The tool releases this object, or all if no object is named.
Result<Cell> release(const SceneObject& object, Cell cell, const Kinematics& arm) {
  std::vector<std::string> names;
  for (const CellObject& each : cell.objects) {
    if (object.id.empty() ? each.attached : is_part(each, object.id)) names.push_back(each.name);
  }
  if (names.empty() && !object.id.empty()) return refusal(object, "there is none");
  return for_each_name(names, std::move(cell), detach, arm);
}

}  // namespace

Result<SceneChange> read(const CollisionObjectMessage& message) {
  return change_of([&](SceneChange& change) { change.objects.push_back(named(message, message.id, read_object)); });
}

Result<SceneChange> read(const AttachedObjectMessage& message) {
  return change_of(
      [&](SceneChange& change) { change.objects.push_back(named(message, message.object.id, read_attached)); });
}

Result<SceneChange> read(const PlanningSceneMessage& message) {
  return change_of([&](SceneChange& change) {
    change.replaces = !message.is_diff;
    if (message.world.octomap.octomap.data._length > 0) throw Wrong{"a scene has an octomap; voxels are not read"};
    for (const auto& object : elements(message.world.collision_objects)) {
      change.objects.push_back(named(object, object.id, read_object));
    }
    for (const auto& object : elements(message.robot_state.attached_collision_objects)) {
      change.objects.push_back(named(object, object.object.id, read_attached));
    }
    for (const auto& told : elements(message.object_colors)) {
      for (SceneObject& object : change.objects) {
        if (object.id == told.id) object.color = hex(told.color);
      }
    }
  });
}

std::string SceneKeeper::link_name(const std::string& name) const {
  return name.starts_with(prefix_) ? name.substr(prefix_.size()) : name;
}

/// The frame in the base.
Result<Eigen::Isometry3d> SceneKeeper::in_base(const std::string& frame, const Kinematics& arm) const {
  const std::string name = link_name(frame);
  const Eigen::Isometry3d tool = Eigen::Translation3d(arm.p()) * Eigen::Isometry3d(Quaternion(arm.R()));
  if (name.empty() || name == model_->link_names.front()) return model_->mount;
  if (name == model_->link_names.back()) return tool * model_->tool().origin.inverse();
  if (name == model_->tool().name) return tool;
  return Error{fmt::format("frame '{}' is none of {}, {} and {}", frame, prefix_ + model_->link_names.front(),
                           prefix_ + model_->link_names.back(), prefix_ + model_->tool().name)};
}

Result<Cell> SceneKeeper::apply(const SceneChange& change, Cell given, const Kinematics& arm) {
  Result<Cell> cell = std::move(given);
  const auto before = parts_;
  if (change.replaces) {
    std::erase_if(cell->objects, [&](const CellObject& object) {
      return std::any_of(parts_.begin(), parts_.end(), [&](const auto& known) { return is_part(object, known.first); });
    });
    parts_.clear();
  }
  for (const SceneObject& object : change.objects) {
    cell = apply(object, *std::move(cell), arm);
    if (!cell || cell->objects.size() > Obstacles::kMost) break;
  }
  if (cell) {
    if (const Result<Obstacles> obstacles = obstacles_of(*cell, *model_); !obstacles) cell = obstacles.error();
  }
  if (!cell) parts_ = before;
  return cell;
}

Result<Cell> SceneKeeper::apply(const SceneObject& object, Cell cell, const Kinematics& arm) {
  const bool removes = object.operation == SceneObject::Operation::kRemove;
  if (object.attached && removes) return release(object, std::move(cell), arm);
  const auto is_carried = [&](const CellObject& each) { return is_part(each, object.id) && each.attached; };
  if (!object.attached && std::any_of(cell.objects.begin(), cell.objects.end(), is_carried)) {
    return refusal(object, "it is carried by the tool; detach it first");
  }
  if (removes) return remove(object, std::move(cell));
  const Result<Eigen::Isometry3d> frame = in_base(object.frame, arm);
  if (!frame) return refusal(object, frame.error().message);
  const Eigen::Isometry3d pose = *frame * object.pose;
  if (object.operation == SceneObject::Operation::kMove) return move(object, pose, std::move(cell));
  if (!object.parts.empty()) {
    add(object, pose, cell);
  } else if (!object.attached) {
    return refusal(object, "it has no shape");
  }
  return object.attached ? take_up(object, std::move(cell), arm) : cell;
}

Result<Cell> SceneKeeper::remove(const SceneObject& object, Cell cell) {
  if (object.id.empty()) {  // objects from other sources, and carried ones, stay
    std::erase_if(cell.objects, [&](const CellObject& each) {
      const auto mine = [&](const auto& known) { return is_part(each, known.first); };
      return !each.attached && std::any_of(parts_.begin(), parts_.end(), mine);
    });
    std::erase_if(parts_, [&](const auto& known) { return parts_of(cell, known.first).empty(); });
    return cell;
  }
  const std::vector<std::string> names = parts_of(cell, object.id);
  if (names.empty()) return refusal(object, "there is none to remove");
  for (const std::string& name : names) cell = *without(std::move(cell), name);
  parts_.erase(object.id);
  return cell;
}

Result<Cell> SceneKeeper::move(const SceneObject& object, const Eigen::Isometry3d& pose, Cell cell) {
  const auto known = parts_.find(object.id);
  if (known == parts_.end() || known->second.size() != parts_of(cell, object.id).size()) {
    return refusal(object, "there is none to move");
  }
  auto origin = known->second.begin();
  for (CellObject& part : cell.objects) {
    if (!is_part(part, object.id)) continue;
    part.origin = pose * *origin++;
    part.in_root = false;
  }
  return cell;
}

void SceneKeeper::add(const SceneObject& object, const Eigen::Isometry3d& pose, Cell& cell) {
  std::vector<Eigen::Isometry3d>& origins = parts_[object.id];
  if (object.operation == SceneObject::Operation::kAdd) {
    std::erase_if(cell.objects, [&](const CellObject& each) { return is_part(each, object.id); });
    origins.clear();
  }
  std::size_t count = parts_of(cell, object.id).size();
  for (CellObject part : object.parts) {
    origins.push_back(part.origin);
    part.name = count == 0 ? object.id : fmt::format("{}/{}", object.id, count + 1);
    part.origin = pose * part.origin;
    part.color = object.color;
    cell.objects.push_back(std::move(part));
    ++count;
  }
}

Result<Cell> SceneKeeper::take_up(const SceneObject& object, Cell cell, const Kinematics& arm) const {
  const std::vector<std::string>& links = model_->link_names;
  if (const std::string link = link_name(object.link); link != links.back() && link != model_->tool().name) {
    return refusal(object, fmt::format("link '{}' cannot carry it; {} can", object.link, prefix_ + links.back()));
  }
  const std::vector<std::string> names = parts_of(cell, object.id);
  if (names.empty()) return refusal(object, "there is none to attach");
  for (CellObject& each : cell.objects) {
    if (!is_part(each, object.id)) continue;
    for (const std::string& link : object.touch_links) {
      if (std::count(links.begin(), links.end(), link_name(link)) > 0) {
        each.may_be_touched_by.push_back(link_name(link));
      }
    }
  }
  const auto to_first_tool = [](Cell changed, const std::string& name, const Kinematics& at) {
    return attach(std::move(changed), name, at);
  };
  return for_each_name(names, std::move(cell), to_first_tool, arm);
}

}  // namespace steadyhand

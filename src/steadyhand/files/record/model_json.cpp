#include "steadyhand/files/record/model_json.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <type_traits>
#include <vector>

#include "steadyhand/core/json_in.hpp"
#include "steadyhand/files/record/message_style.hpp"
#include "steadyhand/geometry/collision/shape_names.hpp"
#include "steadyhand/geometry/robot/model_check.hpp"

namespace steadyhand {

constexpr auto names_of(JointType) {
  return named("JointType", {Name{JointType::kRevolute, "revolute"}, Name{JointType::kPrismatic, "prismatic"}});
}

namespace {

using Rows = std::array<std::array<double, 4>, 4>;

/// Poses as four rows of four numbers; numbers as nlohmann's library has them, whole ones with ".0".
struct DocumentStyle : FileStyle {
  template <std::same_as<double> Number>
  static void write(JsonWriter& json, const Number& number, const Limits&) {
    json.raw(OrderedJson(number).dump());
  }
  template <typename Derived>
  static void write(JsonWriter& json, const Eigen::MatrixBase<Derived>& numbers, const Limits& limits) {
    json.begin_array();
    for (Eigen::Index i = 0; i < numbers.size(); ++i) write(json, double(numbers.derived()[i]), limits);
    json.end_array();
  }
  static Rows form_of(const Eigen::Isometry3d& X) {
    Rows rows;
    for (int i = 0; i < 4; ++i) std::copy_n(Eigen::Vector4d(X.matrix().row(i)).data(), 4, rows[i].begin());
    return rows;
  }
  static Eigen::Isometry3d from_form(const Rows& rows, std::type_identity<Eigen::Isometry3d>) {
    Eigen::Isometry3d X;
    for (int i = 0; i < 4; ++i) X.matrix().row(i) = Eigen::Map<const Eigen::RowVector4d>(rows[i].data());
    return X;
  }
};

template <typename V>
void check_pose(V& v, std::string_view name, const Eigen::Isometry3d& X) {
  const Matrix3 R = X.linear();
  v.check(
      (R * R.transpose() - Matrix3::Identity()).norm() <= 1e-6 && R.determinant() > 0.0 &&
          X.matrix().row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0),
      fmt::format("'{}' is no pose: its rows must be a rotation matrix with the position behind it, and [0, 0, 0, 1]",
                  name));
}

/// A shape where it is. In place of others' members.
template <typename V>
void describe_solid(V& v, Shape& shape, Eigen::Isometry3d& origin) {
  v.choose("shape", "", shape.kind, [&](ShapeKind kind) {
    Eigen::Isometry3d at = origin;  // a half-space has no sizes: what it has grown by, its origin tells
    if (kind == ShapeKind::kHalfSpace) at = at * Eigen::Translation3d(0.0, 0.0, shape.radius);
    v.add("origin", "", "", at);
    double radius = kind == ShapeKind::kCylinder ? shape.core.x() : shape.radius, length = 2.0 * shape.core.z();
    Vector3 size = 2.0 * shape.core + Vector3::Constant(2.0 * radius);
    if (kind == ShapeKind::kBox) v.add("size", "m", "", size);
    if (kind == ShapeKind::kCapsule || kind == ShapeKind::kCylinder) v.add("length", "m", "", length);
    if (kind != ShapeKind::kHalfSpace) v.add(kind == ShapeKind::kBox ? "rounding" : "radius", "m", "", radius);
    if constexpr (kReads<V>) {
      origin = at;
      check_pose(v, "origin", at);
      shape = kind == ShapeKind::kSphere     ? Shape::sphere(radius)
              : kind == ShapeKind::kCapsule  ? Shape::capsule(0.5 * length, radius)
              : kind == ShapeKind::kCylinder ? Shape::cylinder(radius, 0.5 * length)
              : kind == ShapeKind::kBox      ? Shape::box(0.5 * size - Vector3::Constant(radius), radius)
                                             : Shape::half_space();
      if (const Status status = check(shape); !status) v.fail(status.error().message);
    }
  });
}

}  // namespace

struct SolidNote {
  Shape shape;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();
};
template <typename V>
void describe(V& v, SolidNote& solid) {
  describe_solid(v, solid.shape, solid.origin);
}

// ---- cells

template <typename V>
void describe(V& v, CellObject& object) {
  v.add("name", "", "for people", object.name);
  describe_solid(v, object.shape, object.origin);
  v.add("velocity", "m/s", "", object.velocity);
  v.add("margin", "m", "kept around it", object.margin);
  v.add("color", "", "", object.color);
  v.add("holds_only_tool", "", "all but the bodies on the tool's link may touch it", object.holds_only_tool);
  v.add("attached", "", "the tool carries it, and origin is in the tool's frame", object.attached, kOrAbsent);
  v.add("may_be_touched_by", "", "", object.may_be_touched_by, kOrAbsent);
}

struct CellNote {
  Cell cell;
  std::optional<double> at_s;
};
template <typename V>
void describe(V& v, CellNote& note) {
  v.add("name", "", "for people", note.cell.name);
  v.add("at_s", "s", "when its objects are where they say", note.at_s);
  v.add("objects", "", "", note.cell.objects);
}

// ---- robots

template <typename V>
void describe(V& v, Joint& joint) {
  v.add("name", "", "", joint.name);
  v.add("type", "", "", joint.type);
  v.add("origin", "", "", joint.origin);
  v.add("axis", "", "", joint.axis);
  check_pose(v, "origin", joint.origin);
}
template <typename V>
void describe(V& v, Tool& tool) {
  v.add("name", "", "", tool.name);
  v.add("origin", "", "", tool.origin);
  check_pose(v, "origin", tool.origin);
}
template <typename V>
void describe(V& v, Body& body) {
  v.add("name", "", "", body.name);
  v.add("link", "", "", body.link);
  describe_solid(v, body.shape, body.origin);
}
struct SphereNote {
  std::string name;
  int link = 0;
  Vector3 center;
  double radius = 0.0;
};
template <typename V>
void describe(V& v, SphereNote& sphere) {
  v.add("name", "", "", sphere.name);
  v.add("link", "", "", sphere.link);
  v.add("center", "m", "", sphere.center);
  v.add("radius", "m", "", sphere.radius);
}
struct GripperNote {
  double closes_in = 0.0;
};
template <typename V>
void describe(V& v, GripperNote& gripper) {
  v.add("closes_in", "s", "", gripper.closes_in);
}

/// Of arms that are covered by spheres alone.
static std::vector<SphereNote> spheres_of(const RobotModel& model) {
  std::vector<SphereNote> spheres;
  for (const Body& body : model.bodies) {
    if (body.shape.kind != ShapeKind::kSphere) return {};
    spheres.push_back({body.name, body.link, body.origin.translation(), body.shape.radius});
  }
  return spheres;
}

/// The object of "Two commands that make this checkable" in docs/explanation/formulation.md.
template <typename V>
void describe(V& v, RobotModel& model) {
  std::vector<std::array<int, 2>> pairs;
  for (const auto& [first, second] : model.pairs) pairs.push_back({first, second});
  std::string meshes = model.meshes == model.name ? "" : model.meshes;
  std::optional<GripperNote> gripper;
  if (model.gripper_time) gripper = GripperNote{*model.gripper_time};
  std::optional<Eigen::Isometry3d> mount;
  if (!model.mount.matrix().isIdentity(0.0)) mount = model.mount;
  v.add("name", "", "", model.name);
  v.add("joints", "", "", model.joints, sized(1, kMaxJoints));
  v.add("tool", "", "", model.tool);
  v.add("home", "rad (m)", "", model.home);
  v.add("position_min", "rad (m)", "", model.position_min);
  v.add("position_max", "rad (m)", "", model.position_max);
  v.add("velocity_max", "rad/s (m/s)", "", model.velocity_max);
  v.add("acceleration_max", "rad/s^2 (m/s^2)", "", model.acceleration_max);
  if constexpr (!kReads<V>) {
    std::vector<SphereNote> spheres = spheres_of(model);
    v.add("spheres", "", "of arms that have no other bodies", spheres);
  }
  v.add("bodies", "", "", model.bodies);
  v.add("pairs", "", "of indices of bodies", pairs);
  v.add("meshes", "", "whose the page draws, where they are not its own", meshes, kOrAbsent);
  v.add("gripper", "", "", gripper);
  v.add("mount", "", "of the root in the base", mount);
  if constexpr (kReads<V>) {
    model.meshes = meshes.empty() ? model.name : meshes;
    if (gripper) model.gripper_time = gripper->closes_in;
    if (mount) model.mount = *mount;
    check_pose(v, "mount", model.mount);
    for (const auto& [first, second] : pairs) model.pairs.emplace_back(first, second);
  }
}

namespace {

template <typename T>
std::string written(const T& value) {
  std::string text;
  JsonOut<DocumentStyle>(text).put(value);
  return text;
}

template <typename T>
void read(const OrderedJson& json, const std::string& key, T& into) {
  JsonIn<OrderedJson, DocumentStyle> in(json, false);
  in.members(into);
  if (in.error()) json::fail(key, in.error()->message);
}

}  // namespace

OrderedJson shape_json(const Shape& shape, const Eigen::Isometry3d& origin) {
  return OrderedJson::parse(written(SolidNote{shape, origin}));
}

Eigen::Isometry3d read_shape_json(const OrderedJson& object, const std::string& key, Shape& shape) {
  SolidNote solid;
  read(object, key, solid);
  shape = solid.shape;
  return solid.origin;
}

std::string cell_json(const Cell& cell, std::optional<Time> at) {
  return written(CellNote{cell, at ? std::optional(to_seconds(*at)) : std::nullopt});
}

Cell read_cell_json(const OrderedJson& json, const std::string& key) {
  CellNote note;
  read(json, key, note);
  return note.cell;
}

std::string robot_json(const RobotModel& model, int indent) {
  const std::string line = written(model);
  return indent < 0 ? line : OrderedJson::parse(line).dump(indent);
}

RobotModel read_robot_json(const OrderedJson& json, const std::string& key) {
  RobotModel model;
  read(json, key, model);
  model.link_names.emplace_back("base");
  for (const Joint& joint : model.joints) model.link_names.push_back(joint.name);
  if (const Status status = check(model); !status) json::fail(key, status.error().message);
  return model;
}

}  // namespace steadyhand

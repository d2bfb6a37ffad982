#include "steadyhand/files/record/model_json.hpp"

#include <array>
#include <vector>

#include "steadyhand/files/record/document_style.hpp"
#include "steadyhand/geometry/robot/model_check.hpp"

namespace steadyhand {

constexpr auto names_of(JointType) {
  return named("JointType", {Name{JointType::kRevolute, "revolute"}, Name{JointType::kPrismatic, "prismatic"}});
}

// ---- cells

template <typename V>
void describe(V& v, CellObject& object) {
  v.add("name", "", "for people", object.name);
  describe_solid(v, object.shape, object.origin);
  v.add("velocity", "m/s", "", object.velocity);
  v.add("margin", "m", "kept around it", object.margin);
  v.add("color", "", "", object.color);
  v.add("holds_only_tool", "", "all but the bodies on the tools' links may touch it", object.holds_only_tool);
  v.add("attached", "", "the tool carries it, and origin is in the tool's frame", object.attached, kOrAbsent);
  std::optional<int> tool;
  if (object.tool != 0) tool = object.tool;
  v.add("tool", "", "index of the tool that carries it; absent: 0", tool);
  if constexpr (kReads<V>) object.tool = tool.value_or(0);
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
  std::optional<int> parent;
  if (joint.parent != Joint::kBefore) parent = joint.parent;
  v.add("name", "", "", joint.name);
  v.add("type", "", "", joint.type);
  v.add("origin", "", "", joint.origin);
  v.add("axis", "", "", joint.axis);
  v.add("parent", "", "link from which it moves its own; older files of serial arms have none", parent);
  check_pose(v, "origin", joint.origin);
  if constexpr (kReads<V>) joint.parent = parent.value_or(Joint::kBefore);
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

template <typename V>
void describe(V& v, Tool& tool) {
  std::optional<GripperNote> gripper;
  if (tool.gripper_time) gripper = GripperNote{*tool.gripper_time};
  v.add("name", "", "", tool.name);
  v.add("link", "", "that carries it", tool.link, kOrAbsent);
  v.add("origin", "", "in the frame of that link", tool.origin);
  v.add("gripper", "", "", gripper);
  check_pose(v, "origin", tool.origin);
  if constexpr (kReads<V>) {
    if (gripper) tool.gripper_time = gripper->closes_in;
  }
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

/// Older files have one tool, `tool`, on the last link, and its gripper next to it.
template <typename V>
void read_older_tool(V& v, RobotModel& model) {
  std::optional<Tool> tool;
  std::optional<GripperNote> gripper;
  v.add("tool", "", "", tool);
  v.add("gripper", "", "", gripper);
  if (!model.tools.empty() || !tool) return;
  tool->link = model.dof();
  if (gripper) tool->gripper_time = gripper->closes_in;
  model.tools.push_back(*tool);
}

/// The object of "Two commands that make this checkable" in docs/explanation/formulation.md.
template <typename V>
void describe(V& v, RobotModel& model) {
  std::vector<std::array<int, 2>> pairs;
  for (const auto& [first, second] : model.pairs) pairs.push_back({first, second});
  std::string meshes = model.meshes == model.name ? "" : model.meshes;
  std::optional<Eigen::Isometry3d> mount;
  if (!model.mount.matrix().isIdentity(0.0)) mount = model.mount;
  v.add("name", "", "", model.name);
  std::vector<Joint> joints = model.joints;
  for (int k = 0; k < model.dof(); ++k) joints[k].parent = model.parent(k);
  v.add("joints", "", "", joints, sized(1, kMaxJoints));
  if constexpr (kReads<V>) model.joints = std::move(joints);
  v.add("tools", "", "one for each arm", model.tools, kOrAbsent);
  v.add("home", "rad (m)", "", model.home);
  v.add("position_min", "rad (m)", "", model.position_min);
  v.add("position_max", "rad (m)", "", model.position_max);
  v.add("velocity_max", "rad/s (m/s)", "", model.velocity_max);
  v.add("acceleration_max", "rad/s^2 (m/s^2)", "", model.acceleration_max);
  if constexpr (!kReads<V>) {
    std::vector<SphereNote> spheres = spheres_of(model);
    v.add("spheres", "", "spheres of arms that have no other bodies", spheres);
  }
  v.add("bodies", "", "", model.bodies);
  v.add("pairs", "", "pairs of indices of bodies", pairs);
  v.add("meshes", "", "robot whose meshes the page draws, if not those of this one", meshes, kOrAbsent);
  v.add("mount", "", "pose of the root in the base", mount);
  if constexpr (kReads<V>) {
    model.meshes = meshes.empty() ? model.name : meshes;
    if (mount) model.mount = *mount;
    check_pose(v, "mount", model.mount);
    for (const auto& [first, second] : pairs) model.pairs.emplace_back(first, second);
    read_older_tool(v, model);
  }
}

std::string cell_json(const Cell& cell, std::optional<Time> at) {
  return document(CellNote{cell, at ? std::optional(to_seconds(*at)) : std::nullopt});
}

Cell read_cell_json(const OrderedJson& json, const std::string& key) {
  CellNote note;
  read_document(json, key, note);
  return note.cell;
}

std::string robot_json(const RobotModel& model, int indent) {
  const std::string line = document(model);
  return indent < 0 ? line : OrderedJson::parse(line).dump(indent);
}

RobotModel read_robot_json(const OrderedJson& json, const std::string& key) {
  RobotModel model;
  read_document(json, key, model);
  model.link_names.emplace_back("base");
  for (const Joint& joint : model.joints) model.link_names.push_back(joint.name);
  if (const Status status = check(model); !status) json::fail(key, status.error().message);
  return model;
}

}  // namespace steadyhand

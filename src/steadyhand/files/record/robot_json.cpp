#include "steadyhand/files/record/robot_json.hpp"

#include <algorithm>

#include "steadyhand/files/record/shape_json.hpp"
#include "steadyhand/geometry/robot/model_check.hpp"

namespace steadyhand {

namespace {

OrderedJson describe(const Body& body) {
  OrderedJson json = {{"name", body.name}, {"link", body.link}};
  json.update(shape_json(body.shape, body.origin));
  return json;
}

/// The object of "Two commands that make this checkable" in docs/formulation.md; beyond it, a joint's "type" tells
/// prismatic joints.
OrderedJson describe(const RobotModel& model) {
  OrderedJson joints = OrderedJson::array();
  for (const Joint& joint : model.joints) {
    joints.push_back({{"name", joint.name},
                      {"type", joint.type == JointType::kRevolute ? "revolute" : "prismatic"},
                      {"origin", rows_json(joint.origin)},
                      {"axis", numbers_json(joint.axis)}});
  }
  OrderedJson bodies = OrderedJson::array(), spheres = OrderedJson::array();
  const auto is_sphere = [](const Body& body) { return body.shape.kind == ShapeKind::kSphere; };
  const bool all_spheres = std::all_of(model.bodies.begin(), model.bodies.end(), is_sphere);
  for (const Body& body : model.bodies) {
    bodies.push_back(describe(body));
    if (!all_spheres) continue;
    spheres.push_back({{"name", body.name},
                       {"link", body.link},
                       {"center", numbers_json(body.origin.translation())},
                       {"radius", body.shape.radius}});
  }
  OrderedJson pairs = OrderedJson::array();
  for (const BodyPair& pair : model.pairs) pairs.push_back(OrderedJson::array({pair.first, pair.second}));
  OrderedJson json = {{"name", model.name},
                      {"joints", joints},
                      {"tool", {{"name", model.tool.name}, {"origin", rows_json(model.tool.origin)}}},
                      {"home", numbers_json(model.home)},
                      {"position_min", numbers_json(model.position_min)},
                      {"position_max", numbers_json(model.position_max)},
                      {"velocity_max", numbers_json(model.velocity_max)},
                      {"acceleration_max", numbers_json(model.acceleration_max)},
                      {"spheres", spheres},
                      {"bodies", bodies},
                      {"pairs", pairs}};
  if (model.meshes != model.name) json["meshes"] = model.meshes;
  if (model.gripper_time) json["gripper"] = {{"closes_in", *model.gripper_time}};
  if (!model.mount.matrix().isIdentity(0.0)) json["mount"] = rows_json(model.mount);
  return json;
}

}  // namespace

std::string robot_json(const RobotModel& model, int indent) {
  // A URDF may name things in any encoding; what is no UTF-8 is replaced, not refused.
  return describe(model).dump(indent, ' ', false, OrderedJson::error_handler_t::replace);
}

namespace {

JointVector read_joints(const OrderedJson& robot, const std::string& key, const char* name, int dof) {
  return json::vector<Eigen::VectorXd>(json::member(robot, key, name), key + "." + name, dof);
}

int read_index(const OrderedJson& json, const std::string& key, std::size_t end) {
  if (!json.is_number_integer() || json.get<double>() < 0.0 || json.get<double>() >= static_cast<double>(end)) {
    json::fail(key, fmt::format("is {}; it must be a whole number below {}", json.dump(), end));
  }
  return json.get<int>();
}

}  // namespace

RobotModel read_robot_json(const OrderedJson& json, const std::string& key) {
  RobotModel model;
  model.name = json::text(json::member(json, key, "name"), key + ".name");
  model.meshes = json.contains("meshes") ? json::text(json["meshes"], key + ".meshes") : model.name;
  if (json.contains("gripper")) {
    const std::string entry = key + ".gripper";
    model.gripper_time = json::number(json::member(json["gripper"], entry, "closes_in"), entry + ".closes_in");
  }
  if (json.contains("mount")) model.mount = read_rows_json(json["mount"], key + ".mount");
  const OrderedJson& joints = json::array(json::member(json, key, "joints"), key + ".joints", -1);
  if (joints.empty() || joints.size() > kMaxJoints) {
    json::fail(key + ".joints", fmt::format("has {} entries; it must have 1 to {}", joints.size(), kMaxJoints));
  }
  model.link_names.emplace_back("base");
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::string entry = fmt::format("{}.joints[{}]", key, i);
    Joint& joint = model.joints.emplace_back();
    joint.name = json::text(json::member(joints[i], entry, "name"), entry + ".name");
    const std::string type = json::text(json::member(joints[i], entry, "type"), entry + ".type");
    if (type != "revolute" && type != "prismatic") {
      json::fail(entry + ".type", fmt::format("is '{}'; it must be revolute or prismatic", type));
    }
    joint.type = type == "revolute" ? JointType::kRevolute : JointType::kPrismatic;
    joint.origin = read_rows_json(json::member(joints[i], entry, "origin"), entry + ".origin");
    joint.axis = json::vector<Eigen::VectorXd>(json::member(joints[i], entry, "axis"), entry + ".axis", 3);
    model.link_names.push_back(joint.name);
  }
  const OrderedJson& tool = json::member(json, key, "tool");
  model.tool.name = json::text(json::member(tool, key + ".tool", "name"), key + ".tool.name");
  model.tool.origin = read_rows_json(json::member(tool, key + ".tool", "origin"), key + ".tool.origin");
  model.home = read_joints(json, key, "home", model.dof());
  model.position_min = read_joints(json, key, "position_min", model.dof());
  model.position_max = read_joints(json, key, "position_max", model.dof());
  model.velocity_max = read_joints(json, key, "velocity_max", model.dof());
  model.acceleration_max = read_joints(json, key, "acceleration_max", model.dof());
  const OrderedJson& bodies = json::array(json::member(json, key, "bodies"), key + ".bodies", -1);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const std::string entry = fmt::format("{}.bodies[{}]", key, i);
    Body& body = model.bodies.emplace_back();
    body.name = json::text(json::member(bodies[i], entry, "name"), entry + ".name");
    body.link = read_index(json::member(bodies[i], entry, "link"), entry + ".link", joints.size() + 1);
    body.origin = read_shape_json(bodies[i], entry, body.shape);
  }
  const OrderedJson& pairs = json::array(json::member(json, key, "pairs"), key + ".pairs", -1);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::string entry = fmt::format("{}.pairs[{}]", key, i);
    json::array(pairs[i], entry, 2);
    model.pairs.emplace_back(read_index(pairs[i][0], entry + "[0]", bodies.size()),
                             read_index(pairs[i][1], entry + "[1]", bodies.size()));
  }
  if (const Status status = check(model); !status) json::fail(key, status.error().message);
  return model;
}

}  // namespace steadyhand

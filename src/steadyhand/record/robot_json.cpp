#include "steadyhand/record/robot_json.hpp"

#include <algorithm>

#include "steadyhand/record/shape_json.hpp"

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
  if (!model.mount.matrix().isIdentity(0.0)) json["mount"] = rows_json(model.mount);
  return json;
}

}  // namespace

std::string robot_json(const RobotModel& model, int indent) {
  // A URDF may name things in any encoding; what is no UTF-8 is replaced, not refused.
  return describe(model).dump(indent, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace steadyhand

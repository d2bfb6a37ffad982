#include "steadyhand/record/robot_json.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace steadyhand {

namespace {

using OrderedJson = nlohmann::ordered_json;  // keys in the order of docs/formulation.md

template <typename Vector>
OrderedJson list(const Vector& vector) {
  OrderedJson values = OrderedJson::array();
  for (const double value : vector) values.push_back(value);
  return values;
}

OrderedJson rows(const Eigen::Isometry3d& T) {
  OrderedJson result = OrderedJson::array();
  for (int row = 0; row < 4; ++row) result.push_back(list(Eigen::Vector4d(T.matrix().row(row))));
  return result;
}

OrderedJson describe(const Body& body) {
  const Shape& shape = body.shape;
  OrderedJson json = {
      {"name", body.name}, {"link", body.link}, {"shape", to_string(shape.kind)}, {"origin", rows(body.origin)}};
  if (shape.kind == ShapeKind::kBox) {
    json["size"] = list(Vector3(2.0 * shape.core + Vector3::Constant(2.0 * shape.radius)));
    json["rounding"] = shape.radius;
    return json;
  }
  if (shape.kind != ShapeKind::kSphere) json["length"] = 2.0 * shape.core.z();
  json["radius"] = shape.kind == ShapeKind::kCylinder ? shape.core.x() : shape.radius;
  return json;
}

/// The object of "Two commands that make this checkable" in docs/formulation.md; beyond it, a joint's "type" tells
/// prismatic joints.
OrderedJson describe(const RobotModel& model) {
  OrderedJson joints = OrderedJson::array();
  for (const Joint& joint : model.joints) {
    joints.push_back({{"name", joint.name},
                      {"type", joint.type == JointType::kRevolute ? "revolute" : "prismatic"},
                      {"origin", rows(joint.origin)},
                      {"axis", list(joint.axis)}});
  }
  OrderedJson bodies = OrderedJson::array(), spheres = OrderedJson::array();
  const auto is_sphere = [](const Body& body) { return body.shape.kind == ShapeKind::kSphere; };
  const bool all_spheres = std::all_of(model.bodies.begin(), model.bodies.end(), is_sphere);
  for (const Body& body : model.bodies) {
    bodies.push_back(describe(body));
    if (!all_spheres) continue;
    spheres.push_back({{"name", body.name},
                       {"link", body.link},
                       {"center", list(body.origin.translation())},
                       {"radius", body.shape.radius}});
  }
  OrderedJson pairs = OrderedJson::array();
  for (const BodyPair& pair : model.pairs) pairs.push_back(OrderedJson::array({pair.first, pair.second}));
  return {{"name", model.name},
          {"joints", joints},
          {"tool", {{"name", model.tool.name}, {"origin", rows(model.tool.origin)}}},
          {"home", list(model.home)},
          {"position_min", list(model.position_min)},
          {"position_max", list(model.position_max)},
          {"velocity_max", list(model.velocity_max)},
          {"acceleration_max", list(model.acceleration_max)},
          {"spheres", spheres},
          {"bodies", bodies},
          {"pairs", pairs}};
}

}  // namespace

std::string robot_json(const RobotModel& model, int indent) {
  // A URDF may name things in any encoding; what is no UTF-8 is replaced, not refused.
  return describe(model).dump(indent, ' ', false, OrderedJson::error_handler_t::replace);
}

}  // namespace steadyhand

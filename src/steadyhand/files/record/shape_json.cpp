#include "steadyhand/files/record/shape_json.hpp"

namespace steadyhand {

namespace {

Shape read_sizes(const OrderedJson& object, const std::string& key) {
  const OrderedJson& kind = json::member(object, key, "shape");
  const auto size = [&](const char* name) { return json::number(json::member(object, key, name), key + "." + name); };
  if (kind == "sphere") return Shape::sphere(size("radius"));
  if (kind == "capsule") return Shape::capsule(0.5 * size("length"), size("radius"));
  if (kind == "cylinder") return Shape::cylinder(size("radius"), 0.5 * size("length"));
  if (kind == "half_space") return Shape::half_space();
  if (kind == "box") {
    const double rounding = size("rounding");
    const Vector3 sizes = json::vector<Eigen::VectorXd>(json::member(object, key, "size"), key + ".size", 3);
    return Shape::box(0.5 * sizes - Vector3::Constant(rounding), rounding);
  }
  json::fail(key + ".shape",
             fmt::format("is {}; it must be sphere, capsule, box, cylinder or half_space", kind.dump()));
}

}  // namespace

OrderedJson rows_json(const Eigen::Isometry3d& T) {
  OrderedJson result = OrderedJson::array();
  for (int row = 0; row < 4; ++row) result.push_back(numbers_json(Eigen::Vector4d(T.matrix().row(row))));
  return result;
}

OrderedJson shape_json(const Shape& shape, const Eigen::Isometry3d& origin) {
  OrderedJson json = {{"shape", to_string(shape.kind)}, {"origin", rows_json(origin)}};
  switch (shape.kind) {
    case ShapeKind::kHalfSpace:  // which has no sizes: what it has grown by, its origin tells
      json["origin"] = rows_json(origin * Eigen::Translation3d(0.0, 0.0, shape.radius));
      break;
    case ShapeKind::kBox:
      json["size"] = numbers_json(Vector3(2.0 * shape.core + Vector3::Constant(2.0 * shape.radius)));
      json["rounding"] = shape.radius;
      break;
    case ShapeKind::kSphere:
      json["radius"] = shape.radius;
      break;
    case ShapeKind::kCapsule:
      json["length"] = 2.0 * shape.core.z();
      json["radius"] = shape.radius;
      break;
    case ShapeKind::kCylinder:
      json["length"] = 2.0 * shape.core.z();
      json["radius"] = shape.core.x();
      break;
  }
  return json;
}

Eigen::Isometry3d read_shape_json(const OrderedJson& object, const std::string& key, Shape& shape) {
  shape = read_sizes(object, key);
  if (const Status status = check(shape); !status) json::fail(key, status.error().message);
  return read_rows_json(json::member(object, key, "origin"), key + ".origin");
}

Eigen::Isometry3d read_rows_json(const OrderedJson& json, const std::string& key) {
  const OrderedJson& rows = json::array(json, key, 4);
  Eigen::Matrix4d T;
  for (int row = 0; row < 4; ++row)
    T.row(row) = json::vector<Eigen::VectorXd>(rows[row], fmt::format("{}[{}]", key, row), 4);
  const Matrix3 R = T.topLeftCorner<3, 3>();
  if ((R * R.transpose() - Matrix3::Identity()).norm() > 1e-6 || R.determinant() < 0.0 ||
      T.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) {
    json::fail(key, "is no pose: its rows must be a rotation matrix with the position behind it, and [0, 0, 0, 1]");
  }
  Eigen::Isometry3d origin;
  origin.matrix() = T;
  return origin;
}

}  // namespace steadyhand

#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <string>
#include <type_traits>

#include "steadyhand/core/json_in.hpp"
#include "steadyhand/files/record/message_style.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/geometry/collision/shape_names.hpp"

/// How robots, cells and problems look, and the solids that they share.
namespace steadyhand {

/// Poses as four rows of four numbers; numbers as nlohmann's library has them, whole ones with ".0".
struct DocumentStyle : FileStyle {
  using Rows = std::array<std::array<double, 4>, 4>;

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
    Eigen::Isometry3d at = origin;  // a half-space has no sizes: its origin includes its growth
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

struct SolidNote {
  Shape shape;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();
};
template <typename V>
void describe(V& v, SolidNote& solid) {
  describe_solid(v, solid.shape, solid.origin);
}

template <typename Style = DocumentStyle, typename T>
std::string document(const T& value) {
  std::string text;
  JsonOut<Style>(text).put(value);
  return text;
}

/// Throws json::Wrong. @param strict members that the description does not have are a mistake
template <typename Style = DocumentStyle, typename T>
void read_document(const OrderedJson& json, const std::string& key, T& into, bool strict = false) {
  JsonIn<OrderedJson, Style> in(json, strict);
  in.members(into);
  if (in.error()) json::fail(key, in.error()->message);
}

}  // namespace steadyhand

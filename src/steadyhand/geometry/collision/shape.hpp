#pragma once

#include <string>
#include <string_view>

#include "steadyhand/core/math.hpp"
#include "steadyhand/core/result.hpp"

namespace steadyhand {

/// Kinds of shapes. Sphere, capsule and box are all points within a radius of a core: a point, a segment, a
/// box.
enum class ShapeKind {
  kSphere,
  kCapsule,    ///< along z
  kBox,        ///< with its edges along x, y, z
  kCylinder,   ///< along z; only for spheres, capsules and half-spaces is it round, for others its box
  kHalfSpace,  ///< z <= 0; of the world only
};

/// A solid in its own frame, with the origin at the centre of its core.
struct Shape {
  ShapeKind kind = ShapeKind::kSphere;  ///< how the rest is read
  Vector3 core = Vector3::Zero();       ///< m, half extents of the core: 0; (0, 0, h); (x, y, z); (r, r, h); 0
  double radius = 0.0;                  ///< m, around the core

  /// radius: m, > 0
  static Shape sphere(double radius) { return {ShapeKind::kSphere, Vector3::Zero(), radius}; }
  /// half_length: m, of the segment, >= 0; radius: m, > 0
  static Shape capsule(double half_length, double radius) {
    return {ShapeKind::kCapsule, {0.0, 0.0, half_length}, radius};
  }
  /// half_extents: m, of the core; radius: m, by which its edges are round, >= 0
  static Shape box(const Vector3& half_extents, double radius = 0.0) { return {ShapeKind::kBox, half_extents, radius}; }
  /// radius: m; half_length: m
  static Shape cylinder(double radius, double half_length) {
    return {ShapeKind::kCylinder, {radius, radius, half_length}, 0.0};
  }
  /// All with z <= 0.
  static Shape half_space() { return {ShapeKind::kHalfSpace, Vector3::Zero(), 0.0}; }

  /// How many corners the core has: 2 of a capsule, 8 of a box. 0: it is a point, or round.
  int corners() const;
  /// m, in the shape's frame; index below corners().
  Vector3 corner(int index) const;
  /// Whether it is all points within a radius of a point or a segment.
  bool is_round() const { return kind == ShapeKind::kSphere || kind == ShapeKind::kCapsule; }
  /// m, no point of the solid is further from the origin; infinite for a half-space.
  double extent() const;
  /// The shape grown by `margin` (m, >= 0), or a little more.
  Shape inflated(double margin) const;
};

/// Where a shape is: its frame in the base (Scalar = double), or at kLanes times (Lanes). Spheres need no R, capsules
/// its last column only.
template <typename Scalar>
struct PlacedOf {
  Vector3Of<Scalar> p;  ///< m
  Matrix3Of<Scalar> R;  ///< to the base
};
using Placed = PlacedOf<double>;  ///< at one time

/// The ball around a corner of a shape's core (Shape::corner).
template <typename Scalar>
PlacedOf<Scalar> at_corner(const Shape& shape, const PlacedOf<Scalar>& there, int index) {
  const Vector3 corner = shape.corner(index);
  PlacedOf<Scalar> result{there.p, Matrix3Of<Scalar>()};
  for (int i = 0; i < 3; ++i) {
    if (corner[i] == 0.0) continue;  // otherwise the column is not set
    for (int k = 0; k < 3; ++k) result.p[k] += there.R(k, i) * corner[i];
  }
  return result;
}

/// "sphere", "capsule", "box", "cylinder", "half_space".
std::string_view to_string(ShapeKind kind);

/// Whether sizes are finite and positive where they must be; the error names the invalid value and the valid ones.
Status check(const Shape& shape);

}  // namespace steadyhand

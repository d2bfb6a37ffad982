#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "steadyhand/geometry/collision/shape_names.hpp"

namespace steadyhand {

double Shape::extent() const {
  switch (kind) {
    case ShapeKind::kHalfSpace:
      return std::numeric_limits<double>::infinity();
    case ShapeKind::kCylinder:
      return std::hypot(core.x(), core.z());
    default:
      return core.norm() + radius;
  }
}

Shape Shape::inflated(double margin) const {
  Shape result = *this;
  if (kind == ShapeKind::kCylinder) {
    result.core.array() += margin;
  } else {
    result.radius += margin;
  }
  return result;
}

int Shape::corners() const {
  if (kind == ShapeKind::kBox) return 8;
  return kind == ShapeKind::kCapsule && core.z() > 0.0 ? 2 : 0;
}

Vector3 Shape::corner(int index) const {
  if (kind == ShapeKind::kCapsule) return {0.0, 0.0, index == 0 ? -core.z() : core.z()};
  return {index & 1 ? core.x() : -core.x(), index & 2 ? core.y() : -core.y(), index & 4 ? core.z() : -core.z()};
}

std::string_view to_string(ShapeKind kind) { return name_of(kind); }

namespace {

constexpr double kLargest = 1e3;  // m; no cell is larger, and sums of squares stay exact enough

Status positive(std::string_view what, double value) {
  if (value > 0.0 && value <= kLargest) return Done{};
  return Error{fmt::format("{} is {} m; it must be above 0 and at most {} m", what, value, kLargest)};
}

Status not_negative(std::string_view what, double value) {
  if (value >= 0.0 && value <= kLargest) return Done{};
  return Error{fmt::format("{} is {} m; it must be from 0 to {} m", what, value, kLargest)};
}

}  // namespace

Status check(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::kSphere:
      return positive("the radius", shape.radius);
    case ShapeKind::kCapsule:
      if (Status status = not_negative("half of the length", shape.core.z()); !status) return status;
      return positive("the radius", shape.radius);
    case ShapeKind::kBox:
      for (int i = 0; i < 3; ++i) {
        if (Status status = positive("half of the size", shape.core[i]); !status) return status;
      }
      return not_negative("the radius", shape.radius);
    case ShapeKind::kCylinder:
      if (Status status = positive("half of the length", shape.core.z()); !status) return status;
      return positive("the radius", shape.core.x());
    case ShapeKind::kHalfSpace:
      break;
  }
  return Done{};
}

}  // namespace steadyhand

#pragma once

#include "steadyhand/core/names.hpp"
#include "steadyhand/geometry/collision/shape.hpp"

namespace steadyhand {

constexpr auto names_of(ShapeKind) {
  return named("ShapeKind", {Name{ShapeKind::kSphere, "sphere"}, Name{ShapeKind::kCapsule, "capsule", "along z"},
                             Name{ShapeKind::kBox, "box"}, Name{ShapeKind::kCylinder, "cylinder", "along z"},
                             Name{ShapeKind::kHalfSpace, "half_space", "all with z <= 0"}});
}

}  // namespace steadyhand

#pragma once

#include <string>
#include <vector>

#include "steadyhand/geometry/collision/shape.hpp"
#include "steadyhand/geometry/mesh/mesh.hpp"

namespace steadyhand {

/// A solid with its place, in the frame of a link.
struct FittedSolid {
  static constexpr double kStep = 1e-5;       ///< m, of numbers that are written
  static constexpr double kLeastCore = 1e-4;  ///< m, half extents of a box's core

  Shape shape;  ///< sphere, capsule or box
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();

  /// m, signed; as Shape is meant.
  double distance(const Vector3& point) const;
};

/// One solid by the keys of a robot file, "capsule: {from: [...], to: [...], radius: ...}".
std::string as_written(const FittedSolid& solid);
/// Every number as as_written() rounds it; the radius (rounding) is left to prove().
FittedSolid rounded(const FittedSolid& solid);
/// Grows the solids until each triangle, or each piece of it, lies in one of them, with a tenth of a millimetre to
/// spare where pieces meet. @pre rounded
void prove(const Surface& surface, std::vector<FittedSolid>& solids);
/// Whether each triangle is shown to lie in the solids.
bool is_covered(const Surface& surface, const std::vector<FittedSolid>& solids);

}  // namespace steadyhand

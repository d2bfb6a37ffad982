#pragma once

#include <array>

#include "steadyhand/core/lanes.hpp"
#include "steadyhand/geometry/collision/shape.hpp"

namespace steadyhand {

/// How near two shapes are, with the data for first and second derivatives when the second shape moves.
///
/// The cores touch each other's nearest points in features that are flat: corners, edges, faces. Moving the second
/// shape moves its nearest point with it and lets both points slide along these features.
template <typename Scalar>
struct ProximityOf {
  /// m. Positive while the shapes are apart, negative while they overlap, increasing with the distance: the signed
  /// distance of the surfaces, or, if both are round (sphere, capsule), (D^2 - R^2) / (2 R) with D the distance of
  /// their cores and R the sum of the radii, which is the same near contact, is smooth where cores touch, and takes no
  /// root.
  Scalar value;
  Vector3Of<Scalar> gradient;              ///< d value / d point, base frame
  Vector3Of<Scalar> point;                 ///< m, of the second core, nearest to the first; base frame
  std::array<Vector3Of<Scalar>, 2> slide;  ///< unit, base frame; 0 where there is none
  std::array<Scalar, 2> of_second;         ///< 1 where that feature is the second shape's, turning with it, else 0
  Scalar length;                           ///< m: R or D, see above; from the axis of a cylinder
  Scalar curvature;                        ///< 1/m: of the value by motion of `point` across the slides; 0 for a face
  bool round;                              ///< both shapes are: there is curvature along the gradient, too
};

/// How one joint moves the second shape of a ProximityOf while the first is stationary.
template <typename Scalar>
struct MovedOf {
  Vector3Of<Scalar> axis;        ///< angular velocity for joint velocity 1, base frame; 0 if it slides
  Vector3Of<Scalar> point;       ///< velocity of ProximityOf::point, m/rad (m/m), base frame
  std::array<Scalar, 2> along;   ///< share of the velocity that the slides take up
  std::array<Scalar, 2> turned;  ///< rotation of the slides out of the plane that they span

  MovedOf() = default;
  MovedOf(const ProximityOf<Scalar>& near, const Vector3Of<Scalar>& axis, const Vector3Of<Scalar>& point);
};

/// Second derivative of ProximityOf::value by two joints, 1/rad^2 (1/m): `before` is nearer to the base, or the same.
/// Exact where the nearest features stay the same and, for cylinders, are not the rim.
template <typename Scalar>
Scalar second_derivative(const ProximityOf<Scalar>& near, const MovedOf<Scalar>& before, const MovedOf<Scalar>& after);

/// Signed distance of the surfaces, m; negative by the depth of the overlap. Exact, with two exceptions: a cylinder and
/// a box or another cylinder (see ShapeKind), and a segment through a cylinder, where the depth may be overestimated.
template <typename Scalar>
Scalar distance(const Shape& first, const PlacedOf<Scalar>& at, const Shape& second, const PlacedOf<Scalar>& there);

/// Whether the balls around two shapes are further apart than `least` (m, or 0 if that is less), and so the shapes.
bool is_further(double least, const Shape& first, const Placed& at, const Shape& second, const Placed& there);

/// ProximityOf::value alone.
template <typename Scalar>
Scalar proximity_value(const Shape& first, const PlacedOf<Scalar>& at, const Shape& second,
                       const PlacedOf<Scalar>& there);

/// With the data for derivatives. The second shape must not be a half-space.
template <typename Scalar>
ProximityOf<Scalar> proximity(const Shape& first, const PlacedOf<Scalar>& at, const Shape& second,
                              const PlacedOf<Scalar>& there);

}  // namespace steadyhand

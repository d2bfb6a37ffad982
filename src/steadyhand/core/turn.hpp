#pragma once

#include <cmath>

#include "steadyhand/core/math.hpp"

namespace steadyhand {

/// The smallest rotation that takes one direction, of any length above 0, to another. As Eigen's FromTwoVectors without
/// its singular value decomposition, which takes seconds to compile in each file.
inline Quaternion turn_between(const Vector3& from, const Vector3& to) {
  constexpr double kNearlyOpposite = 1e-12;
  const Vector3 a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  const Vector3 axis = a.cross(b);
  Quaternion turn;
  if (cosine < -1.0 + kNearlyOpposite) {  // half a turn: any axis at right angles to both will do
    const Vector3 other = std::abs(a.y()) < 0.9 ? Vector3::UnitY() : Vector3::UnitX();
    const double sine = axis.norm();
    turn.w() = 0.5 * (a + b).norm();
    turn.vec() = 0.5 * (a - b).norm() * (sine > kNearlyOpposite ? Vector3(axis / sine) : a.cross(other).normalized());
    return turn;
  }
  const double s = std::sqrt((1.0 + cosine) * 2.0);
  turn.vec() = axis * (1.0 / s);
  turn.w() = s * 0.5;
  return turn;
}

}  // namespace steadyhand

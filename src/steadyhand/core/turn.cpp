#include "steadyhand/core/turn.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

Quaternion turn_between(const Vector3& from, const Vector3& to) {
  constexpr double kNearlyOpposite = 1e-12, kOpposite = 1e-12;
  const Vector3 a = from.normalized(), b = to.normalized(), axis = a.cross(b);
  const double cosine = b.dot(a);
  Quaternion turn;
  if (cosine >= -1.0 + kNearlyOpposite) {
    const double s = std::sqrt((1.0 + cosine) * 2.0);
    turn.vec() = axis * (1.0 / s);
    turn.w() = 0.5 * s;
    return turn;
  }
  // Half a turn: any axis at right angles to both will do.
  const double sine = axis.norm(), ww = 0.5 * (1.0 + std::max(cosine, -1.0));
  const Vector3 other = std::abs(a.y()) < 0.9 ? Vector3::UnitY() : Vector3::UnitX();
  turn.w() = std::sqrt(ww);
  turn.vec() = std::sqrt(1.0 - ww) * (sine > kOpposite ? Vector3(axis / sine) : Vector3(a.cross(other).normalized()));
  return turn;
}

}  // namespace steadyhand

#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <span>

#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/collision/shape.hpp"

namespace steadyhand {

/// Most obstacles of an arm.
inline constexpr int kMaxObstacles = 64;
/// Most obstacles that an arm carries at once.
inline constexpr int kMaxCarried = 8;
/// Largest number of solids that move with the arm, by index: first the bodies of its model, then from kMaxBodies on
/// each obstacle that it carries.
inline constexpr int kMaxSolids = kMaxBodies + kMaxObstacles;
/// Index of a carried obstacle among the solids that move with the arm.
constexpr int solid_of(int obstacle) { return kMaxBodies + obstacle; }

/// A solid that the arm must not touch, or one that it carries. Bodies that are fixed to the base may touch it.
struct Obstacle {
  Shape shape;                         ///< of any kind, with the margin that is kept around it
  Placed at;                           ///< in the base, at Obstacles::time; if carried in the tool's frame
  Vector3 velocity = Vector3::Zero();  ///< m/s, base frame; it does not turn
  double margin = 0.0;                 ///< m, included in the shape: the solid itself is smaller by this
  std::bitset<kMaxSolids> ignores;     ///< indices of solids of the arm that may touch it
  bool carried = false;                ///< by a tool, as a part of the arm; other obstacles keep their margins
  int tool = 0;                        ///< index of the tool that carries it
};

/// Where it is after t (s).
template <typename Scalar>
PlacedOf<Scalar> placed_after(const Obstacle& obstacle, const Scalar& t) {
  PlacedOf<Scalar> result;
  for (int i = 0; i < 3; ++i) result.p[i] = obstacle.at.p[i] + obstacle.velocity[i] * t;
  for (int i = 0; i < 9; ++i) result.R.data()[i] = obstacle.at.R.data()[i];
  return result;
}

/// Obstacles of an arm. The size is fixed, because they are copied between threads.
struct Obstacles {
  static constexpr int kMost = kMaxObstacles;  ///< entries of `list`
  static constexpr double kFarthest = 1e3;     ///< m, from the base, at `time`

  std::uint64_t version = 0;         ///< version of these obstacles: grows with each change while a session runs
  Time time{0};                      ///< when they are at their positions
  int count = 0;                     ///< how many there are
  std::array<Obstacle, kMost> list;  ///< the first `count` of them

  /// The first `count` entries.
  std::span<const Obstacle> all() const { return std::span(list).first(count); }
};
/// No obstacles.
inline const Obstacles kNoObstacles;

/// Why an obstacle is invalid: sizes, numbers that are not finite, a frame that is not a rotation, too far or too fast.
/// Or Done.
Status check(const Obstacle& obstacle);
/// The same for each of them, and for their number.
Status check(const Obstacles& obstacles);

}  // namespace steadyhand

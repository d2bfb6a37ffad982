#include "steadyhand/geometry/collision/obstacle.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace steadyhand {

namespace {

constexpr double kFarthest = Obstacles::kFarthest;
constexpr double kFastest = 100.0;   // m/s
constexpr double kLongestArm = 2.0;  // m, from the tool to what it carries

bool is_rotation(const Matrix3& R) {
  return (R * R.transpose()).isApprox(Matrix3::Identity(), 1e-6) && R.determinant() > 0.0;
}

}  // namespace

Status check(const Obstacle& obstacle) {
  if (const Status s = check(obstacle.shape); !s) return s.error();
  if (!(obstacle.at.p.norm() <= kFarthest)) return Error{fmt::format("must be within {} m of the base", kFarthest)};
  if (!is_rotation(obstacle.at.R)) return Error{"must have a rotation matrix for its orientation"};
  if (obstacle.carried && obstacle.shape.kind == ShapeKind::kHalfSpace) return Error{"a half-space cannot be carried"};
  if (obstacle.carried && !(obstacle.at.p.norm() <= kLongestArm)) {
    return Error{
        fmt::format("is carried {:.3g} m from the tool; it may be at most {} m", obstacle.at.p.norm(), kLongestArm)};
  }
  if (obstacle.carried && !obstacle.velocity.isZero(0.0)) return Error{"is carried, and must have no velocity"};
  if (!(obstacle.velocity.norm() <= kFastest)) return Error{fmt::format("must not be faster than {} m/s", kFastest)};
  return Done{};
}

Status check(const Obstacles& obstacles) {
  if (obstacles.count < 0 || obstacles.count > Obstacles::kMost) {
    return Error{fmt::format("{} obstacles; there may be at most {}", obstacles.count, Obstacles::kMost)};
  }
  for (int i = 0; i < obstacles.count; ++i) {
    if (const Status s = check(obstacles.list[i]); !s)
      return Error{fmt::format("obstacle {}: {}", i, s.error().message)};
  }
  const auto carried = std::count_if(obstacles.list.begin(), obstacles.list.begin() + obstacles.count,
                                     [](const Obstacle& obstacle) { return obstacle.carried; });
  if (carried > kMaxCarried)
    return Error{fmt::format("{} obstacles are carried; at most {} may be", carried, kMaxCarried)};
  return Done{};
}

}  // namespace steadyhand

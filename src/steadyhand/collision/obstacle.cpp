#include "steadyhand/collision/obstacle.hpp"

#include <fmt/format.h>

namespace steadyhand {

namespace {

constexpr double kFarthest = Obstacles::kFarthest;
constexpr double kFastest = 100.0;  // m/s

bool is_rotation(const Matrix3& R) {
  return (R * R.transpose()).isApprox(Matrix3::Identity(), 1e-6) && R.determinant() > 0.0;
}

}  // namespace

Status check(const Obstacle& obstacle) {
  if (const Status s = check(obstacle.shape); !s) return s.error();
  if (!(obstacle.at.p.norm() <= kFarthest)) return Error{fmt::format("must be within {} m of the base", kFarthest)};
  if (!is_rotation(obstacle.at.R)) return Error{"must have a rotation matrix for its orientation"};
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
  return Done{};
}

}  // namespace steadyhand

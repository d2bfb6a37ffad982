#include "steadyhand/planning/plan/obstacle_sweep.hpp"

#include <algorithm>
#include <limits>

#include "steadyhand/geometry/collision/proximity.hpp"

namespace steadyhand {

namespace {

/// Half of the size of the box around a shape, m.
Vector3 half_size(const Shape& shape, const Placed& at) {
  Vector3 half = Vector3::Constant(shape.radius);
  for (int i = 0; i < 3; ++i) {
    if (shape.core[i] > 0.0) half += shape.core[i] * at.R.col(i).cwiseAbs();  // otherwise the column is not set
  }
  return half;
}

}  // namespace

ObstacleSweep::ObstacleSweep(const RobotModel& model, const Obstacles& obstacles, Time start)
    : model_(&model),
      obstacles_(&obstacles),
      fastest_(LinkLengths::Zero(model.dof() + 1)),
      since_(to_seconds(start - obstacles.time)) {}

void ObstacleSweep::pass(const Kinematics& arm) {
  for_each_solid(*model_, *obstacles_, [&](int i) {
    const Solid part = solid(arm, *obstacles_, i);
    const Vector3 half = half_size(part.shape, part.at);
    ways_[i].extend(Box(part.at.p - half, part.at.p + half));
  });
}

bool ObstacleSweep::may_meet(const Box& body, const Obstacle& obstacle, double duration, double margin) const {
  const Vector3 from = obstacle.at.p + since_ * obstacle.velocity, to = from + duration * obstacle.velocity;
  if (obstacle.shape.kind == ShapeKind::kHalfSpace) {
    const Vector3 up = obstacle.at.R.col(2);
    const double height = std::max(up.dot(from), up.dot(to));
    return up.dot(body.center()) - 0.5 * up.cwiseAbs().dot(body.sizes()) < height + obstacle.shape.radius + margin;
  }
  const Vector3 half = half_size(obstacle.shape, obstacle.at) + Vector3::Constant(margin);
  return body.intersects(Box(from.cwiseMin(to) - half, from.cwiseMax(to) + half));
}

void ObstacleSweep::find(double duration, double margin, const LinkLengths& stray) {
  fastest_.setZero();
  for_each_solid(*model_, *obstacles_, [&](int i) {
    near_[i] = 0;
    const int link = link_of(*model_, *obstacles_, i);
    if (link == 0) return;  // the arm cannot avoid obstacles that come near its base
    for (int o = 0; o < obstacles_->count; ++o) {
      const Obstacle& obstacle = obstacles_->list[o];
      if (obstacle.carried || obstacle.ignores[i] || !may_meet(ways_[i], obstacle, duration, margin + stray[link]))
        continue;
      near_[i] |= std::uint64_t{1} << o;
      fastest_[link] = std::max(fastest_[link], obstacle.velocity.norm());
    }
  });
}

Obstacle ObstacleSweep::at_start(int obstacle) const {
  Obstacle result = obstacles_->list[obstacle];
  result.at.p += since_ * result.velocity;  // 0 for what is carried
  return result;
}

void ObstacleSweep::note_entered(const Kinematics& arm, double overlap) {
  entered_.fill(0);
  for_each_near([&](int body, int obstacle) {
    const Solid part = solid(arm, *obstacles_, body);
    if (distance(shape(obstacle), placed(obstacle, 0.0), part.shape, part.at) < -overlap)
      entered_[body] |= std::uint64_t{1} << obstacle;
  });
}

ObstacleGaps obstacle_gaps(const ObstacleSweep& sweep, const Kinematics& arm, double t, const LinkMask& wanted) {
  ObstacleGaps smallest = ObstacleGaps::Constant(kObstacleRows, arm.dof() + 1, std::numeric_limits<double>::infinity());
  sweep.for_each_near([&](int body, int obstacle) {
    const Solid part = solid(arm, sweep.obstacles(), body);
    if (!wanted[part.link]) return;
    const bool moves = sweep.moves(obstacle);
    const ObstacleRow row =
        sweep.entered(body, obstacle) ? (moves ? kEnteredMoving : kEnteredStanding) : (moves ? kMoving : kStanding);
    double& least = smallest(row, part.link);
    if (is_further(least, sweep.shape(obstacle), sweep.placed(obstacle, t), part.shape, part.at)) return;
    least = std::min(least, distance(sweep.shape(obstacle), sweep.placed(obstacle, t), part.shape, part.at));
  });
  return smallest;
}

}  // namespace steadyhand

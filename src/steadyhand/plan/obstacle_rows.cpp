#include "steadyhand/plan/obstacle_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "steadyhand/robot/gaps.hpp"

namespace steadyhand {

namespace {

constexpr int kMostParts = 9;  // of a body: the whole and its corners
constexpr double kNear = 0.1;  // m; within a solve a plan goes further from its guess only where it is not yet near one

/// A body, or the ball around a corner of it.
std::pair<Shape, Placed> solid(const Kinematics& arm, int body, int corner) {
  const Shape& shape = arm.model().bodies[body].shape;
  if (corner < 0) return {shape, arm.body(body)};
  return {Shape::sphere(shape.radius), at_corner(shape, arm.body(body), corner)};
}

/// Whether some joint changes how near a solid on this link is to an obstacle.
bool can_part(const Kinematics& arm, int link, const Obstacle& obstacle, const Shape& shape, const Placed& at) {
  constexpr double kStill = 1e-6;  // m/rad (m/m)
  const ProximityOf<double> near = proximity(obstacle.shape, obstacle.at, shape, at);
  for (int k = 0; k < link; ++k) {
    if (std::abs(near.gradient.dot(arm.dpoint(k, near.point))) > kStill) return true;
  }
  return false;
}

}  // namespace

ObstacleRows::ObstacleRows(const Ocp& ocp)
    : ocp_(ocp), constraint_(0), by_row_(ocp.obstacle_rows(), {-1, -1, -1, 0.0}) {
  while (constraint_ < std::ssize(ocp.constraints()) && ocp.constraints()[constraint_]->name() != "obstacles") {
    ++constraint_;
  }
  if (!by_row_.empty()) pairs_.reserve(ocp.model().bodies.size() * kMostParts * Obstacles::kMost);
}

/// To a half-space the corners of a flat or long body are all that matters; along a box they come beside the whole.
void ObstacleRows::add_pair(const ObstacleSweep& sweep, int body, int obstacle) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const int corners = ocp_.model().bodies[body].shape.corners();
  const ShapeKind other = sweep.shape(obstacle).kind;
  if (corners == 0 || other != ShapeKind::kHalfSpace) pairs_.push_back({body, obstacle, -1, kFar});
  if (other != ShapeKind::kHalfSpace && other != ShapeKind::kBox) return;
  for (int corner = 0; corner < corners; ++corner) pairs_.push_back({body, obstacle, corner, kFar});
}

void ObstacleRows::find_pairs(const ObstacleSweep& sweep, const Trajectory& guess, Kinematics& scratch) {
  pairs_.clear();
  sweep.for_each_near([&](int body, int obstacle) { add_pair(sweep, body, obstacle); });
  for (int k = 1; k <= ocp_.horizon(); ++k) {
    scratch.set_position(guess.x[k].head(ocp_.dof()));
    for (Pair& pair : pairs_) {
      const Placed there = sweep.placed(pair.obstacle, k * ocp_.dt());
      const auto [shape, at] = solid(scratch, pair.body, pair.corner);
      pair.gap = std::min(pair.gap, distance(sweep.shape(pair.obstacle), there, shape, at));
    }
  }
  std::erase_if(pairs_, [](const Pair& pair) { return !(pair.gap < kNear); });
  std::sort(pairs_.begin(), pairs_.end(), [](const Pair& a, const Pair& b) { return a.gap < b.gap; });
  pairs_.erase(pairs_.begin() + std::min(pairs_.size(), by_row_.size()), pairs_.end());
}

void ObstacleRows::choose(const Obstacles& obstacles, Time start, double overlap, Kinematics& scratch,
                          WarmStart& warm_start, OcpInstance& instance) {
  if (by_row_.empty()) return;
  if (obstacles.count == 0 && used_ == 0) return;
  ObstacleSweep sweep(ocp_.model(), obstacles, start);
  const Trajectory& guess = warm_start.guess();
  for (const StateVector& x : guess.x) {
    scratch.set_position(x.head(ocp_.dof()));
    sweep.pass(scratch);
  }
  sweep.find(ocp_.horizon() * ocp_.dt(), kNear, LinkLengths::Zero().eval());
  find_pairs(sweep, guess, scratch);

  const auto same = [](const Pair& a, const Pair& b) {
    return a.body == b.body && a.obstacle == b.obstacle && a.corner == b.corner;
  };
  for (Pair& old : by_row_) {  // those that stay keep their rows
    const auto found = std::find_if(pairs_.begin(), pairs_.end(), [&](const Pair& pair) { return same(pair, old); });
    if (found == pairs_.end()) {
      old.body = -1;
    } else {
      found->body = -1;
    }
  }
  auto row = by_row_.begin();
  for (const Pair& pair : pairs_) {
    if (pair.body < 0) continue;
    while (row->body >= 0) ++row;  // there are no more pairs than rows
    *row = pair;
    warm_start.forget(constraint_, static_cast<int>(row - by_row_.begin()));
  }
  used_ = pairs_.size();
  scratch.set_position(instance.x0.head(ocp_.dof()));
  for (std::size_t i = 0; i < by_row_.size(); ++i) {
    NearObstacle& near = instance.near[i];
    near.body = by_row_[i].body;
    if (near.body < 0) continue;
    near.corner = by_row_[i].corner;
    near.obstacle = sweep.at_start(by_row_[i].obstacle);
    // What has come over the arm may be left, and entered no further.
    const auto [shape, at] = solid(scratch, near.body, near.corner);
    const double value = proximity_value(near.obstacle.shape, near.obstacle.at, shape, at);
    near.depth = value < -overlap ? -value : 0.0;
    // A shoulder that turns over a table is as near to it as it is.
    const int link = ocp_.model().bodies[near.body].link;
    if (value < 0.0 && !can_part(scratch, link, near.obstacle, shape, at)) near.body = -1;
  }
}

}  // namespace steadyhand

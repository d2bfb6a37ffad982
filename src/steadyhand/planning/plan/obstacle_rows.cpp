#include "steadyhand/planning/plan/obstacle_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"

namespace steadyhand {

namespace {

constexpr int kMostParts = 9;   // per body: the whole and its corners
constexpr double kSame = 1e-6;  // m; gaps that differ by less are the same
constexpr double kNear = 0.1;  // m; within a solve a plan goes further from its guess only where it is not yet near one

using Solids = std::pair<Shape, Placed>;

/// The moving solid of a row: a body or a carried object, or the ball around one of its corners.
Solids moved(const Kinematics& arm, const Obstacles& obstacles, int body, int obstacle, int corner) {
  const Solid part = solid(arm, obstacles, obstacles.list[obstacle].carried ? solid_of(obstacle) : body);
  if (corner < 0) return {part.shape, part.at};
  return {Shape::sphere(part.shape.radius), at_corner(part.shape, part.at, corner)};
}

/// The other solid, t (s) after the motion's beginning: an obstacle, or a solid that moves with the arm.
Solids against(const Kinematics& arm, const ObstacleSweep& sweep, int body, int obstacle, double t) {
  if (sweep.obstacles().list[obstacle].carried) {
    const Solid part = solid(arm, sweep.obstacles(), body);
    return {part.shape, part.at};
  }
  return {sweep.shape(obstacle), sweep.placed(obstacle, t)};
}

/// Whether one of these joints changes the distance of the second solid to the first.
bool can_part(const Kinematics& arm, JointSet joints, const Solids& first, const Solids& second) {
  constexpr double kStill = 1e-6;  // m/rad (m/m)
  const ProximityOf<double> near = proximity(first.first, first.second, second.first, second.second);
  for (int k = 0; k < arm.dof(); ++k) {
    if (joints[k] && std::abs(near.gradient.dot(arm.dpoint(k, near.point))) > kStill) return true;
  }
  return false;
}

}  // namespace

ObstacleRows::ObstacleRows(const Ocp& ocp)
    : ocp_(ocp), constraint_(0), by_row_(ocp.obstacle_rows(), {-1, -1, -1, 0.0}) {
  while (constraint_ < std::ssize(ocp.constraints()) && ocp.constraints()[constraint_]->name() != "obstacles") {
    ++constraint_;
  }
  if (!by_row_.empty()) pairs_.reserve((ocp.model().bodies.size() + kMaxCarried) * kMostParts * Obstacles::kMost);
}

/// For a half-space only the corners of a flat or long body matter; for a box they are added to the whole body.
void ObstacleRows::add_pair(const ObstacleSweep& sweep, int body, int obstacle) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const RobotModel& model = ocp_.model();
  const Shape& part = body < kMaxBodies ? model.bodies[body].shape : sweep.shape(body - kMaxBodies);
  const bool carried = sweep.obstacles().list[obstacle].carried;
  const Shape& moves = carried ? sweep.shape(obstacle) : part;
  const int corners = moves.corners();
  const ShapeKind other = carried ? part.kind : sweep.shape(obstacle).kind;
  const bool box_on_box = moves.kind == ShapeKind::kBox && other == ShapeKind::kBox;
  if (corners == 0 || other != ShapeKind::kHalfSpace) pairs_.push_back({body, obstacle, -1, kInfinity, !box_on_box});
  if (other != ShapeKind::kHalfSpace && other != ShapeKind::kBox) return;
  for (int corner = 0; corner < corners; ++corner) pairs_.push_back({body, obstacle, corner, kInfinity});
}

void ObstacleRows::find_pairs(const ObstacleSweep& sweep, const Trajectory& guess, Kinematics& scratch) {
  pairs_.clear();
  sweep.for_each_near([&](int body, int obstacle) { add_pair(sweep, body, obstacle); });
  for_each_carried_pair(ocp_.model(), sweep.obstacles(),
                        [&](int body, int obstacle) { add_pair(sweep, body, obstacle); });
  for (int k = 1; k <= ocp_.horizon(); ++k) {
    scratch.set_position(guess.x[k].head(ocp_.dof()));
    Pair* whole = nullptr;
    double apart = 0.0, of_corners = 0.0;  // m, of that: its corners, which follow it, are no nearer
    const auto judge = [&] {
      if (whole && apart < kNear && of_corners > apart + kSame) whole->counts = true;
    };
    for (Pair& pair : pairs_) {
      const bool of_whole = pair.corner >= 0 && whole && whole->body == pair.body && whole->obstacle == pair.obstacle;
      double least = pair.counts ? std::min(pair.gap, kNear) : kNear;
      if (of_whole && !whole->counts && apart < kNear) {
        least = std::max(least, apart + 2.0 * kSame);  // exact where a corner is as near as the whole
      } else if (of_whole && apart >= least) {
        continue;
      }
      const auto [other, there] = against(scratch, sweep, pair.body, pair.obstacle, k * ocp_.dt());
      const auto [shape, at] = moved(scratch, sweep.obstacles(), pair.body, pair.obstacle, pair.corner);
      const double here = is_further(least, other, there, shape, at) ? least : distance(other, there, shape, at);
      pair.gap = std::min(pair.gap, here);
      if (of_whole) of_corners = std::min(of_corners, here);
      if (pair.corner >= 0) continue;
      judge();
      whole = &pair;
      apart = here;
      of_corners = std::numeric_limits<double>::infinity();
    }
    judge();
  }
  std::erase_if(pairs_, [](const Pair& pair) { return !pair.counts || !(pair.gap < kNear); });
  std::sort(pairs_.begin(), pairs_.end(), [](const Pair& a, const Pair& b) { return a.gap < b.gap; });
  pairs_.erase(pairs_.begin() + std::min(pairs_.size(), by_row_.size()), pairs_.end());
}

void ObstacleRows::choose(const Obstacles& obstacles, Time start, Kinematics& scratch, WarmStart& warm_start,
                          OcpInstance& instance) {
  if (by_row_.empty()) return;
  if (obstacles.count == 0 && used_ == 0) return;
  ObstacleSweep sweep(ocp_.model(), obstacles, start);
  const Trajectory& guess = warm_start.guess();
  for (const StateVector& x : guess.x) {
    scratch.set_position(x.head(ocp_.dof()));
    sweep.pass(scratch);
  }
  sweep.find(ocp_.horizon() * ocp_.dt(), kNear, LinkLengths::Zero(ocp_.dof() + 1));
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
    if (near.body >= kMaxBodies) near.carried = obstacles.list[near.body - kMaxBodies];
    // If the arm is inside an obstacle, it may leave it but enter it no further.
    const Solids first = against(scratch, sweep, near.body, by_row_[i].obstacle, 0.0);
    const Solids second = moved(scratch, obstacles, near.body, by_row_[i].obstacle, near.corner);
    const double value = proximity_value(first.first, first.second, second.first, second.second);
    near.depth = value < 0.0 ? instance.clearance - value : 0.0;
    // A shoulder that turns over a table is as near to it as it is.
    const JointSet joints =
        ocp_.constraints()[constraint_]->joints(static_cast<int>(i), ocp_.dof(), instance.near) & ~instance.given;
    if (value < instance.clearance && !can_part(scratch, joints, first, second)) near.body = -1;
  }
}

}  // namespace steadyhand

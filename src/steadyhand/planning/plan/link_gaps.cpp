#include "steadyhand/planning/plan/link_gaps.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/geometry/collision/proximity.hpp"

namespace steadyhand {

LinkPairs levers(const RobotModel& model, const Obstacles& obstacles) {
  LinkLengths reach = LinkLengths::Zero(model.dof() + 1);  // m, from a link's frame
  for (const Body& body : model.bodies)
    reach[body.link] = std::max(reach[body.link], body.origin.translation().norm() + body.shape.extent());
  for (const Obstacle& carried : obstacles.all()) {
    if (!carried.carried) continue;
    const Tool& tool = model.tools[carried.tool];
    reach[tool.link] = std::max(reach[tool.link], (tool.origin * carried.at.p).norm() + carried.shape.extent());
  }
  LinkPairs result = all_link_pairs(model, 0.0);
  for (int j = 1; j <= model.dof(); ++j) {
    double length = reach[j];
    for (int link = j; link > 0; link = model.parent(link - 1)) {
      const int i = link - 1;
      const bool slides = model.joints[i].type == JointType::kPrismatic;
      if (slides) length += std::max(std::abs(model.position_min[i]), std::abs(model.position_max[i]));
      result(i, j) = slides ? 1.0 : length;  // a sliding joint moves all points at its speed
      length += model.joints[i].origin.translation().norm();
    }
  }
  return result;
}

namespace {

/// m, where there are no bodies.
constexpr double kFar = 1e6;

/// Smallest sum of the radii of two bodies of two links: their cores are further apart than their surfaces by this.
LinkPairs least_radii(const RobotModel& model, const Obstacles& obstacles) {
  LinkPairs least = all_link_pairs(model, kFar);
  const auto include = [&](int row, int link, double radii) { least(row, link) = std::min(least(row, link), radii); };
  const auto include_obstacles = [&](int link, double radius) {
    for (int kind = 0; kind < kObstacleRows; ++kind) include(row_of(ObstacleRow(kind), model), link, radius);
  };
  for (const auto& [i, j] : model.pairs) {
    const Body &first = model.bodies[i], &second = model.bodies[j];
    include(first.link, second.link, first.shape.radius + second.shape.radius);
  }
  for (const Body& body : model.bodies) include_obstacles(body.link, body.shape.radius);
  for (const Obstacle& carried : obstacles.all())
    if (carried.carried) include_obstacles(model.tools[carried.tool].link, carried.shape.radius);
  for_each_carried_pair(model, obstacles, [&](int first, int obstacle) {
    const Shape& shape = first < kMaxBodies ? model.bodies[first].shape : obstacles.list[first - kMaxBodies].shape;
    const auto [low, high] =
        std::minmax({link_of(model, obstacles, first), link_of(model, obstacles, solid_of(obstacle))});
    include(low, high, shape.radius + obstacles.list[obstacle].shape.radius);
  });
  return least;
}

/// Largest speed and acceleration of points of two links, or of a link and an obstacle, relative to each other.
struct Motion {
  LinkPairs speed;         ///< m/s
  LinkPairs acceleration;  ///< m/s^2
};

/// Bounds while the joints are no faster than `speed`. Seen from the link that carries both, the velocity of a point of
/// a link is the sum over the joints k between them of dq_k z_k x r_k, r_k from joint k to the point, its acceleration
/// the sum over joints k and l of ddq_k z_k x r_k and of dq_k dq_l z_min(k,l) x (z_max(k,l) x r_max(k,l)).
Motion fastest(const RobotModel& model, const LinkPairs& levers, const JointVector& speed,
               const JointVector& acceleration, const LinkLengths& obstacle_speed) {
  Motion most{all_link_pairs(model, 0.0), all_link_pairs(model, 0.0)};
  for (int j = 1; j <= model.dof(); ++j) {
    for (int i = 0; i < j; ++i) {
      double of_i = 0.0, of_j = 0.0;  // m/s, by joints further from the base
      for (int a = i, b = j; a != b;) {
        const bool along_j = b > a;
        const int k = (along_j ? b : a) - 1;
        const double lever = levers(k, along_j ? j : i);
        double& beyond = along_j ? of_j : of_i;
        most.acceleration(i, j) += lever * (acceleration[k] + speed[k] * speed[k]) + 2.0 * speed[k] * beyond;
        beyond += lever * speed[k];
        (along_j ? b : a) = model.parent(k);
      }
      most.speed(i, j) = of_i + of_j;
    }
  }
  most.speed.bottomRows<kObstacleRows>().rowwise() = most.speed.row(0).eval();
  for (const ObstacleRow kind : {kMoving, kEnteredMoving})
    most.speed.row(row_of(kind, model)) += obstacle_speed.transpose();
  most.acceleration.bottomRows<kObstacleRows>().rowwise() = most.acceleration.row(0).eval();
  return most;
}

/// Lower bound of gaps in the time h between two moments, from the distances of cores. -kFar where these give no bound:
/// cores that may overlap have no distance, and if cores nearly touch, others may come nearer than the nearest.
LinkPairs least_between(const LinkPairs& first, const LinkPairs& last, const LinkPairs& radii, const Motion& most,
                        double h) {
  const LinkPairs way = h * most.speed;
  const LinkPairs from = first + radii, to = last + radii;  // between cores
  const LinkPairs furthest = 0.5 * (from + to + way);
  const LinkPairs bend = way * way + h * h * furthest * most.acceleration;
  const LinkPairs a = from * from, b = to * to, least = a.min(b), most_uneven = (b - a).abs();
  const LinkPairs squared =
      (most_uneven >= bend).select(least, 0.5 * (a + b) - 0.25 * (bend + most_uneven * most_uneven / bend));
  const LinkPairsMask tells = squared > 0.0 && from.min(to) > (0.25 * h * h) * most.acceleration;
  return tells.select(squared.max(0.0).sqrt() - radii, -kFar);
}

}  // namespace

LinkPairs gaps(const Kinematics& kinematics, const ObstacleSweep& obstacles, double t, const LinkPairsMask& wanted) {
  const RobotModel& model = kinematics.model();
  LinkPairs smallest = all_link_pairs(model, kFar);
  if (obstacles.count() > 0) {
    const LinkMask links = wanted.bottomRows<kObstacleRows>().colwise().any().transpose();
    smallest.bottomRows<kObstacleRows>() = obstacle_gaps(obstacles, kinematics, t, links).min(kFar);
  }
  for (const auto& [i, j] : model.pairs) {
    const Body &first = model.bodies[i], &second = model.bodies[j];
    if (!wanted(first.link, second.link)) continue;
    double& least = smallest(first.link, second.link);
    if (is_further(least, first.shape, kinematics.body(i), second.shape, kinematics.body(j))) continue;
    least = std::min(least, distance(first.shape, kinematics.body(i), second.shape, kinematics.body(j)));
  }
  const Obstacles& all = obstacles.obstacles();
  for_each_carried_pair(model, all, [&](int first, int obstacle) {
    const int second = solid_of(obstacle);
    const auto [low, high] = std::minmax({link_of(model, all, first), link_of(model, all, second)});
    if (wanted(low, high))
      smallest(low, high) = std::min(smallest(low, high), solid_gap(kinematics, all, first, second));
  });
  return smallest;
}

PlanFault contact(const LinkPairs& gaps, const LinkPairs& smallest) {
  const auto below = (gaps < smallest).eval();
  if (!below.any()) return PlanFault::kNone;
  return below.bottomRows<kObstacleRows>().any() ? PlanFault::kObstacle : PlanFault::kSelfCollision;
}

GapsBetween::GapsBetween(Kinematics& kinematics, const ObstacleSweep& obstacles, const LinkPairs& levers,
                         const LinkPairs& smallest, double tolerance)
    : kinematics_(kinematics),
      obstacles_(obstacles),
      levers_(levers),
      smallest_(smallest),
      tolerance_(tolerance),
      radii_(least_radii(kinematics.model(), obstacles.obstacles())) {}

LinkPairs GapsBetween::gaps_at(const Moment& moment, const LinkPairsMask& wanted) {
  kinematics_.set_position(moment.q);
  return gaps(kinematics_, obstacles_, moment.t, wanted);
}

PlanFault GapsBetween::look(Moment& first, Moment& last, const JointVector& acceleration) {
  const JointVector speed = first.dq.cwiseAbs().cwiseMax(last.dq.cwiseAbs());
  const LinkPairs way =
      (last.t - first.t) *
      fastest(kinematics_.model(), levers_, speed, acceleration.cwiseAbs(), obstacles_.fastest()).speed;
  last.gaps = first.gaps - way;
  LinkPairsMask untold = last.gaps < smallest_;
  if (!untold.any()) return PlanFault::kNone;
  last.gaps = untold.select(gaps_at(last, untold), last.gaps);
  if (const PlanFault fault = contact(last.gaps, smallest_); fault != PlanFault::kNone) return fault;
  untold = untold && 0.5 * (first.gaps + last.gaps - way) < smallest_;
  if (!untold.any()) return PlanFault::kNone;
  first.gaps = untold.select(gaps_at(first, untold), first.gaps);
  // Second derivatives give no bound for gaps of which only a lower bound is known.
  Moment begin = first, end = last;
  begin.gaps = untold.select(first.gaps, kFar);
  end.gaps = untold.select(last.gaps, kFar);
  return look_closer(begin, end, acceleration, 7);
}

PlanFault GapsBetween::look_closer(const Moment& first, const Moment& last, const JointVector& acceleration,
                                   int halvings) {
  const double h = last.t - first.t, s = 0.5 * h;
  const JointVector speed = first.dq.cwiseAbs().cwiseMax(last.dq.cwiseAbs());
  const Motion most = fastest(kinematics_.model(), levers_, speed, acceleration.cwiseAbs(), obstacles_.fastest());
  LinkPairs least = 0.5 * (first.gaps + last.gaps - h * most.speed);
  if (contact(least, smallest_) == PlanFault::kNone) return PlanFault::kNone;
  least = least.max(least_between(first.gaps, last.gaps, radii_, most, h));
  // Where cores may overlap, as at the plan's beginning, no bound holds in between; only the moments are checked.
  least = (smallest_ + radii_ < -tolerance_).select(smallest_, least);
  const PlanFault untold = contact(least, smallest_);
  if (untold == PlanFault::kNone || halvings == 0) return untold;
  Moment middle{first.t + s, first.q + s * first.dq + (0.5 * s * s) * acceleration, first.dq + s * acceleration, {}};
  middle.gaps = gaps_at(middle, least < smallest_);
  PlanFault fault = contact(middle.gaps, smallest_);
  if (fault == PlanFault::kNone) fault = look_closer(first, middle, acceleration, halvings - 1);
  if (fault == PlanFault::kNone) fault = look_closer(middle, last, acceleration, halvings - 1);
  return fault;
}

}  // namespace steadyhand

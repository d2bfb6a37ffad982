#include "steadyhand/geometry/robot/gaps.hpp"

#include "steadyhand/geometry/collision/proximity.hpp"

namespace steadyhand {

Solid solid(const Kinematics& arm, const Obstacles& obstacles, int index) {
  if (index < kMaxBodies) return {arm.model().bodies[index].shape, arm.model().bodies[index].link, arm.body(index)};
  const Obstacle& carried = obstacles.list[index - kMaxBodies];
  return {carried.shape, arm.model().tools[carried.tool].link, placed_on_tool(arm, carried)};
}

double gap(const Kinematics& arm, const BodyPair& pair) {
  const auto& [first, second] = pair;
  const RobotModel& model = arm.model();
  return distance(model.bodies[first].shape, arm.body(first), model.bodies[second].shape, arm.body(second));
}

double gap(const Kinematics& arm, int body, const Shape& other, const Placed& there) {
  return distance(other, there, arm.model().bodies[body].shape, arm.body(body));
}

double solid_gap(const Kinematics& arm, const Obstacles& obstacles, int first, int second) {
  const Solid a = solid(arm, obstacles, first), b = solid(arm, obstacles, second);
  return distance(a.shape, a.at, b.shape, b.at);
}

namespace {

/// m, that is included in a solid's shape.
double margin_of(const Obstacles& obstacles, int index) {
  return index < kMaxBodies ? 0.0 : obstacles.list[index - kMaxBodies].margin;
}

/// m, without margins.
double carried_gap(const Kinematics& arm, const Obstacles& obstacles, int first, int obstacle) {
  const int second = solid_of(obstacle);
  return solid_gap(arm, obstacles, first, second) + margin_of(obstacles, first) + margin_of(obstacles, second);
}

}  // namespace

NearestBody nearest_body(const Kinematics& arm, const Obstacles& obstacles, int obstacle, double t) {
  const Obstacle& other = obstacles.list[obstacle];
  NearestBody nearest;
  const auto take = [&](int body, double distance) {
    if (distance < nearest.distance) nearest = {body, distance};
  };
  if (other.carried) {
    for_each_carried_pair(arm.model(), obstacles, [&](int first, int carried) {
      if (carried != obstacle && first != solid_of(obstacle)) return;
      take(carried == obstacle ? first : solid_of(carried), carried_gap(arm, obstacles, first, carried));
    });
    return nearest;
  }
  const Placed there = placed_after(other, t);
  for_each_solid(arm.model(), obstacles, [&](int index) {
    const Solid part = solid(arm, obstacles, index);
    if (part.link == 0 || other.ignores[index]) return;
    take(index, distance(other.shape, there, part.shape, part.at) + other.margin + margin_of(obstacles, index));
  });
  return nearest;
}

NearestPair nearest_pair(const Kinematics& arm, const Obstacles& obstacles) {
  NearestPair nearest;
  for (const BodyPair& pair : arm.model().pairs) {
    if (const double here = gap(arm, pair); here < nearest.gap) nearest = {pair.first, pair.second, here};
  }
  for_each_carried_pair(arm.model(), obstacles, [&](int first, int obstacle) {
    const double here = carried_gap(arm, obstacles, first, obstacle);
    if (here < nearest.gap) nearest = {first, solid_of(obstacle), here};
  });
  return nearest;
}

}  // namespace steadyhand

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

double carried_gap(const Kinematics& arm, int body, const Obstacle& carried) {
  return distance(arm.model().bodies[body].shape, arm.body(body), carried.shape, placed_on_tool(arm, carried));
}

NearestBody nearest_body(const Kinematics& arm, const Obstacles& obstacles, int obstacle, double t) {
  const Obstacle& other = obstacles.list[obstacle];
  NearestBody nearest;
  const auto take = [&](int body, double distance) {
    if (distance < nearest.distance) nearest = {body, distance};
  };
  if (other.carried) {
    for_each_carried_pair(arm.model(), obstacles, [&](int body, int carried) {
      if (carried == obstacle) take(body, carried_gap(arm, body, other) + other.margin);
    });
    return nearest;
  }
  const Placed there = placed_after(other, t);
  for_each_solid(arm.model(), obstacles, [&](int index) {
    const Solid part = solid(arm, obstacles, index);
    if (part.link == 0 || other.ignores[index]) return;
    const double margin = index < kMaxBodies ? 0.0 : obstacles.list[index - kMaxBodies].margin;
    take(index, distance(other.shape, there, part.shape, part.at) + other.margin + margin);
  });
  return nearest;
}

NearestPair nearest_pair(const Kinematics& arm, const Obstacles& obstacles) {
  NearestPair nearest;
  for (const BodyPair& pair : arm.model().pairs) {
    if (const double here = gap(arm, pair); here < nearest.gap) nearest = {pair.first, pair.second, here};
  }
  for_each_carried_pair(arm.model(), obstacles, [&](int body, int obstacle) {
    const double here = carried_gap(arm, body, obstacles.list[obstacle]) + obstacles.list[obstacle].margin;
    if (here < nearest.gap) nearest = {body, solid_of(obstacle), here};
  });
  return nearest;
}

}  // namespace steadyhand

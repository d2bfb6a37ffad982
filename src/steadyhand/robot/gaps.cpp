#include "steadyhand/robot/gaps.hpp"

namespace steadyhand {

double gap(const Kinematics& arm, const BodyPair& pair) {
  const auto& [first, second] = pair;
  const RobotModel& model = arm.model();
  return distance(model.bodies[first].shape, arm.body(first), model.bodies[second].shape, arm.body(second));
}

double gap(const Kinematics& arm, int body, const Shape& other, const Placed& there) {
  return distance(other, there, arm.model().bodies[body].shape, arm.body(body));
}

NearestBody nearest_body(const Kinematics& arm, const Obstacle& obstacle, double t) {
  const std::vector<Body>& bodies = arm.model().bodies;
  const Placed there = placed_after(obstacle, t);
  NearestBody nearest;
  for (int i = 0; i < static_cast<int>(bodies.size()); ++i) {
    if (bodies[i].link == 0 || obstacle.ignores[i]) continue;
    const double distance = gap(arm, i, obstacle.shape, there) + obstacle.margin;
    if (distance < nearest.distance) nearest = {i, distance};
  }
  return nearest;
}

NearestPair nearest_pair(const Kinematics& arm) {
  NearestPair nearest;
  for (const BodyPair& pair : arm.model().pairs) {
    if (const double here = gap(arm, pair); here < nearest.gap) nearest = {pair.first, pair.second, here};
  }
  return nearest;
}

}  // namespace steadyhand

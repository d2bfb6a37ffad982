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

NearestPair nearest_pair(const Kinematics& arm) {
  NearestPair nearest;
  for (const BodyPair& pair : arm.model().pairs) {
    if (const double here = gap(arm, pair); here < nearest.gap) nearest = {pair.first, pair.second, here};
  }
  return nearest;
}

}  // namespace steadyhand

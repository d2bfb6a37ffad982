#include "steadyhand/files/record/step_describer.hpp"

#include <algorithm>
#include <limits>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

std::vector<BodyPair> pairs_between_arms(const RobotModel& model) {
  std::vector<int> arms(model.dof() + 1, 0);  // of each link, a bit for each arm that it is part of
  for (int t = 0; t < model.tool_count(); ++t) {
    for (const int joint : model.chain(model.tools[t].link)) arms[joint + 1] |= 1 << t;
  }
  std::vector<BodyPair> between;
  for (const BodyPair& pair : model.pairs) {
    const int first = arms[model.bodies[pair.first].link], second = arms[model.bodies[pair.second].link];
    if (first != 0 && second != 0 && (first & second) == 0) between.push_back(pair);
  }
  return between;
}

Status StepDescriber::set_cell(const Cell& cell, Time at) {
  Result<Obstacles> obstacles = obstacles_of(cell, arm_.model());
  if (!obstacles) return obstacles.error();
  cell_ = cell;
  obstacles_ = *obstacles;
  obstacles_.time = at;
  return Done{};
}

PlanStep StepDescriber::describe(const Plan& plan, Time at, int horizon, const SolveFigures& solved) {
  const JointCommand command = sample(plan, at);
  PlanStep step;
  step.t_s = to_seconds(at);
  step.q = command.q;
  step.dq = command.dq;
  step.ddq = command.ddq;
  step.status = plan.origin;
  step.objective = solved.objective;
  step.shares = solved.shares;
  step.iterations = solved.iterations;
  step.solve_time_us = solved.time_us;
  step.smallest_sphere_distance_m = std::numeric_limits<double>::infinity();
  // Behind the horizon there is only a stop, which the next plan replaces.
  const int now = static_cast<int>(std::clamp(to_seconds(at - plan.start) / plan.dt, 0.0, 1.0 * plan.intervals));
  for (int k = now; k <= std::min(now + horizon, plan.intervals); ++k) {
    arm_.set_position(plan.x[k].head(plan.joints));
    step.smallest_sphere_distance_m = std::min(step.smallest_sphere_distance_m, nearest_pair(arm_, obstacles_).gap);
    for (const BodyPair& pair : between_arms_) {
      step.distance_between_arms_m = std::min(step.distance_between_arms_m, gap(arm_, pair));
    }
  }
  arm_.set_position(command.q);
  for (int i = 0; i < obstacles_.count; ++i) {
    const double distance = nearest_body(arm_, obstacles_, i, to_seconds(at - obstacles_.time)).distance;
    step.object_distances.emplace_back(cell_.objects[i].name, distance);
  }
  arm_.set_motion(command.dq, command.ddq);
  step.tool_count = arm_.tool_count();
  for (int t = 0; t < step.tool_count; ++t) {
    step.tools[t].X_base_planned = {arm_.p(t), Quaternion(arm_.R(t))};
    step.tools[t].local_acceleration = arm_.local_acceleration(t);
  }
  return step;
}

const ToolPaths& StepDescriber::paths(const Plan& plan) {
  for (std::vector<Pose>& path : paths_) path.clear();
  for (int k = 0; k <= plan.intervals; ++k) {
    arm_.set_position(plan.x[k].head(plan.joints));
    for (int t = 0; t < arm_.tool_count(); ++t) paths_[t].push_back({arm_.p(t), Quaternion(arm_.R(t))});
  }
  return paths_;
}

}  // namespace steadyhand

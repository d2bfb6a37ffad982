#include "steadyhand/files/record/step_describer.hpp"

#include <algorithm>
#include <limits>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

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
  }
  arm_.set_position(command.q);
  for (int i = 0; i < obstacles_.count; ++i) {
    const double distance = nearest_body(arm_, obstacles_, i, to_seconds(at - obstacles_.time)).distance;
    step.object_distances.emplace_back(cell_.objects[i].name, distance);
  }
  arm_.set_motion(command.dq, command.ddq);
  step.X_base_planned = {arm_.p(), Quaternion(arm_.R())};
  step.local_acceleration = arm_.local_acceleration();
  return step;
}

const std::vector<Pose>& StepDescriber::path(const Plan& plan) {
  path_.clear();
  for (int k = 0; k <= plan.intervals; ++k) {
    arm_.set_position(plan.x[k].head(plan.joints));
    path_.push_back({arm_.p(), Quaternion(arm_.R())});
  }
  return path_;
}

}  // namespace steadyhand

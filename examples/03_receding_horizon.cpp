// The loop as it runs live: targets come at 90 Hz, the planner runs at 20 Hz, the arm is commanded at 500 Hz. Here the
// target goes round in a circle, and the clock is a counter.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "steadyhand/config/profile_file.hpp"
#include "steadyhand/config/robot_file.hpp"
#include "steadyhand/plan/planner.hpp"
#include "steadyhand/predict/predictor.hpp"
#include "steadyhand/track/tracker.hpp"

using namespace steadyhand;

int main() {
  const Result<RobotModel> ur5e = open_robot("ur5e");
  const Result<Profile> profile = load_profile("tracking");
  if (!ur5e || !profile) {
    fmt::print(stderr, "{}\n", ur5e ? profile.error().message : ur5e.error().message);
    return 2;
  }
  PlannerSettings planner_settings;
  planner_settings.tolerance = profile->tolerance;
  auto planner = Planner::make(*ur5e, profile->ocp, planner_settings);
  if (!planner) {
    fmt::print(stderr, "{}\n", planner.error().message);
    return 2;
  }
  PredictorSettings predictor_settings;
  predictor_settings.horizon = profile->ocp.horizon;
  predictor_settings.dt = profile->ocp.dt;
  Predictor predictor(predictor_settings);
  Tracker tracker(ur5e->home);

  Kinematics arm(*ur5e);
  arm.set_position(ur5e->home);
  const Pose home{arm.p(), Quaternion(arm.R())};
  const auto circle = [&](Time t) {  // across the arm's forward axis, radius 0.1 m, 4 s for a turn, beginning at home
    const double angle = 2.0 * M_PI * to_seconds(t) / 4.0;
    return Target{{t, t}, {home.p + 0.1 * Vector3(0.0, std::sin(angle), 1.0 - std::cos(angle)), home.q}, true};
  };

  const Time command_period = from_seconds(1.0 / 500.0), end = from_seconds(8.0);
  const Time plan_period = from_seconds(1.0 / 20.0), hand_period = from_seconds(1.0 / 90.0);
  Time next_plan{0}, next_hand{0};
  int plans = 0, solved = 0;
  double worst_error = 0.0, worst_speed = 0.0, smallest_gap = arm.clearance();
  for (Time now{0}; now < end; now += command_period) {
    for (; next_hand <= now; next_hand += hand_period) predictor.update(circle(next_hand));
    if (now >= next_plan) {
      const Plan& plan = (*planner)->update(predictor.predict(now));  // checked, and it ends at rest
      tracker.follow(plan);
      solved += plan.origin == PlanOrigin::kSolved;
      ++plans;
      next_plan += plan_period;
    }
    const JointCommand command = tracker.update(now);  // what a real arm would be sent

    arm.set_position(command.q);
    smallest_gap = std::min(smallest_gap, arm.clearance());
    worst_speed = std::max(worst_speed, (command.dq.cwiseAbs().array() / ur5e->velocity_max.array()).maxCoeff());
    if (now > from_seconds(1.0)) worst_error = std::max(worst_error, (arm.p() - circle(now).X_base_tool.p).norm());
  }
  fmt::print("{} plans, {} of them solved\n", plans, solved);
  fmt::print("farthest from the circle after 1 s: {:.1f} mm\n", 1e3 * worst_error);
  fmt::print("fastest joint: {:.0f} % of its limit; smallest gap between spheres: {:.1f} mm\n", 100.0 * worst_speed,
             1e3 * smallest_gap);
  return solved == plans && worst_error < 0.02 && worst_speed <= 1.0 && smallest_gap > 0.0 ? 0 : 1;
}

#pragma once

#include <cmath>
#include <memory>
#include <random>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/plan/planner.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

/// A planner for a random arm, and a target that wanders smoothly among poses that the arm can take.
struct Loop {
  explicit Loop(unsigned seed, double bound = 1.5, int obstacle_rows = 0)
      : random(seed), model(random_arm(6, random, false)), arm(model) {
    while (arm.set_position(model.home), clearance(arm) < 0.02) model.home = random_joints(6, 2.0, random);
    settings.obstacle_rows = obstacle_rows;
    settings.weights = {{"position", {500}},      {"orientation", {5}}, {"velocity", {0.1}},
                        {"acceleration", {0.02}}, {"lateral", {1}},     {"vertical", {1}}};
    planner = std::move(*Planner::make(model, settings, {}));
    direction = random_joints(6, bound, random);
  }

  Reference reference(Time start) {
    Reference r;
    r.start = start;
    r.nodes = settings.horizon;
    for (int k = 1; k <= r.nodes; ++k) {
      arm.set_position(model.home + std::sin(2.0 * (to_seconds(start) + k * r.dt)) * direction);
      r.tools[0].p[k - 1] = arm.p();
      r.tools[0].R[k - 1] = arm.R();
    }
    return r;
  }

  std::mt19937 random;
  RobotModel model;
  Kinematics arm;
  OcpSettings settings;
  JointVector direction;
  std::unique_ptr<Planner> planner;
};

/// Joints that go 4.7 mrad up within an interval, back to where they were, and rest a little below.
inline Plan up_and_back(const JointVector& home) {
  Plan plan;
  stand(home, Time(0), plan);
  plan.intervals = 2;
  const JointVector up = JointVector::Constant(6, 14.0);
  plan.x[0].tail(6) = 0.5 * plan.dt * up;
  for (int k = 0; k < 2; ++k) {
    plan.u[k] = k == 0 ? JointVector(-up) : JointVector(0.5 * up);
    plan.x[k + 1].resize(12);
    plan.x[k + 1] << plan.x[k].head(6) + plan.dt * plan.x[k].tail(6) + 0.5 * plan.dt * plan.dt * plan.u[k],
        plan.x[k].tail(6) + plan.dt * plan.u[k];
  }
  return plan;
}

}  // namespace steadyhand

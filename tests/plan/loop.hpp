#pragma once

#include <cmath>
#include <memory>
#include <random>

#include "robot/random_arm.hpp"
#include "steadyhand/plan/planner.hpp"
#include "steadyhand/robot/gaps.hpp"

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
      r.p[k - 1] = arm.p();
      r.R[k - 1] = arm.R();
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

}  // namespace steadyhand

#pragma once

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

/// Random arms with references around reachable poses, so that rows of every kind become active now and then.
struct RandomProblem {
  RandomProblem(int dof, unsigned seed, int horizon = 8, bool liquid = false)
      : RandomProblem([&](std::mt19937& from) { return random_arm(dof, from); }, seed, horizon, liquid) {}
  /// Of two arms, see random_tree; with liquids no joint slides, so that glasses can be upright.
  RandomProblem(int shared, int left, int right, unsigned seed, int horizon = 8, bool liquid = false)
      : RandomProblem([&](std::mt19937& from) { return random_tree(shared, left, right, from, !liquid); }, seed,
                      horizon, liquid) {}
  template <typename Maker>
  RandomProblem(const Maker& make_robot, unsigned seed, int horizon, bool liquid)
      : random(seed), model(make_robot(random)), ocp(model, settings(horizon, liquid)) {
    instance.weights = *ocp.weights({{"position", {500}},
                                     {"orientation", {5}},
                                     {"velocity", {0.1}},
                                     {"acceleration", {0.02}},
                                     {"lateral", {seed % 2 ? 10.0 : 0.0}},
                                     {"vertical", {seed % 3 ? 1.0 : 0.0}}});
    solution.prepare(ocp);
  }

  static OcpSettings settings(int horizon, bool liquid) {
    OcpSettings result;
    result.horizon = horizon;
    if (liquid) result.liquid.emplace();
    return result;
  }

  /// A start at rest that is clear of itself and a reference that moves to a pose nearby.
  void draw(double reach, double least_upright = 0.8) {
    Kinematics arm(model);
    JointVector q;
    do {
      q = random_joints(model.dof(), 2.0, random);
      arm.set_position(q);
    } while (clearance(arm) < 0.02 || (ocp.liquid() && !is_upright(arm, least_upright)));
    instance.x0 = StateVector::Zero(2 * model.dof());
    instance.x0.head(model.dof()) = q;
    if (ocp.liquid()) fill_glass(arm);
    arm.set_position(q + random_joints(model.dof(), reach, random));
    instance.reference.nodes = ocp.horizon();
    for (int t = 0; t < model.tool_count(); ++t) {
      instance.reference.tools[t].p.fill(arm.p(t));
      instance.reference.tools[t].R.fill(arm.R(t));
    }
    guess = Trajectory(model.dof(), ocp.horizon());
    for (StateVector& x : guess.x) x = instance.x0;
  }

  static bool is_upright(const Kinematics& arm, double least) {
    for (int t = 0; t < arm.tool_count(); ++t) {
      if (arm.R(t)(2, 2) < least) return false;
    }
    return true;
  }

  /// The liquid is nearly at rest in the tilted glass, and may be a little higher or lower.
  void fill_glass(const Kinematics& arm) {
    std::normal_distribution<double> normal;
    for (int t = 0; t < arm.tool_count(); ++t) {
      const Vector3 force = arm.R(t).transpose() * kGravity;
      LiquidInstance& liquid = instance.liquid[t];
      liquid.model = SloshModel(ocp.liquid()->glass, ocp.dt(), ocp.liquid()->frequencies);
      liquid.state = liquid.model.at_rest(force);
      for (double& number : liquid.state) number += 0.5 * normal(random);
      liquid.room = 1e-3 + 2e-3 * std::abs(normal(random)) + ocp.liquid()->glass.radius * force.head<2>().norm() / 9.81;
    }
  }

  std::mt19937 random;
  RobotModel model;
  Ocp ocp;
  OcpInstance instance;
  Trajectory guess;
  Solution solution;
};

}  // namespace steadyhand

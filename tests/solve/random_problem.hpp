#pragma once

#include "robot/random_arm.hpp"
#include "steadyhand/ocp/evaluation.hpp"
#include "steadyhand/robot/gaps.hpp"
#include "steadyhand/solve/solver.hpp"

namespace steadyhand {

/// Random arms with references around reachable poses, so that rows of every kind become active now and then.
struct RandomProblem {
  RandomProblem(int dof, unsigned seed, int horizon = 8)
      : random(seed), model(random_arm(dof, random)), ocp(model, settings(horizon)) {
    instance.weights = *ocp.weights({{"position", {500}},
                                     {"orientation", {5}},
                                     {"velocity", {0.1}},
                                     {"acceleration", {0.02}},
                                     {"lateral", {seed % 2 ? 10.0 : 0.0}},
                                     {"vertical", {seed % 3 ? 1.0 : 0.0}}});
    solution.prepare(ocp);
  }

  static OcpSettings settings(int horizon) {
    OcpSettings result;
    result.horizon = horizon;
    return result;
  }

  /// A start at rest that is clear of itself and a reference that moves to a pose nearby.
  void draw(double reach) {
    Kinematics arm(model);
    JointVector q;
    do {
      q = random_joints(model.dof(), 2.0, random);
      arm.set_position(q);
    } while (clearance(arm) < 0.02);
    instance.x0 = StateVector::Zero(2 * model.dof());
    instance.x0.head(model.dof()) = q;
    arm.set_position(q + random_joints(model.dof(), reach, random));
    instance.reference.nodes = ocp.horizon();
    for (int k = 0; k < ocp.horizon(); ++k) {
      instance.reference.p[k] = arm.p();
      instance.reference.R[k] = arm.R();
    }
    guess = Trajectory(model.dof(), ocp.horizon());
    for (StateVector& x : guess.x) x = instance.x0;
  }

  std::mt19937 random;
  RobotModel model;
  Ocp ocp;
  OcpInstance instance;
  Trajectory guess;
  Solution solution;
};

}  // namespace steadyhand

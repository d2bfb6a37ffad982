#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"

namespace steadyhand {
namespace {

TEST(AccelerationStep, WeighsTheFirstAccelerationAgainstWhatIsFollowed) {
  std::mt19937 random(5);
  const int n = 6;
  const RobotModel model = random_arm(n, random);
  OcpSettings settings;
  settings.horizon = 3;
  settings.weights["acceleration_step"] = {2.0};
  add_optional_objectives(settings);
  const Ocp ocp(model, settings);
  OcpInstance instance;
  instance.x0 = StateVector::Zero(2 * n);
  instance.reference.nodes = 3;
  for (int k = 0; k < 3; ++k) {
    instance.reference.tools[0].p[k].setZero();
    instance.reference.tools[0].R[k].setIdentity();
  }
  instance.weights = *ocp.weights(settings.weights);
  Evaluation evaluation(ocp);
  for (const bool moves : {false, true}) {
    SCOPED_TRACE(moves);
    if (moves) instance.u_followed = random_joints(n, 3.0, random);
    ASSERT_TRUE(ocp.check(instance));
    evaluation.set_instance(instance);
    const JointVector u = random_joints(n, 5.0, random), step = moves ? JointVector(u - instance.u_followed) : u;
    for (int k = 0; k < 3; ++k) evaluation.set_node(k, instance.x0, u);
    EXPECT_NEAR(evaluation.objective(0), ocp.dt() * 2.0 * step.squaredNorm(), 1e-12);
    EXPECT_EQ(evaluation.objective(1), 0.0);
    NodeGradient gradient = NodeGradient::Zero(3 * n);
    evaluation.add_objective_gradient(0, 1.0, gradient);
    evaluation.add_objective_gradient(2, 1.0, gradient);
    EXPECT_LT((gradient.tail(n) - ocp.dt() * 4.0 * step).norm() + gradient.head(2 * n).norm(), 1e-12);
    NodeHessian hessian = NodeHessian::Zero(3 * n, 3 * n);
    evaluation.add_objective_hessian(0, 1.0, hessian);
    EXPECT_LT((hessian.diagonal().tail(n).array() - ocp.dt() * 4.0).abs().maxCoeff(), 1e-12);
    EXPECT_NEAR(hessian.norm(), std::sqrt(double(n)) * ocp.dt() * 4.0, 1e-12);
  }
  instance.u_followed.conservativeResize(n - 1);
  EXPECT_FALSE(ocp.check(instance));
}

}  // namespace
}  // namespace steadyhand

#include "steadyhand/planning/solve/realtime/newton_system.hpp"

#include <gtest/gtest.h>

#include "planning/solve/random_problem.hpp"

namespace steadyhand {
namespace {

using realtime::NewtonSystem;

/// Models of two arms that nothing couples.
struct SeparateArms {
  SeparateArms(int left, int right, bool liquid, unsigned seed)
      : problem(0, left, right, seed, 5, liquid), steps(problem.model.tool_count()) {
    const int n = problem.model.dof(), entries = problem.ocp.entries();
    for (int k = 0; k <= problem.ocp.horizon(); ++k) {
      Eigen::MatrixXd& H = hessians.emplace_back(Eigen::MatrixXd::Zero(entries, entries));
      gradients.push_back(Eigen::VectorXd::Random(entries));
      for (const auto& [first, dof] : {std::pair(0, left), std::pair(left, right)}) {
        const Eigen::MatrixXd J = Eigen::MatrixXd::Random(3 * dof, 3 * dof);
        const Eigen::MatrixXd positive = J * J.transpose() + Eigen::MatrixXd::Identity(3 * dof, 3 * dof);
        for (int i = 0; i < 3 * dof; ++i) {
          for (int j = 0; j < 3 * dof; ++j)
            H(i / dof * n + first + i % dof, j / dof * n + first + j % dof) = positive(i, j);
        }
      }
      for (int i = 3 * n; i < entries; ++i) H(i, i) = 1.0;
    }
    if (!liquid) return;
    const SloshModel model(problem.ocp.liquid()->glass, problem.ocp.dt(), problem.ocp.liquid()->frequencies);
    for (int t = 0; t < problem.model.tool_count(); ++t) {
      for (int k = 0; k < problem.ocp.horizon(); ++k) {
        SloshStep& step = steps[t].emplace_back();
        model.set_step(kGravity + Vector3::Random(), true, step);
        step.differentiate(SloshState::Random());
        step.by_motion.setZero(3, 3 * n);
        for (int i = 0; i < 3; ++i) {
          step.by_motion.middleCols(i * n + (t == 0 ? 0 : left), t == 0 ? left : right).setRandom();
        }
      }
    }
  }

  realtime::NodeTable step(bool separate) {
    NewtonSystem newton(problem.ocp);
    const int n = problem.model.dof(), entries = problem.ocp.entries();
    const NodeHessianOf<Lanes> none(entries, entries), none_of_motion(3 * n, 3 * n);
    realtime::Riccati::Steps sources{};
    for (std::size_t t = 0; t < steps.size(); ++t) sources[t] = steps[t].empty() ? nullptr : steps[t].data();
    newton.set_sources(sources, none, NodeGradientOf<Lanes>::Zero(entries), none_of_motion);
    newton.separate(separate);
    EXPECT_EQ(newton.is_separate(), separate);
    for (auto& part : newton.parts()) {
      realtime::Riccati& riccati = part.riccati;
      for (int k = 0; k <= problem.ocp.horizon(); ++k) {
        for (int i = 0; i < riccati.size(); ++i) {
          for (int j = i; j < riccati.size(); ++j)
            riccati.row(k, i)[j] = hessians[k](riccati.entries()[i], riccati.entries()[j]);
          riccati.row(k, i)[riccati.gradient()] = gradients[k][riccati.entries()[i]];
        }
      }
    }
    EXPECT_TRUE(newton.factorise(1e-10));
    realtime::NodeTable result(entries, {problem.ocp.horizon()});
    newton.solve(result);
    return result;
  }

  RandomProblem problem;
  std::vector<std::vector<SloshStep>> steps;
  std::vector<Eigen::MatrixXd> hessians;
  std::vector<Eigen::VectorXd> gradients;
};

/// The whole is solved by the kernel for any number of joints and liquids, each arm by the one for its own number.
TEST(NewtonSystem, SolvesArmsByThemselvesAsTheWhole) {
  for (const auto& [left, right] : {std::pair(6, 6), std::pair(2, 7), std::pair(8, 8), std::pair(5, 4)}) {
    for (const bool liquid : {false, true}) {
      SeparateArms arms(left, right, liquid, 1 + left);
      const realtime::NodeTable each = arms.step(true), whole = arms.step(false);
      double largest = 0.0;
      for (int i = 0; i < arms.problem.ocp.entries(); ++i) {
        for (int k = 0; k <= arms.problem.ocp.horizon(); ++k) {
          if (i >= 2 * (left + right) && i < 3 * (left + right) && k == arms.problem.ocp.horizon()) continue;
          EXPECT_NEAR(each.at(i, k), whole.at(i, k), 1e-8) << "entry " << i << " of node " << k;
          largest = std::max(largest, std::abs(each.at(i, k)));
        }
      }
      EXPECT_GT(largest, 0.1);
    }
  }
}

TEST(NewtonSystem, SeesWhatCouplesArms) {
  RandomProblem problem(0, 2, 3, 1);
  const NewtonSystem newton(problem.ocp);
  NodeHessianOf<Lanes> H(15, 15);
  for (const int i : {0, 1, 5, 6, 10, 11}) H(i, i) = 1.0;
  H(0, 6) = H(2, 14) = 2.0;
  EXPECT_FALSE(newton.couples(H));
  for (const auto& [i, j] : {std::pair(0, 2), std::pair(1, 9), std::pair(7, 11), std::pair(2, 6)}) {
    H(i, j).set(kLanes - 1, -1e-300);
    EXPECT_TRUE(newton.couples(H)) << i << ", " << j;
    H(i, j) = 0.0;
  }
  const RandomProblem shared(1, 2, 3, 1);
  NewtonSystem with_torso(shared.ocp);
  EXPECT_FALSE(with_torso.is_separate());
  with_torso.set_given(JointSet().set(0));
  EXPECT_TRUE(with_torso.is_separate());
}

}  // namespace
}  // namespace steadyhand

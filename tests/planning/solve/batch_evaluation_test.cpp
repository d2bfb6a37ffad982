#include "steadyhand/planning/solve/realtime/batch_evaluation.hpp"

#include <gtest/gtest.h>

#include "planning/solve/random_problem.hpp"
#include "steadyhand/planning/solve/realtime/log_sum.hpp"

namespace steadyhand {
namespace {

using realtime::BatchEvaluation;
using realtime::Curvature;
using realtime::NodeOrder;
using realtime::NodeTable;

/// A random point of a random problem, node by node and in batches.
struct Fixture {
  Fixture(int dof, int horizon, unsigned seed)
      : problem(dof, seed, horizon), single(problem.ocp), batch(problem.ocp), order{horizon}, z(3 * dof, order) {
    problem.draw(0.3);
    Trajectory point(dof, horizon);
    point.x[0] = problem.instance.x0;
    for (int k = 0; k < horizon; ++k) {
      point.u[k] = random_joints(dof, 5.0, problem.random);
      point.x[k + 1] << random_joints(dof, 2.0, problem.random), random_joints(dof, 2.0, problem.random);
    }
    for (int column = 0; column < order.columns(); ++column) {
      const int k = order.node(column);
      for (int i = 0; i < 3 * dof; ++i) {
        const double number = i < 2 * dof ? point.x[k][i] : k < horizon ? point.u[k][i - 2 * dof] : 0.0;
        z[i][column / kLanes].set(column % kLanes, number);
      }
    }
    single.set_instance(problem.instance);
    single.set_trajectory(point);
    batch.set_instance(problem.instance);
    batch.set_point(z);
  }

  RandomProblem problem;
  Evaluation single;
  BatchEvaluation batch;
  NodeOrder order;
  NodeTable z;
};

class BatchesOf : public testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(BatchesOf, TermsAreThoseOfSingleNodes) {
  const auto [dof, horizon] = GetParam();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Fixture f(dof, horizon, seed);
    double objective = 0.0;
    for (int k = 0; k <= horizon; ++k) objective += f.single.objective(k);
    EXPECT_NEAR(f.batch.objective(), objective, 1e-12 * std::abs(objective));
    for (int b = 0; b < f.batch.batches(); ++b) {
      NodeGradientOf<Lanes> gradient = NodeGradientOf<Lanes>::Zero(3 * dof);
      NodeHessianOf<Lanes> exact = NodeHessianOf<Lanes>::Zero(3 * dof, 3 * dof), convex = exact;
      f.batch.add_objective_gradient(b, gradient);
      f.batch.add_objective_hessian(b, Curvature::kExact, exact);
      f.batch.add_objective_hessian(b, Curvature::kConvex, convex);
      for (int lane = 0; lane < kLanes && b * kLanes + lane <= horizon; ++lane) {
        const int k = f.order.node(b * kLanes + lane);
        const auto expect_lane = [&](const auto& all, const auto& one, const char* what) {
          const auto n = one.rows(), first = k > 0 ? 0 : n - dof;  // of node 0, whose state is given, u counts
          for (auto j = one.cols() > 1 ? first : 0; j < one.cols(); ++j) {
            for (auto i = first; i < n; ++i) {
              ASSERT_NEAR(all(i, j)[lane], one(i, j), 1e-11 * (1.0 + one.norm())) << what << ", node " << k;
            }
          }
        };
        NodeGradient g = NodeGradient::Zero(3 * dof);
        f.single.add_objective_gradient(k, 1.0, g);
        expect_lane(gradient, g, "gradient");
        NodeHessian H = NodeHessian::Zero(3 * dof, 3 * dof);
        f.single.add_objective_hessian(k, 1.0, H);
        expect_lane(exact, H, "Hessian");
        H.setZero();
        f.single.add_objective_convex_hessian(k, 1.0, H);
        expect_lane(convex, H, "convex Hessian");
        for (const ConstraintRow row : f.single.rows(k)) {
          ASSERT_NEAR(f.batch.constraint(b, row)[lane], f.single.constraint(k, row), 1e-12);
          NodeGradientOf<Lanes> rows = NodeGradientOf<Lanes>::Zero(3 * dof);
          f.batch.add_constraint_gradient(b, row, rows);
          g.setZero();
          f.single.add_constraint_gradient(k, row, 1.0, g);
          expect_lane(rows, g, "row gradient");
          const auto [first, last] = f.problem.ocp.constraints()[row.constraint]->support(row.row, dof);
          for (int i = 0; i < 3 * dof; ++i) {
            if (i < first || i >= last) {
              ASSERT_EQ(g[i], 0.0) << "outside its support";
            }
          }
          NodeHessianOf<Lanes> curvature = NodeHessianOf<Lanes>::Zero(3 * dof, 3 * dof);
          f.batch.add_constraint_hessian(b, row, 0.7, curvature);
          H.setZero();
          f.single.add_constraint_hessian(k, row, 0.7, H);
          expect_lane(curvature, H, "row Hessian");
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(JointsAndHorizon, BatchesOf,
                         testing::Combine(testing::Values(1, 3, 6, 8), testing::Values(1, 3, 8, 9)));

/// A term without an implementation for batches.
class Plain final : public Objective {
 public:
  explicit Plain(const Objective& term) : Objective({.name = "plain", .label = "Plain", .unit = "1"}), term_(term) {}
  Nodes nodes() const override { return term_.nodes(); }
  double value(const Node& node, const JointVector& weight) const override { return term_.value(node, weight); }
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    term_.add_gradient(node, weight, gradient);
  }
  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    term_.add_hessian(node, weight, hessian);
  }
  using Objective::add_gradient, Objective::add_hessian, Objective::value;

 private:
  const Objective& term_;
};

TEST(Batches, TermsThatKnowSingleNodesWork) {
  constexpr int kDof = 6;
  std::mt19937 random(3);
  const RobotModel model = random_arm(kDof, random);
  Kinematics scratch(model);
  KinematicsOf<Lanes> arm(model);
  JointVectorOf<Lanes> q(kDof), dq(kDof), u(kDof);
  for (auto* numbers : {&q, &dq, &u}) {
    for (int i = 0; i < kDof; ++i) {
      for (int lane = 0; lane < kLanes; ++lane) (*numbers)[i].set(lane, random_joints(1, 2.0, random)[0]);
    }
  }
  arm.set_position(q);
  arm.set_motion(dq, u);
  const ReferencePoseOf<Lanes> reference{Vector3Of<Lanes>(0.1, 0.2, 0.3)};
  const Lanes time = 0.0;
  const NearObstacles near;
  const NodeBatch nodes{{arm, dq, u, &reference, time, near}, scratch};
  for (const auto& term : default_objectives()) {
    const Plain plain(*term);
    Objective::BatchWeight weight(term->weight_count(model));
    for (int i = 0; i < weight.size(); ++i) weight[i] = 0.5 + i;
    NodeGradientOf<Lanes> g = NodeGradientOf<Lanes>::Zero(3 * kDof), g_plain = g;
    NodeHessianOf<Lanes> H = NodeHessianOf<Lanes>::Zero(3 * kDof, 3 * kDof), H_plain = H;
    term->add_gradient(nodes, weight, g);
    plain.add_gradient(nodes, weight, g_plain);
    term->add_hessian(nodes, weight, H);
    plain.add_hessian(nodes, weight, H_plain);
    for (int lane = 0; lane < kLanes; ++lane) {
      const double value = plain.value(nodes, weight)[lane];
      EXPECT_NEAR(term->value(nodes, weight)[lane], value, 1e-12 * (1.0 + value));
      for (int i = 0; i < g.size(); ++i) EXPECT_NEAR(g[i][lane], g_plain[i][lane], 1e-10);
      for (int i = 0; i < H.size(); ++i) EXPECT_NEAR(H.data()[i][lane], H_plain.data()[i][lane], 1e-9);
    }
  }
}

TEST(LogSum, IsTheSumOfLogarithms) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> exponent(-30.0, 30.0);
  realtime::LogSum logs;
  double expected = 0.0;
  for (int i = 0; i < 10000; ++i) {
    Lanes factor = 1.0;
    for (int lane = 0; lane < kLanes; ++lane) {
      factor.set(lane, std::pow(10.0, exponent(random)));
      expected += std::log(factor[lane]);
    }
    logs.add(factor);
    ASSERT_NEAR(logs.value(), expected, 1e-10 * (1.0 + i));
  }
}

}  // namespace
}  // namespace steadyhand

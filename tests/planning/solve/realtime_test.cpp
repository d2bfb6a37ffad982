#include "steadyhand/planning/solve/realtime/realtime.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdlib>
#include <limits>

#include "planning/solve/random_problem.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/realtime/newton_system.hpp"
#include "steadyhand/planning/solve/solver.hpp"

#ifndef __SANITIZE_ADDRESS__
namespace {
long allocations = 0;
}
extern "C" void* __libc_malloc(std::size_t size);
/// Replaces the C library's, to count every allocation of this program, Eigen's too.
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace steadyhand {
namespace {

using realtime::NodeTable;
using realtime::Riccati;

constexpr double kTolerance = 1e-6;

/// Random quadratic models of all nodes, and the same problem as one dense system in the accelerations.
struct RandomQuadratic {
  RandomQuadratic(int dof, int liquids, int horizon, bool convex, std::mt19937& random)
      : n(dof), s(liquids * kSloshStates), N(horizon), steps(liquids) {
    std::normal_distribution<double> normal;
    const int size = 3 * n + s;
    for (int i = 0; i < liquids * N; ++i) {
      SloshStep& step = steps[i / N].emplace_back();
      for (double& number : step.transition.value) number = 0.5 * normal(random);
      step.by_force = step.by_force.NullaryExpr([&] { return 0.5 * normal(random); });
      step.by_motion = Eigen::MatrixXd::NullaryExpr(3, 3 * n, [&] { return 0.5 * normal(random); });
    }
    dense = Eigen::MatrixXd::Zero(n * N, n * N);
    gradient = Eigen::VectorXd::Zero(n * N);
    for (int k = 0; k <= N; ++k) {
      const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); });
      models.push_back(root * root.transpose());
      if (!convex) models.back() -= 1e3 * Eigen::MatrixXd::Identity(size, size);
      gradients.push_back(Eigen::VectorXd::NullaryExpr(size, [&] { return normal(random); }));
      const Eigen::MatrixXd to_node = map(k);
      dense += to_node.transpose() * models[k] * to_node;
      gradient += to_node.transpose() * gradients[k];
    }
  }

  /// dw_k = [du_k; dq_k; ddq_k; ds_k] of all accelerations.
  Eigen::MatrixXd map(int k) const {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * n + s, n * N);
    if (k < N) result.block(0, n * k, n, n).setIdentity();
    for (int j = 0; j < k; ++j) {
      result.block(n, n * j, n, n).diagonal().setConstant(dt * dt * (k - j - 0.5));
      result.block(2 * n, n * j, n, n).diagonal().setConstant(dt);
    }
    for (std::size_t t = 0; t < steps.size() && k > 0; ++t) {
      const SloshStep& step = steps[t][k - 1];
      const int begin = slosh_begin(n, static_cast<int>(t));
      const Eigen::MatrixXd before = map(k - 1);
      Eigen::MatrixXd arm(3 * n, n * N);  // [dq; ddq; du]
      arm << before.middleRows(n, 2 * n), before.topRows(n);
      for (int j = 0; j < kSloshStates; ++j) {
        result.row(begin + j) =
            step.pull_back(SloshState::Unit(j)).transpose() * before.middleRows(begin, kSloshStates);
      }
      result.middleRows(begin, kSloshStates) += step.by_force * step.by_motion * arm;
    }
    return result;
  }

  Riccati riccati() const { return {{0, n, 0, std::max(1, s / kSloshStates)}, n, s > 0, N, dt}; }
  void fill(Riccati& system) const {
    Riccati::Steps sources{};
    for (std::size_t t = 0; t < steps.size(); ++t) sources[t] = steps[t].data();
    system.use_slosh(sources);
    for (int k = 0; k <= N; ++k) {
      for (int i = 0; i < 3 * n + s; ++i) {
        for (int j = 0; j < 3 * n + s; ++j) system.row(k, i)[j] = models[k](i, j);
        system.row(k, i)[system.gradient()] = gradients[k][i];
      }
    }
  }

  static constexpr double dt = 0.05;
  int n, s, N;
  std::vector<std::vector<SloshStep>> steps;  ///< by liquid and interval
  std::vector<Eigen::MatrixXd> models;
  std::vector<Eigen::VectorXd> gradients;
  Eigen::MatrixXd dense;
  Eigen::VectorXd gradient;
};

TEST(Riccati, AgreesWithTheDenseSystem) {
  std::mt19937 random(1);
  for (int n = 1; n <= kMaxJoints; ++n) {
    for (const auto& [N, liquids] :
         {std::pair(1, 0), {2, 0}, {3, 0}, {7, 0}, {12, 0}, {1, 1}, {2, 1}, {5, 1}, {1, 2}, {2, 2}, {4, 2}}) {
      const RandomQuadratic quadratic(n, liquids, N, true, random);
      const int s = quadratic.s;
      Riccati system = quadratic.riccati();
      quadratic.fill(system);
      ASSERT_TRUE(system.factorise(0.0));
      NodeTable step(3 * n + s, {N});
      system.solve(step);
      const Eigen::VectorXd expected = quadratic.dense.llt().solve(-quadratic.gradient);
      for (int k = 0; k <= N; ++k) {
        const Eigen::VectorXd w = quadratic.map(k) * expected;
        for (int i = 0; i < n; ++i) {
          if (k < N) {
            EXPECT_NEAR(step.at(2 * n + i, k), w[i], 1e-8 * (1.0 + expected.norm())) << n << " " << N;
          }
          EXPECT_NEAR(step.at(i, k), w[n + i], 1e-8 * (1.0 + expected.norm()));
          EXPECT_NEAR(step.at(n + i, k), w[2 * n + i], 1e-8 * (1.0 + expected.norm()));
        }
        for (int i = 3 * n; i < 3 * n + s; ++i) EXPECT_NEAR(step.at(i, k), w[i], 1e-8 * (1.0 + expected.norm()));
      }
    }
  }
}

TEST(Riccati, RefusesAnIndefiniteHessian) {
  std::mt19937 random(2);
  for (int n = 1; n <= kMaxJoints; ++n) {
    const RandomQuadratic quadratic(n, 0, 4, false, random);
    Riccati system = quadratic.riccati();
    quadratic.fill(system);
    EXPECT_FALSE(system.factorise(0.0));
  }
}

void expect_same_bits(const Solution& a, const Solution& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_EQ(a.objective, b.objective);
  EXPECT_EQ(a.kkt_error, b.kkt_error);
  EXPECT_TRUE(a.trajectory.u == b.trajectory.u);
  EXPECT_TRUE(a.multipliers == b.multipliers);
}

/// Nothing of an earlier solve may leak into a later one.
TEST(Realtime, SameInputSameBits) {
  RandomProblem problem(5, 5);
  const auto used = make_realtime_solver(problem.ocp, kTolerance);
  Solution again;
  again.prepare(problem.ocp);
  for (int trial = 0; trial < 10; ++trial) {
    problem.draw(0.3);
    used->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
    make_realtime_solver(problem.ocp, kTolerance)->solve(problem.instance, problem.guess, nullptr, {}, again);
    expect_same_bits(problem.solution, again);
  }
}

#ifndef __SANITIZE_ADDRESS__
TEST(Realtime, AllocatesNothingInSolve) {
  RandomProblem problem(6, 3);
  const auto solver = make_realtime_solver(problem.ocp, kTolerance);
  for (int trial = 0; trial < 5; ++trial) {
    problem.draw(0.3);
    const long before = allocations;
    solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
    EXPECT_EQ(allocations, before);
  }
  const long before = allocations;
  void* volatile kept = std::malloc(10);  // that the compiler may not leave out
  std::free(kept);
  EXPECT_GT(allocations, before) << "the guard does not count";
}
#endif

/// For any budget: inside the constraints if the guess was, never worse than the guess, and the status claims no more
/// than is true.
TEST(Realtime, BudgetGivesTheBestFeasible) {
  int unfinished = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    RandomProblem problem(static_cast<int>(seed), seed);
    const auto solver = make_realtime_solver(problem.ocp, kTolerance);
    Evaluation evaluation(problem.ocp);
    for (int trial = 0; trial < 3; ++trial) {
      problem.draw(0.3);
      evaluation.set_instance(problem.instance);
      evaluation.set_trajectory(problem.guess);
      double at_guess = 0.0;
      for (int k = 0; k <= problem.ocp.horizon(); ++k) at_guess += evaluation.objective(k);
      for (int iterations = 0; iterations < 12; ++iterations) {
        SolveBudget budget;
        budget.iterations = iterations;
        Solution& solution = problem.solution;
        solver->solve(problem.instance, problem.guess, nullptr, budget, solution);
        EXPECT_LE(solution.iterations, iterations);
        EXPECT_LE(solution.violation, kTolerance);
        EXPECT_LE(solution.objective, at_guess * (1.0 + 1e-9));
        EXPECT_EQ(solution.status == SolveStatus::kSolved, solution.kkt_error <= kTolerance);
        EXPECT_NE(solution.status, SolveStatus::kInfeasible);
        unfinished += solution.status == SolveStatus::kFeasible;
      }
      SolveBudget blink;
      blink.time_us = 1e-3;
      solver->solve(problem.instance, problem.guess, nullptr, blink, problem.solution);
      EXPECT_LE(problem.solution.iterations, 1);
      EXPECT_LE(problem.solution.violation, kTolerance);
    }
  }
  EXPECT_GT(unfinished, 50);
}

TEST(Realtime, SaysWhenNothingIsFeasible) {
  RandomProblem problem(4, 4);
  const auto solver = make_realtime_solver(problem.ocp, kTolerance);
  problem.draw(0.3);
  problem.instance.x0[1] = problem.model.position_max[1] + 2.0;  // no acceleration brings it back within one step
  solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
  EXPECT_EQ(problem.solution.status, SolveStatus::kInfeasible);
  EXPECT_GT(problem.solution.violation, 1.0);
  for (const JointVector& u : problem.solution.trajectory.u) EXPECT_TRUE(u.allFinite());
}

TEST(Realtime, RefusesNumbersThatAreNotFinite) {
  RandomProblem problem(3, 3);
  const auto solver = make_realtime_solver(problem.ocp, kTolerance);
  problem.draw(0.1);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    OcpInstance instance = problem.instance;
    instance.x0[0] = bad;
    solver->solve(instance, problem.guess, nullptr, {}, problem.solution);
    EXPECT_EQ(problem.solution.status, SolveStatus::kInvalid);
    Trajectory guess = problem.guess;
    guess.u[2][1] = bad;
    solver->solve(problem.instance, guess, nullptr, {}, problem.solution);
    EXPECT_EQ(problem.solution.status, SolveStatus::kInvalid);
    Multipliers multipliers = problem.solution.multipliers;
    multipliers.set(1, {0, 0}, bad);
    solver->solve(problem.instance, problem.guess, &multipliers, {}, problem.solution);
    EXPECT_EQ(problem.solution.status, SolveStatus::kInvalid);
  }
}

/// A solution with its multipliers as the start: next to nothing is left to do.
TEST(Realtime, WarmStartsFromItsSolution) {
  int cold = 0, warm = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    RandomProblem problem(static_cast<int>(seed), seed);
    const auto solver = make_realtime_solver(problem.ocp, kTolerance);
    for (int trial = 0; trial < 4; ++trial) {
      problem.draw(0.2);
      solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
      if (problem.solution.status != SolveStatus::kSolved) continue;
      cold += problem.solution.iterations;
      const Solution first = problem.solution;
      solver->solve(problem.instance, first.trajectory, &first.multipliers, {}, problem.solution);
      EXPECT_EQ(problem.solution.status, SolveStatus::kSolved);
      EXPECT_NEAR(problem.solution.objective, first.objective, 1e-4 * std::abs(first.objective));
      warm += problem.solution.iterations;
    }
  }
  EXPECT_LT(2 * warm, cold);
}

/// Long, short and eight-joint problems reach KKT points too, with every pair checked.
TEST(Realtime, SolvesAllSizes) {
  for (const int N : {1, 2, 5, 16, 33}) {
    for (const int dof : {1, 3, 6, 8}) {
      RandomProblem problem(dof, 10 * dof, N);
      const auto solver = make_realtime_solver(problem.ocp, kTolerance);
      problem.draw(0.1);
      solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
      EXPECT_EQ(problem.solution.status, SolveStatus::kSolved) << "N " << N << ", joints " << dof;
      EXPECT_LE(problem.solution.kkt_error, kTolerance);
    }
  }
}

}  // namespace
}  // namespace steadyhand

#include <gtest/gtest.h>

#include "planning/solve/random_problem.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {
namespace {

constexpr double kSolveTolerance = 1e-6;

class EverySolver : public testing::TestWithParam<std::string> {};

TEST_P(EverySolver, ReachesKktPoints) {
  int solved = 0, problems = 0, active = 0;
  for (unsigned seed = 1; seed <= 36; ++seed) {
    const int n = static_cast<int>(seed % 8);
    RandomProblem problem = seed <= 24 ? RandomProblem(1 + n, seed) : RandomProblem(n % 3, 2 + n / 2, 5, seed);
    auto solver = *make_solver(GetParam(), problem.ocp, kSolveTolerance);
    for (int trial = 0; trial < 10; ++trial, ++problems) {
      problem.draw(0.3);
      solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
      if (problem.solution.status != SolveStatus::kSolved) continue;
      ++solved;
      EXPECT_LT(problem.solution.violation, kSolveTolerance);
      EXPECT_LT(problem.solution.kkt_error, 1e-4) << "seed " << seed << " trial " << trial;
      const Multipliers& multipliers = problem.solution.multipliers;
      for (const int r : multipliers.stored()) {
        for (int k = 0; k <= problem.ocp.horizon(); ++k) active += std::abs(multipliers.find(r)[k]) > 1e-3;
      }
    }
  }
  EXPECT_GE(solved, problems * 95 / 100);
  EXPECT_GT(active, 100);  // or the test would not test constraints
  std::cout << solved << " of " << problems << " solved, " << active << " active rows\n";
}

/// Starts so near to a position limit, and so fast, that a joint must turn back before node 1.
TEST_P(EverySolver, TurnsBackWithinTheFirstInterval) {
  int solved = 0, problems = 0, turning = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    RandomProblem problem(1 + static_cast<int>(seed % 8), seed);
    const int n = problem.model.dof();
    OcpSettings settings = RandomProblem::settings(8, false);
    settings.position_margin = JointVector::Zero(n);
    const Ocp ocp(problem.model, settings);
    auto solver = *make_solver(GetParam(), ocp, kSolveTolerance);
    problem.solution.prepare(ocp);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int trial = 0; trial < 10; ++trial, ++problems) {
      problem.draw(0.3);
      const int joint = trial % n;
      const double brake = 2.0 + 12.0 * unit(problem.random), dq = 0.5 * brake * ocp.dt();  // back at q_0 by node 1
      StateVector& x0 = problem.instance.x0;
      x0[joint] = problem.model.position_max[joint] - dq * dq / (2.0 * brake);
      x0[n + joint] = dq;
      for (StateVector& x : problem.guess.x) x = x0;
      solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
      if (problem.solution.status != SolveStatus::kSolved) continue;
      ++solved;
      EXPECT_LT(problem.solution.kkt_error, 1e-4) << "seed " << seed << " trial " << trial;
      const JointVector& u = problem.solution.trajectory.u[0];
      EXPECT_LE(u[joint], -(1.0 - 2e-3) * brake);  // the room counts as 1e-6 more
      turning += u[joint] > -1.01 * brake;
    }
  }
  std::cout << solved << " of " << problems << " solved, " << turning << " turn back at their bounds\n";
  EXPECT_GE(solved, problems * 9 / 10);
  EXPECT_GT(turning, problems / 10);
}

/// In a glass on its head the liquid's state grows beyond all bounds: a solver gives up, and does not go on for ever.
TEST_P(EverySolver, EndsWhereTheLiquidFallsOut) {
  if (std::string_view(GetParam()) == "fatrop")
    GTEST_SKIP() << "FATROP's search for a direction may go on without end here";
  for (unsigned seed = 1; seed <= 6; ++seed) {
    RandomProblem problem(3 + static_cast<int>(seed % 6), seed, 16, true);
    auto solver = *make_solver(GetParam(), problem.ocp, kSolveTolerance);
    for (int trial = 0; trial < 6; ++trial) {
      problem.draw(0.3, -1.0);
      problem.instance.liquid[0].state *= trial % 2 == 0 ? 1.0 : 100.0;
      solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
      EXPECT_GE(problem.solution.iterations, 0);
    }
  }
}

/// Rows with a penalty weight may be outside their bounds in a solution; inside them the conditions on multipliers are
/// as usual.
TEST_P(EverySolver, ReachesKktPointsWithALiquid) {
  int solved = 0, problems = 0, active = 0, outside = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const int n = static_cast<int>(seed % 6);
    RandomProblem problem = seed <= 8 ? RandomProblem(3 + n, seed, 8, true) : RandomProblem(n % 2, 3, 5, seed, 8, true);
    auto solver = *make_solver(GetParam(), problem.ocp, kSolveTolerance);
    for (int trial = 0; trial < 10; ++trial, ++problems) {
      problem.draw(0.3, problem.model.tool_count() > 1 ? 0.5 : 0.8);
      solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
      if (problem.solution.status != SolveStatus::kSolved) continue;
      ++solved;
      Evaluation evaluation(problem.ocp);
      evaluation.set_instance(problem.instance);
      evaluation.set_trajectory(problem.solution.trajectory);
      EXPECT_LT(kkt_error(evaluation, problem.solution.trajectory, problem.solution.multipliers), 1e-4)
          << "seed " << seed << " trial " << trial;
      double objective = 0.0;
      for (int k = 0; k <= problem.ocp.horizon(); ++k) {
        objective += evaluation.objective(k) + evaluation.price(k);
        outside += evaluation.price(k) > 1e-3;
        for (std::size_t i = 0; i < evaluation.rows(k).size(); ++i) {
          const auto& constraint = *problem.ocp.constraints()[evaluation.rows(k)[i].constraint];
          const double multiplier = problem.solution.multipliers.at(k, evaluation.rows(k)[i]);
          active += constraint.name() == "no_spill" && multiplier > 1e-3 && multiplier < 0.99 * constraint.price(0);
        }
      }
      EXPECT_NEAR(problem.solution.objective, objective, 1e-6 * (1.0 + objective));
    }
  }
  std::cout << solved << " of " << problems << " solved, " << active << " waves at their bounds, " << outside
            << " nodes beyond\n";
  EXPECT_GE(solved, problems * 95 / 100);
  EXPECT_GT(active, 100);
  EXPECT_GT(outside, 10);
}

TEST(Solvers, AreListedWithWhatABuildLeavesOut) {
  for (const std::string& name : solver_names()) EXPECT_NE(list_solvers().find(name), std::string::npos);
  EXPECT_NE(list_solvers().find("fatrop"), std::string::npos);
  EXPECT_EQ(list_solvers().find("STEADYHAND_WITH_FATROP=ON") == std::string::npos, solver_names().size() == 2);
}

INSTANTIATE_TEST_SUITE_P(Registered, EverySolver, testing::ValuesIn(solver_names()));

}  // namespace
}  // namespace steadyhand

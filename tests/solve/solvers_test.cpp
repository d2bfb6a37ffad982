#include <gtest/gtest.h>

#include "solve/random_problem.hpp"
#include "steadyhand/solve/solver.hpp"

namespace steadyhand {
namespace {

constexpr double kSolveTolerance = 1e-6;

class EverySolver : public testing::TestWithParam<std::string> {};

TEST_P(EverySolver, ReachesKktPoints) {
  int solved = 0, problems = 0, active = 0;
  for (unsigned seed = 1; seed <= 24; ++seed) {
    RandomProblem problem(1 + static_cast<int>(seed % 8), seed);
    auto solver = *make_solver(GetParam(), problem.ocp, kSolveTolerance);
    for (int trial = 0; trial < 10; ++trial, ++problems) {
      problem.draw(0.3);
      solver->solve(problem.instance, problem.guess, nullptr, {}, problem.solution);
      if (problem.solution.status != SolveStatus::kSolved) continue;
      ++solved;
      EXPECT_LT(problem.solution.violation, kSolveTolerance);
      EXPECT_LT(problem.solution.kkt_error, 1e-4) << "seed " << seed << " trial " << trial;
      for (const auto& node : problem.solution.multipliers) {
        for (const double multiplier : node) active += std::abs(multiplier) > 1e-3;
      }
    }
  }
  EXPECT_GE(solved, problems * 95 / 100);
  EXPECT_GT(active, 100);  // or the test would not test constraints
  std::cout << solved << " of " << problems << " solved, " << active << " active rows\n";
}

INSTANTIATE_TEST_SUITE_P(Registered, EverySolver, testing::ValuesIn(solver_names()));

}  // namespace
}  // namespace steadyhand

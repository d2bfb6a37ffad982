#include <gtest/gtest.h>

#include "steadyhand/files/config/open.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/realtime/realtime.hpp"
#include "steadyhand/planning/solve/solver.hpp"
#include "support/problem_set.hpp"

namespace steadyhand {
namespace {

/// Problems of closed loops (`bench_solvers --keep`, 360,000 solves) that took the solver before most: 83 to 1000
/// iterations, 180 in the mean. One was not solved.
class HardProblems : public testing::Test {
 protected:
  void SetUp() override {
    auto robot = open_robot("ur5e");
    ASSERT_TRUE(robot) << robot.error().message;
    model_ = *std::move(robot);
    auto problems = read_problem_set(STEADYHAND_ROOT "/tests/planning/solve/hard_problems.txt", model_.dof());
    ASSERT_TRUE(problems) << problems.error().message;
    problems_ = *std::move(problems);
    ASSERT_EQ(problems_.size(), 48u);
  }

  /// Calls f(ocp, problem, multipliers) with each, the instance complete.
  template <typename F>
  void for_each(const F& f) {
    for (PosedProblem& problem : problems_) {
      const auto profile = load_profile(problem.profile);
      ASSERT_TRUE(profile) << profile.error().message;
      OcpSettings settings = profile->ocp;
      settings.horizon = problem.horizon;
      const Ocp ocp(model_, settings);
      problem.instance.weights = *ocp.weights(problem.weights);
      f(ocp, problem, kept_multipliers(problem, ocp));
    }
  }

  static constexpr double kTolerance = 1e-6;
  RobotModel model_;
  std::vector<PosedProblem> problems_;
};

TEST_F(HardProblems, AreSolved) {
  int most = 0, all = 0;
  for_each([&](const Ocp& ocp, const PosedProblem& problem, const Multipliers& multipliers) {
    Solution solution;
    solution.prepare(ocp);
    make_realtime_solver(ocp, kTolerance)->solve(problem.instance, problem.guess, &multipliers, {}, solution);
    EXPECT_EQ(solution.status, SolveStatus::kSolved) << problem.name;
    Evaluation evaluation(ocp);
    evaluation.set_instance(problem.instance);
    evaluation.set_trajectory(solution.trajectory);
    EXPECT_LT(kkt_error(evaluation, solution.trajectory, solution.multipliers), 1e-5) << problem.name;
    most = std::max(most, solution.iterations);
    all += solution.iterations;
  });
  std::cout << all << " iterations, at most " << most << "\n";
  EXPECT_LE(most, 120);
  EXPECT_LE(all, 60 * 48);
}

/// If the cap is met, the result is inside all constraints, or its status says that it is not.
TEST_F(HardProblems, CutShortSayWhatTheyAre) {
  int cut = 0;
  for_each([&](const Ocp& ocp, const PosedProblem& problem, const Multipliers& multipliers) {
    const auto solver = make_realtime_solver(ocp, kTolerance);
    Solution solution;
    solution.prepare(ocp);
    Evaluation evaluation(ocp);
    evaluation.set_instance(problem.instance);
    for (const int iterations : {0, 1, 4, 16}) {
      SolveBudget budget;
      budget.iterations = iterations;
      solver->solve(problem.instance, problem.guess, &multipliers, budget, solution);
      EXPECT_LE(solution.iterations, iterations);
      evaluation.set_trajectory(solution.trajectory);
      EXPECT_NEAR(evaluation.violation(), solution.violation, 1e-9);
      EXPECT_EQ(solution.status == SolveStatus::kInfeasible, solution.violation > kTolerance) << problem.name;
      cut += solution.status != SolveStatus::kSolved;
    }
  });
  EXPECT_GT(cut, 48 * 2);
}

}  // namespace
}  // namespace steadyhand

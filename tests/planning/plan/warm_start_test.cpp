#include "steadyhand/planning/plan/warm_start.hpp"

#include <gtest/gtest.h>

#include "planning/solve/random_problem.hpp"

namespace steadyhand {
namespace {

/// A solution whose accelerations and multipliers encode where they come from.
struct Fixture {
  Fixture() : problem(3, 2), warm_start(problem.ocp), evaluation(problem.ocp) {
    problem.draw(0.1);
    Solution& solution = problem.solution;
    solution.trajectory.x[0] = problem.instance.x0;
    for (int k = 0; k < N; ++k) {
      solution.trajectory.u[k] = random_joints(3, 1.0, problem.random);
      solution.trajectory.x[k + 1] = problem.ocp.next(solution.trajectory.x[k], solution.trajectory.u[k]);
    }
    for (int k = 0; k <= N; ++k) {
      for (std::size_t i = 0; i < evaluation.rows(k).size(); ++i) {
        const ConstraintRow row = evaluation.rows(k)[i];
        solution.multipliers.set(k, row, 1000.0 * row.constraint + row.row + 0.01 * k);
      }
    }
    warm_start.reset(Time(0));
  }

  /// The multiplier of `row` at `node`, as constructed.
  static double expected(ConstraintRow row, double node) { return 1000.0 * row.constraint + row.row + 0.01 * node; }

  static constexpr int N = 8;
  RandomProblem problem;
  WarmStart warm_start;
  Evaluation evaluation;
};

TEST(WarmStart, KnowsNoMultipliersAtFirst) {
  Fixture f;
  f.warm_start.shift(f.problem.instance.x0, Time(0));
  EXPECT_EQ(f.warm_start.multipliers(), nullptr);
  for (const JointVector& u : f.warm_start.guess().u) EXPECT_TRUE(u.isZero(0.0));
}

TEST(WarmStart, ByNothingIsTheSolution) {
  Fixture f;
  f.warm_start.keep(f.problem.solution, from_seconds(1.0));
  f.warm_start.shift(f.problem.instance.x0, from_seconds(1.0));
  for (int k = 0; k < f.N; ++k) {
    EXPECT_LT((f.warm_start.guess().u[k] - f.problem.solution.trajectory.u[k]).norm(), 1e-12);
  }
  EXPECT_EQ(*f.warm_start.multipliers(), f.problem.solution.multipliers);
}

TEST(WarmStart, ShiftsByAnyTime) {
  Fixture f;
  for (const double intervals : {0.04, 0.5, 1.0, 2.3, 7.9, 20.0}) {
    f.warm_start.keep(f.problem.solution, Time(0));
    f.warm_start.shift(f.problem.instance.x0, from_seconds(intervals * f.problem.ocp.dt()));
    for (int k = 0; k <= f.N; ++k) {
      for (std::size_t i = 0; i < f.evaluation.rows(k).size(); ++i) {
        const ConstraintRow row = f.evaluation.rows(k)[i];
        const bool of_state = f.problem.ocp.constraints()[row.constraint]->nodes() == Nodes::kStates;
        const double node = std::min(k + intervals, of_state ? 8.0 : 7.0);
        EXPECT_NEAR(f.warm_start.multipliers()->at(k, row), f.expected(row, node), 1e-9);
      }
    }
    // The guess's velocities are the solution's at the shifted times, and constant behind its end; also of an arm that
    // starts at others, as after a stall.
    const auto velocity = [&](double at) -> JointVector {
      const int k = std::min(static_cast<int>(at), f.N);
      const Trajectory& solution = f.problem.solution.trajectory;
      if (k == f.N) return solution.x[k].tail(3);
      return solution.x[k].tail(3) + (at - k) * f.problem.ocp.dt() * solution.u[k];
    };
    JointVector dq = f.problem.instance.x0.tail(3);
    for (int k = 0; k < f.N; ++k) {
      dq += f.problem.ocp.dt() * f.warm_start.guess().u[k];
      const JointVector expected = velocity(std::min(k + 1 + intervals, 8.0));
      EXPECT_LT((dq - expected).norm(), 1e-9);
      EXPECT_LT((f.warm_start.guess().x[k + 1].tail(3) - dq).norm(), 1e-9);
    }
  }
}

/// If the planner is set to run faster, its next plan starts sooner, perhaps before the last one started.
TEST(WarmStart, BackwardsItBeginsWithTheFirstNode) {
  Fixture f;
  f.warm_start.keep(f.problem.solution, from_seconds(1.0));
  for (const double seconds : {0.99, 0.9, 0.0, -1e3}) {
    f.warm_start.shift(f.problem.instance.x0, from_seconds(seconds));
    for (int k = 0; k <= f.N; ++k) {
      for (std::size_t i = 0; i < f.evaluation.rows(k).size(); ++i) {
        const ConstraintRow row = f.evaluation.rows(k)[i];
        const bool of_state = f.problem.ocp.constraints()[row.constraint]->nodes() == Nodes::kStates;
        const double node = std::max(k - (1.0 - seconds) / f.problem.ocp.dt(), of_state ? 1.0 : 0.0);
        EXPECT_NEAR(f.warm_start.multipliers()->at(k, row), f.expected(row, node), 1e-9) << seconds;
      }
    }
    for (const JointVector& u : f.warm_start.guess().u) EXPECT_TRUE(u.allFinite());
  }
}

}  // namespace
}  // namespace steadyhand

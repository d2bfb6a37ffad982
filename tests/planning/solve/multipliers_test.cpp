#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <tuple>

#include "planning/solve/random_problem.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {
namespace {

/// Compared with a table of all of them.
TEST(Multipliers, AreThoseThatWereSet) {
  RandomProblem problem(3, 1);
  const Ocp& ocp = problem.ocp;
  const Evaluation evaluation(ocp);
  Multipliers multipliers, copy;
  multipliers.prepare(ocp);
  std::map<std::tuple<int, int, int>, double> expected;
  for (int round = 0; round < 40; ++round) {
    if (round % 10 == 9) {
      multipliers.clear();
      expected.clear();
    }
    const int k = static_cast<int>(problem.random() % (ocp.horizon() + 1));
    const auto& rows = evaluation.rows(k);
    const ConstraintRow row = rows[problem.random() % rows.size()];
    if (round % 7 == 6) {
      multipliers.clear(row);
      for (int node = 0; node <= ocp.horizon(); ++node) expected[{node, row.constraint, row.row}] = 0.0;
    } else {
      multipliers.set(k, row, round + 1.0);
      expected[{k, row.constraint, row.row}] = round + 1.0;
    }
    copy = multipliers;
    EXPECT_TRUE(copy == multipliers);
    for (int node = 0; node <= ocp.horizon(); ++node) {
      for (const ConstraintRow each : evaluation.rows(node)) {
        const auto found = expected.find({node, each.constraint, each.row});
        ASSERT_EQ(copy.at(node, each), found == expected.end() ? 0.0 : found->second);
        const ConstraintRow back = copy.row(copy.index(each));
        ASSERT_TRUE(back.constraint == each.constraint && back.row == each.row);
      }
    }
  }
  copy.set(1, {0, 0}, -3.0);
  EXPECT_FALSE(copy == multipliers);
  EXPECT_TRUE(multipliers.all_finite());
  multipliers.set(2, {0, 1}, std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(multipliers.all_finite());
  Multipliers other;
  other.prepare(RandomProblem(4, 1).ocp);
  EXPECT_FALSE(other.same_sizes(copy));
}

/// A row that was stored and cleared is the same as one that never was.
TEST(Multipliers, OfZeroAreEqual) {
  const RandomProblem problem(2, 1);
  Multipliers a, b;
  a.prepare(problem.ocp);
  b.prepare(problem.ocp);
  a.set(1, {0, 0}, 0.0);
  EXPECT_TRUE(a == b);
}

}  // namespace
}  // namespace steadyhand

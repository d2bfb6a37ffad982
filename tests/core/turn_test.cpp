#include "steadyhand/core/turn.hpp"

#include <gtest/gtest.h>

#include <random>

namespace steadyhand {
namespace {

TEST(Turn, TakesADirectionToAnotherAsEigenDoes) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto direction = [&] { return Vector3(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 1000; ++i) {
    const Vector3 from = direction(), to = direction();
    const Quaternion turn = turn_between(from, to);
    EXPECT_LT(turn.angularDistance(Quaternion::FromTwoVectors(from, to)), 1e-7);
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-12);
    EXPECT_LT(std::abs(turn.vec().dot(from)) + std::abs(turn.vec().dot(to)), 1e-12);
  }
}

TEST(Turn, IsHalfATurnBetweenOpposites) {
  const Vector3 nearly(3e-8, 4e-8, -1.0);
  for (const Vector3& from : {Vector3(0, 0, 2), Vector3(0, -1, 0), Vector3(1, 0, 0), Vector3(1, 2, 3)}) {
    for (const Vector3& to : {Vector3(-from), Vector3(-from + 1e-8 * nearly), Vector3(-from + 1e-15 * nearly)}) {
      const Quaternion turn = turn_between(from, to);
      EXPECT_NEAR(turn.norm(), 1.0, 1e-15);
      EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-11);
    }
  }
  EXPECT_EQ(turn_between(Vector3::UnitZ(), -Vector3::UnitZ()).vec(), Vector3(-1, 0, 0));  // as Eigen
}

}  // namespace
}  // namespace steadyhand

#include "steadyhand/core/lanes.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace steadyhand {
namespace {

TEST(Lanes, SineAndCosineAreThoseOfTheLibrary) {
  std::mt19937 random(1);
  for (const double range : {1e-9, 1.0, 10.0, 1e4}) {
    std::uniform_real_distribution<double> draw(-range, range);
    for (int trial = 0; trial < 100000; ++trial) {
      Lanes angle = 0.0, s, c;
      for (int i = 0; i < kLanes; ++i) angle.set(i, draw(random));
      sin_cos(angle, s, c);
      for (int i = 0; i < kLanes; ++i) {
        ASSERT_NEAR(s[i], std::sin(angle[i]), 2.3e-16) << angle[i];
        ASSERT_NEAR(c[i], std::cos(angle[i]), 2.3e-16) << angle[i];
      }
    }
  }
}

TEST(Lanes, EveryLaneByItself) {
  Lanes a = 0.0, b = 0.0;
  double total = 0.0, most = -1e9;
  for (int i = 0; i < kLanes; ++i) {
    a.set(i, i - 1.5);
    b.set(i, 2.0 - i);
    total += i - 1.5;
    most = std::max(most, i - 1.5);
  }
  for (int i = 0; i < kLanes; ++i) {
    EXPECT_EQ((a + b)[i], a[i] + b[i]);
    EXPECT_EQ((a - 2.0 * b)[i], a[i] - 2.0 * b[i]);
    EXPECT_EQ((a / b)[i], a[i] / b[i]);
    EXPECT_EQ(max(a, b)[i], std::max(a[i], b[i]));
    EXPECT_EQ(min(a, b)[i], std::min(a[i], b[i]));
    EXPECT_EQ(abs(a)[i], std::abs(a[i]));
    EXPECT_EQ(select(a < b, a, b)[i], std::min(a[i], b[i]));
  }
  EXPECT_EQ(sum(a), total);
  EXPECT_EQ(largest(a), most);
  EXPECT_TRUE(any(a > most - 0.5));
  EXPECT_FALSE(any(a > most));
}

TEST(Lanes, ServeAsAScalarOfEigen) {
  Eigen::Matrix<Lanes, 3, 1> v(1.0, 2.0, 3.0);
  const Eigen::Vector3d w(-1.0, 0.5, 2.0);
  const Eigen::Matrix<Lanes, 3, 1> cross = v.cross(w), twice = 2.0 * v;
  const Eigen::Vector3d expected = Eigen::Vector3d(1.0, 2.0, 3.0).cross(w);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(cross[i][kLanes - 1], expected[i]);
    EXPECT_EQ(twice[i][0], 2.0 * (i + 1));
  }
}

}  // namespace
}  // namespace steadyhand

#include "arm/delay_meter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace steadyhand {
namespace {

double swing(double t) { return t < 0.0 ? 0.3 : 0.3 + 0.05 * (1.0 - std::cos(2.0 * t)); }

/// 3 s at 500 Hz, measured `delay` late, with so much noise, by a clock of 7 ms.
DelayMeter measured(double delay, double noise, double share = 1.0) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  DelayMeter meter;
  for (int i = 0; i < 1500; ++i) meter.command(from_seconds(50.0 + 0.002 * i), swing(0.002 * i));
  for (double t = 0.0; t < 3.0; t += 0.007) {
    meter.measure(from_seconds(50.0 + t), 0.3 + share * (swing(t - delay) - 0.3) + noise * normal(random));
  }
  return meter;
}

TEST(DelayMeter, FindsTheDelay) {
  for (const double delay : {0.0, 0.002, 0.0313, 0.11, 0.53}) {
    const auto found = measured(delay, 1e-5).delay();
    ASSERT_TRUE(found) << delay;
    EXPECT_NEAR(*found, delay, 3e-4);
  }
  const auto noisy = measured(0.04, 1e-3).delay();
  ASSERT_TRUE(noisy);
  EXPECT_NEAR(*noisy, 0.04, 3e-3);
}

TEST(DelayMeter, AJointThatDoesSomethingElseHasNone) {
  EXPECT_FALSE(measured(0.03, 1e-5, 0.0).delay());
  EXPECT_FALSE(measured(0.03, 1e-5, 0.5).delay());
  EXPECT_FALSE(measured(0.03, 0.05).delay());
  EXPECT_FALSE(DelayMeter().delay());
}

}  // namespace
}  // namespace steadyhand

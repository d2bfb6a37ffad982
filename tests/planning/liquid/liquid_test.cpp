#include "steadyhand/planning/liquid/liquid.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace steadyhand {
namespace {

constexpr double kStep = 0.002;  // s

TEST(Liquid, SwingsFreelyAtTheFirstModeOfTheCylinderAndDecays) {
  GlassSettings glass;
  glass.viscosity = 1e-6 * std::pow(0.01 / slosh_damping(glass), 2);  // a share of 0.01 of critical damping
  Liquid liquid(glass);
  const double omega = slosh_frequency(glass);
  EXPECT_NEAR(omega, std::sqrt(9.81 * 1.8412 / 0.035 * std::tanh(1.8412 * 0.09 / 0.035)), 1e-3);
  liquid.update(kStep, {5.0, 0.0, 9.81});  // a push
  std::vector<double> crossings;
  double last = 0.0, first_peak = 0.0, last_peak = 0.0;
  for (int i = 1; i < 2500; ++i) {
    liquid.update(kStep, kGravity);
    const double tilt = liquid.state().tilt_y;
    if (last < 0.0 && tilt >= 0.0) crossings.push_back((i - tilt / (tilt - last)) * kStep);
    if (i < 250) first_peak = std::max(first_peak, std::abs(tilt));
    if (i > 2250) last_peak = std::max(last_peak, std::abs(tilt));
    last = tilt;
  }
  const double period = (crossings.back() - crossings.front()) / static_cast<double>(crossings.size() - 1);
  EXPECT_NEAR(2.0 * M_PI / period, omega, 0.01 * omega);
  EXPECT_NEAR(last_peak / first_peak, std::exp(-0.01 * omega * 4.5), 0.08);
  EXPECT_EQ(liquid.state().tilt_x, 0.0);
}

/// Until the glass is filled again.
TEST(Liquid, HoldsTheLargestWave) {
  const GlassSettings glass;
  Liquid liquid(glass);
  EXPECT_DOUBLE_EQ(liquid.state().least_freeboard, glass.freeboard());
  double least = glass.freeboard();
  for (int i = 0; i < 500; ++i) {
    liquid.update(kStep, i < 40 ? Vector3(1.0, 0.0, 9.81) : Vector3(kGravity));
    least = std::min(least, liquid.state().freeboard);
    EXPECT_DOUBLE_EQ(liquid.state().least_freeboard, least);
  }
  EXPECT_LT(least, liquid.state().freeboard);
  liquid.reset();
  EXPECT_DOUBLE_EQ(liquid.state().least_freeboard, glass.freeboard());
}

/// A glass that leans is filled as far as it holds, and that spills nothing.
TEST(Liquid, IsFilledInAGlassThatLeans) {
  const GlassSettings glass;
  const double angle_of_spill = std::atan((glass.height - glass.fill) / glass.radius);
  for (const double share : {0.2, 0.9, 2.0}) {
    const Quaternion q(Eigen::AngleAxisd(share * angle_of_spill, Vector3(1.0, 2.0, 0.0).normalized()));
    const Vector3 felt = q.conjugate() * kGravity;
    Liquid liquid(glass);
    liquid.update(kStep, {50.0, 0.0, 9.81});
    liquid.reset(felt);
    const double freeboard = liquid.state().freeboard;
    for (int i = 0; i < 500; ++i) liquid.update(kStep, felt);
    EXPECT_NEAR(liquid.state().freeboard, freeboard, 1e-3) << share;
    EXPECT_EQ(share < 1.0, freeboard > 1e-3) << share;
    EXPECT_GT(freeboard, -1e-3) << share;
    EXPECT_TRUE(share > 1.0 || !liquid.state().spilled) << share;
  }
}

/// Liquid that a leaning glass could not hold when it was filled does not count as spilled later.
TEST(Liquid, SpillsOfWhatWasInIt) {
  const GlassSettings glass;
  const double angle = 2.0 * std::atan((glass.height - glass.fill) / glass.radius);
  Liquid liquid(glass);
  liquid.reset(9.81 * Vector3(std::sin(angle), 0.0, std::cos(angle)));
  const auto leans = [&](double further) {
    for (int i = 0; i < 5000; ++i) {
      const double now = angle + std::min(further, i * 1e-4);
      liquid.update(kStep, 9.81 * Vector3(std::sin(now), 0.0, std::cos(now)));
    }
  };
  leans(0.02);
  EXPECT_TRUE(liquid.state().spilled);
  EXPECT_GT(liquid.state().spilled_share, 0.0);
  EXPECT_LT(liquid.state().spilled_share, 0.1);
  liquid.update(kStep, {0.0, 0.0, -9.81});
  for (int i = 0; i < 20000; ++i) liquid.update(kStep, {0.3, 0.1, -9.81});
  EXPECT_NEAR(liquid.state().spilled_share, 1.0, 1e-8) << "empty";

  liquid.reset({0.0, 0.5, -9.81});  // holds nothing, so that nothing can be spilled
  for (int i = 0; i < 1000; ++i) liquid.update(kStep, {0.3, 0.1, -9.81});
  EXPECT_FALSE(liquid.state().spilled);
  EXPECT_EQ(liquid.state().spilled_share, 0.0);
}

/// Reading at 60 Hz misses no peak, however short.
TEST(Liquid, TellsTheLargestForceOfTheLastMoment) {
  Liquid liquid(GlassSettings{});
  for (int peak = 100; peak < 120; ++peak) {
    liquid.reset();
    double seen = 0.0;
    int last = 0;
    for (int i = 0; i < 200; ++i) {
      liquid.update(kStep, i == peak ? Vector3(3.0, 4.0, 9.81) : Vector3(0.1, 0.0, 9.81));
      if (i % 8 == 0) seen = std::max(seen, liquid.state().lateral);
      if (liquid.state().lateral > 4.0) last = i;
    }
    EXPECT_DOUBLE_EQ(seen, 5.0) << peak;
    EXPECT_LE((last - peak) * kStep, 0.031);
    EXPECT_DOUBLE_EQ(liquid.state().lateral, 0.1);
  }
}

TEST(Liquid, SettlesAcrossWhatItFeels) {
  for (const Vector3& a : {Vector3(1.0, 0.0, 9.81), Vector3(0.0, -2.0, 9.81), Vector3(0.5, 0.5, 9.81)}) {
    GlassSettings glass;
    glass.viscosity = 1e-6 * std::pow(0.3 / slosh_damping(glass), 2);
    Liquid liquid(glass);
    for (int i = 0; i < 2500; ++i) liquid.update(kStep, a);
    EXPECT_NEAR(std::tan(liquid.state().tilt_y), a.x() / a.z(), 1e-3);
    EXPECT_NEAR(std::tan(liquid.state().tilt_x), -a.y() / a.z(), 1e-3);
    EXPECT_NEAR(liquid.state().freeboard, 0.01 - 0.035 * a.head<2>().norm() / a.z(), 1e-4);
  }
}

TEST(Liquid, AGlassThatLeansSlowlySpillsWhereTheRimMeetsTheSurface) {
  const GlassSettings glass;
  Liquid liquid(glass);
  const double angle_of_spill = std::atan((glass.height - glass.fill) / glass.radius);
  for (double angle = 0.0; angle < 1.1 * angle_of_spill; angle += 2e-5) {
    const Quaternion q(Eigen::AngleAxisd(angle, Vector3(1.0, 2.0, 0.0).normalized()));
    liquid.update(kStep, q.conjugate() * kGravity);
    EXPECT_TRUE(angle > 0.95 * angle_of_spill || !liquid.state().spilled) << angle;
  }
  EXPECT_TRUE(liquid.state().spilled);
  liquid.update(kStep, kGravity);
  EXPECT_TRUE(liquid.state().spilled);  // is not undone
  liquid.reset();
  EXPECT_FALSE(liquid.state().spilled);
}

/// A glass that is held over its angle of spilling keeps what lies below the plane through its rim's lowest point.
TEST(Liquid, LosesWhatStandsOverTheRim) {
  GlassSettings glass;
  glass.viscosity = 1e-6 * std::pow(0.5 / slosh_damping(glass), 2);
  Liquid liquid(glass);
  const double angle = 0.5, slope = std::tan(angle);
  for (int i = 0; i < 20000; ++i) {
    const double now = std::min(angle, i * 1e-4);
    liquid.update(kStep, 9.81 * Vector3(std::sin(now), 0.0, std::cos(now)));
  }
  const double area = M_PI * glass.radius * glass.radius, left = area * (glass.height - glass.radius * slope);
  EXPECT_NEAR(liquid.state().spilled_share, 1.0 - left / (area * glass.fill), 0.03);
  EXPECT_NEAR(liquid.state().freeboard, 0.0, 1e-3);
}

TEST(Liquid, AGlassUpsideDownStaysANumber) {
  Liquid liquid({});
  for (int i = 0; i < 5000; ++i) liquid.update(kStep, {0.3, 0.1, -9.81});
  EXPECT_TRUE(std::isfinite(liquid.state().freeboard));
  EXPECT_TRUE(liquid.state().spilled);
  EXPECT_LE(liquid.state().spilled_share, 1.0);
}

TEST(Liquid, MovesOnAnyTimeInOneCall) {
  for (const double factor : {1.0, 5.0}) {
    GlassSettings glass;
    glass.frequency_factor = factor;
    for (const double seconds : {0.02, 0.4, 30.0, 1e6}) {
      Liquid liquid(glass);
      for (int i = 0; i < 20; ++i) liquid.update(0.002, {1.5, 0.0, 9.81});
      const double before = liquid.state().freeboard;
      liquid.update(seconds, kGravity);
      EXPECT_FALSE(liquid.state().spilled) << seconds;
      if (seconds >= 30.0) {
        EXPECT_GT(liquid.state().freeboard, before) << seconds;
      }
    }
  }
}

}  // namespace
}  // namespace steadyhand

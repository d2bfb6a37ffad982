#include "steadyhand/arm/liquid.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace steadyhand {
namespace {

constexpr double kStep = 0.002;  // s
const Quaternion kUpright = Quaternion::Identity();

TEST(Liquid, SwingsFreelyAtTheFirstModeOfTheCylinderAndDecays) {
  GlassSettings glass;
  glass.damping = 0.01;
  Liquid liquid(glass);
  const double omega = slosh_frequency(glass);
  EXPECT_NEAR(omega, std::sqrt(9.81 * 1.8412 / 0.035 * std::tanh(1.8412 * 0.08 / 0.035)), 1e-3);
  liquid.update(kStep, kUpright, {5.0, 0.0, 9.81});  // a push
  std::vector<double> crossings;
  double last = 0.0, first_peak = 0.0, last_peak = 0.0;
  for (int i = 1; i < 2500; ++i) {
    liquid.update(kStep, kUpright, kGravity);
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

TEST(Liquid, SettlesAcrossWhatItFeels) {
  for (const Vector3& a : {Vector3(1.0, 0.0, 9.81), Vector3(0.0, -2.0, 9.81), Vector3(0.5, 0.5, 6.0)}) {
    GlassSettings glass;
    glass.damping = 0.3;
    Liquid liquid(glass);
    for (int i = 0; i < 2500; ++i) liquid.update(kStep, kUpright, a);
    EXPECT_NEAR(std::tan(liquid.state().tilt_y), a.x() / a.z(), 1e-3);
    EXPECT_NEAR(std::tan(liquid.state().tilt_x), -a.y() / a.z(), 1e-3);
    EXPECT_NEAR(liquid.state().freeboard, 0.03 - 0.035 * a.head<2>().norm() / a.z(), 1e-4);
  }
}

TEST(Liquid, AGlassThatLeansSlowlySpillsWhereTheRimMeetsTheSurface) {
  const GlassSettings glass;
  Liquid liquid(glass);
  const double angle_of_spill = std::atan((glass.height - glass.fill) / glass.radius);
  for (double angle = 0.0; angle < 1.1 * angle_of_spill; angle += 2e-5) {
    const Quaternion q(Eigen::AngleAxisd(angle, Vector3(1.0, 2.0, 0.0).normalized()));
    liquid.update(kStep, q, q.conjugate() * kGravity);
    EXPECT_TRUE(angle > 0.95 * angle_of_spill || !liquid.state().spilled) << angle;
  }
  EXPECT_TRUE(liquid.state().spilled);
  liquid.update(kStep, kUpright, kGravity);
  EXPECT_TRUE(liquid.state().spilled);  // is not undone
  liquid.reset();
  EXPECT_FALSE(liquid.state().spilled);
}

TEST(Liquid, ALevelTurnOfTheGlassDoesNotMoveIt) {
  Liquid liquid({});
  for (int i = 0; i < 1000; ++i) {
    liquid.update(kStep, Quaternion(Eigen::AngleAxisd(0.01 * i, Vector3::UnitZ())), kGravity);
    EXPECT_NEAR(liquid.state().freeboard, 0.03, 1e-12);
  }
}

}  // namespace
}  // namespace steadyhand

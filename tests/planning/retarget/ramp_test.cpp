// The beginning of an engagement: the tool takes up the hand's motion gradually.
#include <gtest/gtest.h>

#include "steadyhand/planning/retarget/retargeter.hpp"

namespace steadyhand {
namespace {

OperatorSample hand_at(double t) {
  OperatorSample sample;
  sample.stamp.hand = sample.stamp.made = from_seconds(t);
  sample.clutch = true;
  sample.X_operator_hand.p = Vector3(0.5 * t, -0.3 * t, 0.2);
  sample.X_operator_hand.q = Eigen::AngleAxisd(0.9 * t, Vector3(1, 1, 0).normalized());
  return sample;
}

class Ramp : public testing::TestWithParam<MotionFrame> {};

TEST_P(Ramp, SpeedGrowsFromNothingToAllAndNeverSteps) {
  RetargetSettings settings;
  settings.ramp = 0.5;
  settings.translation_frame = settings.rotation_frame = GetParam();
  Retargeter retargeter(settings);
  const Pose tool{Vector3(0.4, 0.1, 0.5), Quaternion(Eigen::AngleAxisd(0.7, Vector3::UnitX()))};
  const double dt = 0.01, speed = Vector3(0.5, -0.3, 0.0).norm() * settings.scale;
  Pose last = tool;
  for (int i = 0; i <= 100; ++i) {
    const Target target = retargeter.update(hand_at(3.0 + i * dt), tool);
    const double share = std::min(1.0, i * dt / 0.5);
    const double moved = (target.X_base_tool.p - last.p).norm(), turned = target.X_base_tool.q.angularDistance(last.q);
    EXPECT_NEAR(moved, share * speed * (i > 0 ? dt : 0.0), 1e-9) << i;
    EXPECT_NEAR(turned, share * 0.9 * (i > 0 ? dt : 0.0), 1e-6) << i;
    last = target.X_base_tool;
  }
}

INSTANTIATE_TEST_SUITE_P(, Ramp, testing::Values(MotionFrame::kBase, MotionFrame::kTool));

TEST(Retargeter, ScaleAndYawChangeWithoutAStep) {
  Retargeter retargeter;
  const Pose tool{Vector3(0.4, 0.1, 0.5), Quaternion::Identity()};
  for (int i = 0; i < 50; ++i) (void)retargeter.update(hand_at(0.01 * i), tool);
  const Target before = retargeter.update(hand_at(0.5), tool);
  retargeter.set_scale(2.0);
  retargeter.set_yaw(1.0);
  const Target after = retargeter.update(hand_at(0.5), tool);
  EXPECT_LT((after.X_base_tool.p - before.X_base_tool.p).norm(), 1e-12);
  EXPECT_LT(after.X_base_tool.q.angularDistance(before.X_base_tool.q), 1e-7);
  const Target later = retargeter.update(hand_at(0.6), tool);
  EXPECT_NEAR((later.X_base_tool.p - after.X_base_tool.p).norm(), 2.0 * 0.1 * Vector3(0.5, -0.3, 0.0).norm(), 1e-9);
}

}  // namespace
}  // namespace steadyhand

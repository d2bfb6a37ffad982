#include "steadyhand/planning/retarget/retargeter.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace steadyhand {
namespace {

constexpr int kCases = 100'000;

/// Random poses, motions and settings, from one seed.
struct Dice {
  std::mt19937 random;
  std::uniform_real_distribution<double> uniform{-1.0, 1.0};
  std::normal_distribution<double> normal;

  explicit Dice(unsigned seed) : random(seed) {}

  double unit() { return uniform(random); }
  Vector3 vector() { return {unit(), unit(), unit()}; }
  Quaternion turn() { return Quaternion(normal(random), normal(random), normal(random), normal(random)).normalized(); }
  Pose pose() { return {vector(), turn()}; }
  MotionFrame frame() { return unit() > 0.0 ? MotionFrame::kBase : MotionFrame::kTool; }
  RetargetSettings settings() { return {1.05 + unit(), M_PI * unit(), frame(), frame(), false}; }
};

OperatorSample sample_at(const Pose& hand, bool clutch = true) {
  OperatorSample sample;
  sample.X_operator_hand = hand;
  sample.clutch = clutch;
  return sample;
}

/// m plus rad between two poses.
double distance(const Pose& a, const Pose& b) {
  const double sine = (a.q.conjugate() * b.q).vec().norm();
  return (a.p - b.p).norm() + 2.0 * std::asin(std::min(1.0, sine));
}

/// To the last bit.
bool same(const Pose& a, const Pose& b) { return a.p == b.p && a.q.coeffs() == b.q.coeffs(); }

/// Engages with hand0 and tool0 and moves the hand on.
Pose retarget(const RetargetSettings& settings, const Pose& hand0, const Pose& tool0, const Pose& hand) {
  Retargeter retargeter(settings);
  retargeter.update(sample_at(hand0), tool0);
  return retargeter.update(sample_at(hand), Pose{}).X_base_tool;
}

TEST(Retargeter, NeverStepsOnEngaging) {
  Dice dice(1);
  for (int i = 0; i < kCases; ++i) {
    Retargeter retargeter(dice.settings());
    const Pose hand = dice.pose(), tool = dice.pose();
    const Target first = retargeter.update(sample_at(hand), tool);
    EXPECT_TRUE(first.engaged);
    ASSERT_TRUE(same(first.X_base_tool, tool));
    ASSERT_LT(distance(retargeter.update(sample_at(hand), dice.pose()).X_base_tool, tool), 1e-14);
  }
}

// Motion in the hand's axes does not depend on the operator's frame; motion in the room's axes depends only on its yaw.
TEST(Retargeter, DependsOnMotionOnlyNotOnWhereTheRoomBegins) {
  Dice dice(2);
  for (int i = 0; i < kCases; ++i) {
    const RetargetSettings settings = dice.settings();
    const Pose hand0 = dice.pose(), hand = dice.pose(), tool0 = dice.pose();
    const double turn = M_PI * dice.unit();
    const Pose X_new_old{dice.vector(), Quaternion(Eigen::AngleAxisd(turn, Vector3::UnitZ()))};
    RetargetSettings turned = settings;
    turned.yaw -= turn;
    const Pose expected = retarget(settings, hand0, tool0, hand);
    const Pose moved = retarget(turned, X_new_old * hand0, tool0, X_new_old * hand);
    ASSERT_LT(distance(moved, expected), 1e-13);
    ASSERT_NEAR(expected.q.norm(), 1.0, 1e-14);
  }
}

TEST(Retargeter, TurnsWithTheYawAboutBaseZ) {
  Dice dice(3);
  for (int i = 0; i < kCases; ++i) {
    RetargetSettings settings{1.05 + dice.unit(), 0.0, MotionFrame::kBase, MotionFrame::kBase, false};
    const Pose hand0 = dice.pose(), hand = dice.pose(), tool0 = dice.pose();
    const Pose straight = retarget(settings, hand0, tool0, hand);
    settings.yaw = M_PI * dice.unit();
    const Pose turned = retarget(settings, hand0, tool0, hand);
    const Quaternion C(Eigen::AngleAxisd(settings.yaw, Vector3::UnitZ()));
    ASSERT_LT((turned.p - tool0.p - C * (straight.p - tool0.p)).norm(), 1e-13);
    const Quaternion delta = straight.q * tool0.q.conjugate();
    ASSERT_LT(distance({turned.p, C * delta * C.conjugate() * tool0.q}, turned), 1e-13);
  }
}

TEST(Retargeter, ScalesTranslationAndNothingElse) {
  Dice dice(4);
  for (int i = 0; i < kCases; ++i) {
    RetargetSettings settings = dice.settings();
    const Pose hand0 = dice.pose(), hand = dice.pose(), tool0 = dice.pose();
    const Pose scaled = retarget(settings, hand0, tool0, hand);
    const double scale = std::exchange(settings.scale, 1.0);
    const Pose whole = retarget(settings, hand0, tool0, hand);
    ASSERT_LT((scaled.p - tool0.p - scale * (whole.p - tool0.p)).norm(), 1e-13);
    ASSERT_NEAR((whole.p - tool0.p).norm(), (hand.p - hand0.p).norm(), 1e-13);
    ASSERT_EQ(scaled.q.coeffs(), whole.q.coeffs());
    ASSERT_NEAR(whole.q.angularDistance(tool0.q), hand.q.angularDistance(hand0.q), 1e-7);  // acos near 1
  }
}

// In the tool frame at full scale the tool is moved as if the hand held it by a rigid handle at engagement.
TEST(Retargeter, MovesInTheToolFrameAsTheHandInItsOwn) {
  Dice dice(5);
  for (int i = 0; i < kCases; ++i) {
    const RetargetSettings settings{1.0, M_PI * dice.unit(), MotionFrame::kTool, MotionFrame::kTool, false};
    const Pose hand0 = dice.pose(), hand = dice.pose(), tool0 = dice.pose();
    ASSERT_LT(distance(retarget(settings, hand0, tool0, hand), tool0 * hand0.inverse() * hand), 1e-13);
  }
}

// Base and tool frame agree for a hand and a tool that are aligned at engagement.
TEST(Retargeter, FramesAgreeWhenHandAndToolAreAligned) {
  Dice dice(6);
  for (int i = 0; i < kCases; ++i) {
    const Pose hand0 = dice.pose(), hand = dice.pose();
    RetargetSettings settings{1.05 + dice.unit(), M_PI * dice.unit(), MotionFrame::kBase, MotionFrame::kBase, false};
    const Pose tool0{dice.vector(), Quaternion(Eigen::AngleAxisd(settings.yaw, Vector3::UnitZ())) * hand0.q};
    const Pose base = retarget(settings, hand0, tool0, hand);
    settings.translation_frame = settings.rotation_frame = MotionFrame::kTool;
    ASSERT_LT((retarget(settings, hand0, tool0, hand).p - base.p).norm(), 1e-13);
    ASSERT_LT(distance(retarget(settings, hand0, tool0, hand), base), 1e-13);
  }
}

TEST(Retargeter, ReturnsWithTheHand) {
  Dice dice(7);
  Retargeter retargeter(dice.settings());
  const Pose hand0 = dice.pose(), tool0 = dice.pose();
  retargeter.update(sample_at(hand0), tool0);
  for (int i = 0; i < kCases; ++i) retargeter.update(sample_at(dice.pose()), dice.pose());
  EXPECT_LT(distance(retargeter.update(sample_at(hand0), dice.pose()).X_base_tool, tool0), 1e-14);
}

// After release the target is where the arm was then, although the arm coasts on for a moment.
TEST(Retargeter, HoldsWhereItWasLetGo) {
  Dice dice(10);
  Retargeter retargeter;
  const Pose first = dice.pose();
  EXPECT_TRUE(same(retargeter.update(sample_at({}, false), first).X_base_tool, first));
  EXPECT_TRUE(same(retargeter.update(sample_at({}, false), dice.pose()).X_base_tool, first));
  retargeter.update(sample_at(dice.pose()), dice.pose());
  const Pose left = dice.pose();
  for (int i = 0; i < 100; ++i) {
    const Target target = retargeter.update(sample_at(dice.pose(), false), i == 0 ? left : dice.pose());
    EXPECT_FALSE(target.engaged);
    EXPECT_TRUE(same(target.X_base_tool, left));
  }
}

// Off the clutch the target is the arm; on again it starts from the arm, wherever hand and arm have gone.
TEST(Retargeter, ReclutchesWithoutAStep) {
  Dice dice(8);
  Retargeter retargeter(dice.settings());
  for (int i = 0; i < kCases / 4; ++i) {
    const Pose tool = dice.pose(), hand = dice.pose();
    const Target off = retargeter.update(sample_at(dice.pose(), false), tool);
    ASSERT_FALSE(off.engaged);
    ASSERT_TRUE(same(off.X_base_tool, tool));
    const Target on = retargeter.update(sample_at(hand), tool);
    ASSERT_TRUE(on.engaged);
    ASSERT_TRUE(same(on.X_base_tool, tool));
    const Pose near{hand.p + 1e-6 * dice.vector(), hand.q};
    ASSERT_LT(distance(retargeter.update(sample_at(near), dice.pose()).X_base_tool, tool), 4e-6);
  }
}

TEST(Retargeter, PassesStamps) {
  Retargeter retargeter;
  OperatorSample sample = sample_at({});
  sample.stamp = {Time(3), Time(5)};
  const Target target = retargeter.update(sample, {});
  EXPECT_EQ(target.stamp.hand, Time(3));
  EXPECT_EQ(target.stamp.made, Time(5));
}

// A pose that cannot be trusted releases; the next good one engages again and does not follow a teleport.
TEST(Retargeter, LetsGoOfBadPoses) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  OperatorSample untracked = sample_at({{0.7, 0, 0}, Quaternion::Identity()});
  untracked.tracked = false;
  OperatorSample emulated = sample_at({{0.7, 0, 0}, Quaternion::Identity()});
  emulated.emulated = true;
  const OperatorSample no_position = sample_at({{0.7, kNan, 0}, Quaternion::Identity()});
  const OperatorSample no_turn = sample_at({{0.7, 0, 0}, Quaternion(kNan, 0, 0, 0)});

  Dice dice(9);
  for (const OperatorSample& bad : {untracked, emulated, no_position, no_turn}) {
    Retargeter retargeter;
    retargeter.update(sample_at({}), dice.pose());
    const Pose tool = dice.pose();
    const Target target = retargeter.update(bad, tool);
    EXPECT_FALSE(target.engaged);
    EXPECT_TRUE(same(target.X_base_tool, tool));
    const Target next = retargeter.update(sample_at({{0.7, 0, 0}, Quaternion::Identity()}), tool);
    EXPECT_TRUE(next.engaged);
    EXPECT_TRUE(same(next.X_base_tool, tool));
  }
  RetargetSettings trusting;
  trusting.accept_emulated = true;
  EXPECT_TRUE(Retargeter(trusting).update(emulated, {}).engaged);
}

/// rad, of the glass's axis from the vertical.
double lean(const Quaternion& q) {
  const Vector3 axis = q * Vector3::UnitZ();
  return std::atan2(axis.head<2>().norm(), axis.z());
}

TEST(Retargeter, LeansNoFurtherThanItsTiltAndTurnsAsTheHandDoes) {
  Dice dice(21);
  for (const double most : {0.0, 0.1, 0.5}) {
    RetargetSettings settings;
    settings.tilt_max = most;
    settings.yaw = 0.3;
    Retargeter retargeter(settings);
    const Pose tool{dice.vector(), Quaternion(Eigen::AngleAxisd(M_PI * dice.unit(), Vector3::UnitZ()))};
    retargeter.update(sample_at({}), tool);
    for (int i = 0; i < 1000; ++i) {
      OperatorSample sample =
          sample_at({dice.vector(), Quaternion(Eigen::AngleAxisd(1.2 * dice.unit(), dice.vector().normalized()))});
      sample.stamp.hand = from_seconds(0.01 * i);
      EXPECT_LT(lean(retargeter.update(sample, {}).X_base_tool.q), most + 1e-9);
    }
    OperatorSample turned = sample_at({Vector3::Zero(), Quaternion(Eigen::AngleAxisd(0.8, Vector3::UnitZ()))});
    turned.stamp.hand = from_seconds(20.0);
    const Quaternion expected = Quaternion(Eigen::AngleAxisd(0.8, Vector3::UnitZ())) * tool.q;
    EXPECT_LT(retargeter.update(turned, {}).X_base_tool.q.angularDistance(expected), 1e-9);
  }
}

TEST(Retargeter, ATiltThatChangesTurnsTheTargetAtARadianPerSecond) {
  RetargetSettings settings;
  Retargeter retargeter(settings);
  const Pose leaning{Vector3::Zero(), Quaternion(Eigen::AngleAxisd(1.0, Vector3::UnitX()))};
  retargeter.update(sample_at({}), {});
  double last = 0.0;
  bool first = true;
  for (int i = 1; i < 600; ++i) {
    if (i == 200) retargeter.set_tilt_max(0.0);
    if (i == 400) retargeter.set_tilt_max(M_PI);
    OperatorSample sample = sample_at(leaning);
    sample.stamp.hand = from_seconds(0.01 * i);
    const double now = lean(retargeter.update(sample, {}).X_base_tool.q);
    if (!first) {
      EXPECT_LT(std::abs(now - last), 0.01 + 1e-6) << i;
    }
    first = false;
    last = now;
    if (i == 199 || i == 599) {
      EXPECT_NEAR(now, 1.0, 1e-9);
    }
    if (i == 399) {
      EXPECT_NEAR(now, 0.0, 1e-9);
    }
  }
}

/// A tool that leans when the hand takes it does not jump upright.
TEST(Retargeter, TakesALeaningToolAsItIs) {
  RetargetSettings settings;
  settings.tilt_max = 0.0;
  Retargeter retargeter(settings);
  const Pose tool{Vector3::Zero(), Quaternion(Eigen::AngleAxisd(0.7, Vector3::UnitY()))};
  double last = lean(retargeter.update(sample_at({}), tool).X_base_tool.q);
  EXPECT_NEAR(last, 0.7, 1e-9);
  for (int i = 1; i < 100; ++i) {
    OperatorSample sample = sample_at({});
    sample.stamp.hand = from_seconds(0.01 * i);
    const double now = lean(retargeter.update(sample, {}).X_base_tool.q);
    EXPECT_LT(last - now, 0.01 + 1e-6);
    last = now;
  }
  EXPECT_NEAR(last, 0.0, 1e-9);
}

TEST(Retargeter, HandForIsItsInverse) {
  Dice dice(11);
  for (int i = 0; i < 1000; ++i) {
    const RetargetSettings settings = dice.settings();
    Retargeter retargeter(settings);
    const Pose hand0 = dice.pose(), tool0 = dice.pose(), hand = dice.pose();
    (void)retargeter.update(sample_at(hand0), tool0);
    const Target target = retargeter.update(sample_at(hand), tool0);
    EXPECT_LT(distance(hand_for(settings, target.X_base_tool, tool0, hand0), hand), 1e-6 / settings.scale) << i;
  }
}

}  // namespace
}  // namespace steadyhand

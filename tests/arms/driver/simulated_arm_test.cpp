#include "steadyhand/arms/driver/simulated_arm.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "support/manual_clock.hpp"

namespace steadyhand {
namespace {

/// An arm that turns all joints at a constant speed.
struct Turning : testing::Test {
  explicit Turning() : random(3), model(random_arm(6, random, false)) {
    settings.command_timeout = 10.0;
    start();
  }
  void start() {
    arm = std::make_unique<SimulatedArm>(model, model.home, settings, clock);
    do {
      state = arm->receive();
    } while (state.status != ArmStatus::kFollowing);
    begin = state.joints.stamp.made;
    // From rest with 10 rad/s^2 to 1 rad/s.
    while (to_seconds(state.joints.stamp.made - begin) < 0.3) {
      arm->send(command(state.joints.stamp.made));
      state = arm->receive();
    }
    ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  }
  JointCommand command(Time now) const {
    const double t = to_seconds(now - begin), up = std::min(t, 0.1);
    const JointVector ones = JointVector::Ones(6);
    return {
        {now, now}, model.home + (5.0 * up * up + (t - up)) * ones, 10.0 * up * ones, (t < 0.1 ? 10.0 : 0.0) * ones};
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
  SimulatedArmSettings settings;
  std::unique_ptr<SimulatedArm> arm;
  ArmState state;
  Time begin{0};
};

TEST_F(Turning, WithoutCommandsItCarriesOnAndThenBrakesWithinItsLimits) {
  const JointCommand last = command(state.joints.stamp.made);
  arm->send(last);
  JointVector dq = arm->dq();
  double fastest = 0.0, hardest = 0.0;
  for (int k = 0; k < 100; ++k) {
    state = arm->receive();
    ASSERT_EQ(state.carried_on.has_value(), k > 0);
    fastest = std::max(fastest, arm->dq().maxCoeff());
    hardest = std::max(hardest, (arm->dq() - dq).cwiseAbs().maxCoeff() / 0.002);
    dq = arm->dq();
    if (k == 2) {
      EXPECT_LT((state.carried_on->q - last.q - 0.004 * last.dq).norm(), 1e-12);
    }
  }
  EXPECT_LT(fastest, 1.0 + 1e-9);
  EXPECT_LT(hardest, model.acceleration_max.maxCoeff() + 1e-6);
  EXPECT_TRUE(state.carried_on->dq.isZero(0.0));
  const double way = 0.004 + 0.75 / model.acceleration_max[0];  // from 1 rad/s at two thirds of the limit
  EXPECT_NEAR(state.carried_on->q[0] - last.q[0], way, 1e-9);
  EXPECT_NEAR(arm->q()[0] - last.q[0], way, 1e-4);
  EXPECT_EQ(state.status, ArmStatus::kFollowing);
}

/// Commands as from a loop that samples them by time and ignores missed cycles.
TEST_F(Turning, ACommandThatLeavesOutTheGapIsAStep) {
  for (const double gap : {0.012, 0.03, 0.05, 0.07}) {
    clock.advance(gap);
    state = arm->receive();
    ASSERT_EQ(state.status, ArmStatus::kFollowing);
    arm->send(command(state.joints.stamp.made));
    state = arm->receive();
    EXPECT_EQ(state.status, ArmStatus::kStopped) << gap;
    start();
  }
}

TEST_F(Turning, SmallStepsAreRefusedAlsoWhereEachIsASpeedItCouldHave) {
  JointCommand c = command(state.joints.stamp.made);
  c.q.array() += 0.001;  // 0.5 rad/s more in a cycle
  arm->send(c);
  EXPECT_EQ(arm->receive().status, ArmStatus::kStopped);
}

TEST_F(Turning, WithoutCommandsForTooLongItStops) {
  settings.command_timeout = 0.05;
  start();
  clock.advance(0.045);
  EXPECT_EQ(arm->receive().status, ArmStatus::kFollowing);
  clock.advance(0.01);
  state = arm->receive();
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_EQ(state.reason, "no command arrived in time");
  EXPECT_FALSE(state.carried_on);
}

}  // namespace
}  // namespace steadyhand

// Two arms behind one joint trajectory controller, and behind one each.
#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/driver/composite_arm.hpp"
#include "steadyhand/arms/ros2/ros2_arm.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/lockstep.hpp"

namespace steadyhand {
namespace {

struct TwoRos2Arms : testing::Test {
  TwoRos2Arms() : random(5), robot(random_tree(0, 6, 6, random, false)) {
    robot.home = steadyhand::random_joints(12, 1.0, random);
  }

  /// Follows a motion of both arms for 0.8 s.
  void swing(Arm& arm) {
    ArmState state;
    for (int i = 0; i < 5000 && state.status != ArmStatus::kFollowing; ++i) state = arm.receive();
    ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
    EXPECT_LT((state.joints.q - robot.home).norm(), 1e-3);
    const Time begin = state.joints.stamp.made;
    const JointVector q0 = state.joints.q, ones = JointVector::LinSpaced(12, 0.5, 1.0);
    Plan plan;
    for (int i = 0; i < 400; ++i) {
      const Time now = state.joints.stamp.made;
      const double t = to_seconds(now - begin);
      const JointCommand command{
          {now, now}, q0 + 0.2 * (1.0 - std::cos(2.0 * t)) * ones, 0.4 * std::sin(2.0 * t) * ones, 0.0 * ones};
      make_straight_stop(robot, command, 0.0, plan);
      arm.follow(plan);
      arm.send(command);
      state = arm.receive();
      ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
    }
    const double then = to_seconds(state.joints.stamp.made - begin) - arm.info().delay;
    EXPECT_LT((state.joints.q - q0 - 0.2 * (1.0 - std::cos(2.0 * then)) * ones).cwiseAbs().maxCoeff(), 0.01);
  }

  std::mt19937 random;
  RobotModel robot;
  ManualClock clock;
};

TEST_F(TwoRos2Arms, FollowBehindOneControllerOfAllJoints) {
  Ros2Lockstep arm(robot, {}, clock);
  EXPECT_EQ(arm.info().joints, 12);
  swing(arm);
}

TEST_F(TwoRos2Arms, FollowBehindAControllerEach) {
  const CompositeArm::Make make = [](const RobotModel& model, Clock& own) -> Result<std::unique_ptr<Arm>> {
    return std::unique_ptr<Arm>(new Ros2Lockstep(model, {}, own));
  };
  auto arm = CompositeArm::make(robot, {make, make}, clock, CompositeArm::Turns::kOneThread);
  ASSERT_TRUE(arm) << arm.error().message;
  swing(**arm);
}

TEST_F(TwoRos2Arms, WithTwoGrippersNeedTwoDrivers) {
  for (Tool& tool : robot.tools) tool.gripper_time = 0.5;
  Ros2Settings settings;
  settings.domain = isolated_ros2_domain();
  const auto arm = Ros2Arm::without_thread(robot, settings, clock);
  ASSERT_FALSE(arm);
  EXPECT_NE(arm.error().message.find("has two grippers, and ros2.gripper names the action of one"), std::string::npos);
}

}  // namespace
}  // namespace steadyhand

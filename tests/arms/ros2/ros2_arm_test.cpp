// For an arm behind ROS 2 the control thread allocates nothing, and it sends nothing that it may not send.
#include "steadyhand/arms/ros2/ros2_arm.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "support/allocation_guard.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/lockstep.hpp"

namespace steadyhand {
namespace {

class Ros2ArmTest : public testing::Test {
 protected:
  Ros2ArmTest() : random(4), model(random_arm(6, random, false)) {
    model.home = random_joints(6, 1.0, random);
    const std::string topic = "/arm" + std::to_string(getpid());
    ReferenceController::Settings machine;
    Ros2Settings settings;
    machine.domain = settings.domain = isolated_ros2_domain();
    machine.controller = settings.controller = topic;
    machine.joint_states = settings.joint_states = topic + "/joint_states";
    auto made = ReferenceController::make(model, model.home, machine);
    auto joined = Ros2Arm::without_thread(model, settings, clock);
    EXPECT_TRUE(made && joined);
    controller = std::move(*made);
    arm = std::move(*joined);
  }
  /// A cycle of the machine, then what a control thread does in one.
  void cycle() {
    controller->step();
    {
      const AllocationGuard guard;
      state = arm->receive();
      const Time now = state.joints.stamp.made;
      if (state.status == ArmStatus::kFollowing) {
        const double t = to_seconds(now - begin);
        const JointVector ones = JointVector::Ones(6);
        const JointCommand command{{now, now},
                                   model.home + 0.2 * (1.0 - std::cos(2.0 * t)) * ones,
                                   0.4 * std::sin(2.0 * t) * ones,
                                   0.8 * std::cos(2.0 * t) * ones};
        make_straight_stop(model, command, 0.0, plan);
        if (gives_plans) arm->follow(plan);
        arm->send(command);
      } else {
        begin = now + from_seconds(0.002);
      }
      allocations += guard.count();
    }
    arm->talk();
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
  std::unique_ptr<ReferenceController> controller;
  std::unique_ptr<Ros2Arm> arm;
  ArmState state;
  Plan plan;
  Time begin{0};
  bool gives_plans = true;
  std::size_t allocations = 0;
};

TEST_F(Ros2ArmTest, TheControlThreadAllocatesNothing) {
  for (int i = 0; i < 1000; ++i) cycle();
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  EXPECT_GT(controller->accepted(), 100u);
  EXPECT_EQ(allocations, 0u);
}

TEST_F(Ros2ArmTest, ACommandWithoutItsPlanIsNotSent) {
  for (int i = 0; i < 500; ++i) cycle();
  ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  gives_plans = false;
  cycle();
  cycle();
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("not on the plan"), std::string_view::npos) << state.reason;
  const std::uint64_t sent = controller->accepted();
  for (int i = 0; i < 100; ++i) cycle();
  EXPECT_EQ(controller->accepted(), sent);
}

}  // namespace
}  // namespace steadyhand

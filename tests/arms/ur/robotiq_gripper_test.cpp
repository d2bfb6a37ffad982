#include "steadyhand/arms/ur/robotiq_gripper.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "geometry/robot/random_arm.hpp"
#include "support/manual_clock.hpp"
#include "support/ur/fake_robotiq.hpp"
#include "support/ur/lockstep.hpp"

namespace steadyhand {
namespace {

/// Patient, for a busy machine.
void await(const std::function<bool()>& done, const char* what) {
  for (int i = 0; i < 6000 && !done(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(done()) << what;
}

class Robotiq : public testing::Test {
 protected:
  Result<std::unique_ptr<RobotiqGripper>> connect(double timeout = 60.0) {
    return RobotiqGripper::connect([this] { return server.dial(); }, {0.5, 0.1, timeout});
  }
  std::string refusal(double timeout = 60.0) {
    const auto gripper = connect(timeout);
    return gripper ? "" : gripper.error().message;
  }

  FakeRobotiq server;
};

TEST_F(Robotiq, GoesWhereItIsToldWithItsSpeedAndForceAndTellsWhereItIs) {
  const auto gripper = connect();
  ASSERT_TRUE(gripper) << gripper.error().message;
  EXPECT_EQ(server.value("SPE"), 128);
  EXPECT_EQ(server.value("FOR"), 26);
  EXPECT_EQ(server.value("GTO"), 1);
  EXPECT_NEAR((*gripper)->position(), 3.0 / 255.0, 1e-12);
  EXPECT_EQ(server.told(), 0) << "nothing moves before it is wanted";
  (*gripper)->move_to(0.6);
  await([&] { return (*gripper)->position() == 153.0 / 255.0; }, "the fingers to arrive");
  (*gripper)->move_to(7.0);
  await([&] { return (*gripper)->position() == 1.0; }, "a closed gripper");
  (*gripper)->move_to(std::numeric_limits<double>::quiet_NaN());
  (*gripper)->move_to(-std::numeric_limits<double>::infinity());
  await([&] { return server.told() == 2; }, "what was wanted to be told once");
  EXPECT_EQ(server.value("PRE"), 255) << "what is no number is ignored";
  EXPECT_EQ((*gripper)->why_not(), "");
}

TEST_F(Robotiq, IsNotTakenWhereItIsNotReady) {
  server.set("STA", 0);
  EXPECT_NE(refusal().find("activate it at the pendant"), std::string::npos) << refusal();
  server.set("STA", 3);
  server.set("FLT", 11);
  EXPECT_NE(refusal().find("reports a fault"), std::string::npos) << refusal();
  server.set("FLT", 7);  // a request that came too early is none
  EXPECT_EQ(refusal(), "");
  for (const char* answer : {"STA ?\n", "POS 3\n", "\n", "STA 1000\n", "STA 3 4\n", "STA -1\n", "<html>\n"}) {
    server.answer_always(answer);
    EXPECT_NE(refusal().find("to 'GET STA'"), std::string::npos) << answer << refusal();
  }
  server.answer_always(std::string(100000, 'x'));
  EXPECT_NE(refusal().find("has no end"), std::string::npos) << refusal();
  server.silent = true;
  EXPECT_NE(refusal(0.05).find("does not answer"), std::string::npos);
  server.refuses = true;
  EXPECT_EQ(refusal(), "nobody is there");
}

TEST_F(Robotiq, ThatIsLostSaysSoAndIsFoundAgain) {
  const auto gripper = connect();
  ASSERT_TRUE(gripper);
  (*gripper)->move_to(0.4);
  await([&] { return server.told() == 1; }, "the position to be told");
  server.refuses = true;
  server.drop_connections();
  await([&] { return (*gripper)->why_not().find("does not answer") != std::string::npos; }, "the loss");
  server.refuses = false;
  await([&] { return (*gripper)->why_not().empty(); }, "another connection");
  server.set("FLT", 14);
  await([&] { return (*gripper)->why_not().find("fault") != std::string::npos; }, "the fault");
  server.set("FLT", 0);
  await([&] { return (*gripper)->why_not().empty(); }, "its end");
  server.set("STA", 1);
  await([&] { return (*gripper)->why_not().find("not activated") != std::string::npos; }, "the state");
}

TEST_F(Robotiq, OfAnArmIsPartOfItsCommandsAndStopsItWhenItIsNotWell) {
  std::mt19937 random(3);
  RobotModel model = random_arm(6, random, false);
  model.home = random_joints(6, 1.0, random);
  ManualClock clock;
  UrLockstep arm(model, {}, clock);
  EXPECT_FALSE(arm.info().gripper[0]);
  arm.take_gripper(*connect());
  EXPECT_TRUE(arm.info().gripper[0]);
  ArmState state;
  const auto run = [&](double closed) {
    state = arm.receive();
    if (state.status != ArmStatus::kFollowing) return;
    JointCommand command;
    command.stamp = state.joints.stamp;
    command.q = model.home;
    command.dq = command.ddq = JointVector::Zero(6);
    command.gripper[0] = closed;
    arm.send(command);
  };
  for (int i = 0; i < 2000 && state.status != ArmStatus::kFollowing; ++i) run(0.5);
  ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  await(
      [&] {
        run(0.5);
        return state.joints.gripper[0] == 128.0 / 255.0;
      },
      "the gripper to be half closed, as measured");
  server.refuses = true;
  server.drop_connections();
  await(
      [&] {
        run(0.0);
        return state.status == ArmStatus::kStopped;
      },
      "a stop");
  EXPECT_NE(state.reason.find("gripper"), std::string_view::npos) << state.reason;
  EXPECT_EQ(server.value("PRE"), 128) << "it keeps its grip";
}

}  // namespace
}  // namespace steadyhand

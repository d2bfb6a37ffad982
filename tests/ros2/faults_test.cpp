// What becomes of an arm behind a ROS 2 controller that moves when something goes wrong; docs/ros2.md has a row for
// each test.
#include <gtest/gtest.h>

#include <cmath>

#include "plan/straight_stop.hpp"
#include "robot/random_arm.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/lockstep.hpp"
#include "support/swing.hpp"

namespace steadyhand {
namespace {

constexpr double kGentle = 6.0;  ///< rad/s^2: the swing's 3.6, and what two differences of rounded stamps add

class Ros2Faults : public testing::Test {
 protected:
  Ros2Faults() : random(3), model(random_arm(6, random, false)) {
    model.home = random_joints(6, 1.0, random);
    swinging = Swing(model.home);
    settings.domain = isolated_ros2_domain();
    settings.controller = topic;
    settings.joint_states = topic + "/joint_states";
  }

  void start(const ReferenceController::Settings& controller = {}) {
    arm = std::make_unique<Ros2Lockstep>(model, controller, clock);
  }
  ReferenceController& controller() { return *arm->controller; }

  /// Swings on for so many seconds, up to 1.8 rad/s, as long as the arm follows; its last state.
  ArmState run(double seconds) {
    const Time end = clock.now() + from_seconds(seconds);
    while (clock.now() < end) {
      state = arm->receive();
      if (state.status != ArmStatus::kFollowing) {
        swinging.forget();
        continue;
      }
      const JointCommand command = swinging.next(state.joints, arm->info().delay);
      make_straight_stop(model, command, 0.0, plan);
      arm->follow(plan);
      arm->send(command);
    }
    return state;
  }
  /// Moves fast when the fault comes.
  void swing() {
    ASSERT_EQ(run(1.5).status, ArmStatus::kFollowing) << state.reason;
    ASSERT_GT(std::abs(state.joints.dq.mean()), 1.0);
    controller().forget_largest();
  }
  void expect_bridged() {
    EXPECT_EQ(run(1.0).status, ArmStatus::kFollowing) << state.reason;
    EXPECT_LT(controller().largest().ddq, kGentle);
    EXPECT_LT(std::abs(swinging.error()), 0.02);
    EXPECT_EQ(controller().last_stop(), "");
  }
  /// The arm follows its last plan to where that rests, whatever came or did not, and the session knows.
  void expect_rest(const std::string& reason) {
    EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
    EXPECT_NE(std::string(state.reason).find(reason), std::string::npos) << state.reason;
    EXPECT_LT(controller().arm().dq().norm(), 0.02);
    EXPECT_LT(controller().largest().ddq, std::max(kGentle, 1.05 * model.acceleration_max.maxCoeff()));
    EXPECT_EQ(controller().last_stop(), "");
    EXPECT_EQ(controller().refused(), 0u) << controller().last_refusal();
  }
  void expect_follows_after_restart() {
    arm->restart();
    EXPECT_EQ(run(1.5).status, ArmStatus::kFollowing) << state.reason;
    EXPECT_GT(std::abs(state.joints.dq.mean()), 1.0);
    EXPECT_EQ(controller().last_stop(), "");
  }
  /// A publisher of joint states beside the controller's.
  void send_states(Ros2Publisher<JointStateMessage>& publisher, std::vector<std::string> names) const {
    std::vector<char*> pointers;
    for (std::string& name : names) pointers.push_back(name.data());
    std::vector<double> q(names.size(), 0.5), standing(names.size(), 0.0);
    std::string frame;
    JointStateMessage message{};
    message.header.stamp = {static_cast<std::int32_t>(clock.now() / std::chrono::seconds(1)),
                            static_cast<std::uint32_t>((clock.now() % std::chrono::seconds(1)).count())};
    message.header.frame_id = frame.data();
    message.name = sequence_of<decltype(message.name)>(pointers);
    message.position = sequence_of<decltype(message.position)>(q);
    message.velocity = sequence_of<decltype(message.velocity)>(standing);
    EXPECT_TRUE(publisher.send(message));
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const Joint& joint : model.joints) all.push_back(joint.name);
    return all;
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
  std::string topic = "/alone" + std::to_string(getpid());
  Ros2Settings settings;  ///< of an arm without the lockstep
  std::unique_ptr<Ros2Lockstep> arm;
  ArmState state;
  Plan plan;
  Swing swinging{JointVector::Zero(6)};
};

TEST_F(Ros2Faults, FiveMillisecondsWithoutNetworkAreBridged) {
  start();
  swing();
  controller().unplug(3);
  expect_bridged();
}

TEST_F(Ros2Faults, TwentyMillisecondsAreBridged) {
  start();
  swing();
  controller().unplug(10);
  expect_bridged();
}

TEST_F(Ros2Faults, AHundredMillisecondsStopTheArmUntilRestart) {
  start();
  swing();
  controller().unplug(50);
  expect_rest("no joint states");
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, ASecondStopsTheArmUntilRestart) {
  start();
  swing();
  controller().unplug(500);
  expect_rest("no joint states");
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, TrajectoriesLostForTwentyMillisecondsAreBridged) {
  start();
  swing();
  controller().deafen(10);
  expect_bridged();
}

TEST_F(Ros2Faults, TrajectoriesLostForHalfASecondStopTheArm) {
  start();
  swing();
  controller().deafen(250);
  expect_rest("not where its commands lead");
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, AControllerThatLagsIsFollowed) {
  start();
  controller().lag(4);  // 8 ms each way
  swing();
  expect_bridged();
}

TEST_F(Ros2Faults, AControllerThatBeginsToLagStopsTheArm) {
  start();
  swing();
  controller().lag(25);
  EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("no joint states"), std::string_view::npos) << state.reason;
  EXPECT_LT(controller().arm().dq().norm(), 0.02);
  EXPECT_EQ(controller().last_stop(), "");
  // What was on its way comes too late; here, where plans brake as hard as they can, its speed steps by so much.
  EXPECT_LT(controller().largest().dq, 0.25);
}

TEST_F(Ros2Faults, JointsInAnotherOrderAreTheSame) {
  JointVector ends[2];
  for (const bool permuted : {false, true}) {
    clock = ManualClock();
    swinging.forget();
    ReferenceController::Settings order;
    order.permuted = permuted;
    start(order);
    swing();
    ends[permuted ? 1 : 0] = controller().arm().q();
  }
  EXPECT_LT((ends[0] - ends[1]).norm(), 1e-9);
}

TEST_F(Ros2Faults, AWrongNumberOfJointsStopsTheArm) {
  start();
  swing();
  controller().hide_joint(true);
  expect_rest("no joint states that name");
  controller().hide_joint(false);
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, TwoPublishersOfJointStatesStopTheArm) {
  start();
  swing();
  auto other = controller().node().publish<JointStateMessage>(arm->ros2().joint_states);
  ASSERT_TRUE(other);
  send_states(*other, names());
  expect_rest("two publishers");
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, SomebodyElsesTrajectoriesStopTheArm) {
  start();
  swing();
  auto node = Ros2Node::open(arm->ros2().domain);
  ASSERT_TRUE(node);
  auto other = (*node)->publish<JointTrajectoryMessage>(arm->ros2().controller + "/joint_trajectory");
  ASSERT_TRUE(other);
  JointTrajectoryMessage message{};
  std::string frame;
  message.header.frame_id = frame.data();
  EXPECT_TRUE(other->send(message));
  EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("somebody else"), std::string_view::npos) << state.reason;
  EXPECT_EQ(controller().refused(), 1u);  // that one was empty
  EXPECT_LT(controller().arm().dq().norm(), 0.02);
}

TEST_F(Ros2Faults, StrangersAreIgnored) {
  start();
  swing();
  auto other = controller().node().publish<JointStateMessage>(arm->ros2().joint_states);
  ASSERT_TRUE(other);
  send_states(*other, {"gripper"});
  send_states(*other, {});
  std::vector<std::string> fewer = names();
  fewer.pop_back();
  send_states(*other, fewer);
  expect_bridged();
}

TEST_F(Ros2Faults, AClockThatIsSetStopsTheArm) {
  for (const Time change : {Time(std::chrono::seconds(1)), Time(std::chrono::seconds(-1))}) {
    clock = ManualClock();
    swinging.forget();
    start();
    swing();
    controller().set_clock(change);
    EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
    EXPECT_NE(state.reason.find("clock"), std::string_view::npos) << state.reason;
    EXPECT_LT(controller().arm().dq().norm(), 0.02);
  }
}

/// The controller may be stopped with the arm, as the driver does it, give up by its tolerance, or know nothing of it.
TEST_F(Ros2Faults, AProtectiveStopIsNoticedAndNothingJumpsAfterIt) {
  ReferenceController::Settings stopped, gives_up, goes_on;
  gives_up.stopper = goes_on.stopper = false;
  gives_up.parameters.trajectory = 0.08;
  for (const auto& behaviour : {stopped, gives_up, goes_on}) {
    clock = ManualClock();
    swinging.forget();
    start(behaviour);
    swing();
    const double speed = std::abs(state.joints.dq.mean());
    const Time begin = clock.now();
    controller().protective_stop();
    while (state.status == ArmStatus::kFollowing && to_seconds(clock.now() - begin) < 1.0) (void)run(1e-3);
    EXPECT_LT(to_seconds(clock.now() - begin), settings.off_plan_max / speed + 0.02);
    EXPECT_NE(state.reason.find("not where its commands lead"), std::string_view::npos) << state.reason;
    EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);

    arm->restart();  // locked as it is: it stops again as soon as it should move
    EXPECT_EQ(run(2.0).status, ArmStatus::kStopped);
    EXPECT_NE(state.reason.find("not where its commands lead"), std::string_view::npos) << state.reason;

    const JointVector stood = controller().arm().q();
    controller().unlock();
    controller().forget_largest();
    EXPECT_EQ(run(0.5).status, ArmStatus::kStopped);
    EXPECT_LT((controller().arm().q() - stood).norm(), 1e-4);
    EXPECT_EQ(controller().last_stop(), "");
    expect_follows_after_restart();
    EXPECT_LT(controller().largest().ddq, kGentle);
  }
}

TEST_F(Ros2Faults, AKilledProgramLeavesTheArmAtRest) {
  start();
  swing();
  arm->kill_arm();
  for (int i = 0; i < 500; ++i) controller().step();
  EXPECT_LT(controller().arm().dq().norm(), 0.02);
  EXPECT_LT(controller().largest().ddq, 1.05 * model.acceleration_max.maxCoeff());
  EXPECT_EQ(controller().last_stop(), "");
}

TEST_F(Ros2Faults, AControllerThatRestartsIsFoundAgain) {
  start();
  swing();
  const JointVector q = controller().arm().q();
  arm->kill_controller();
  EXPECT_EQ(run(0.2).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("no joint states"), std::string_view::npos) << state.reason;
  arm->start_controller(model, q);
  EXPECT_EQ(run(0.2).status, ArmStatus::kStopped);
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, WithoutAControllerItSaysSo) {
  auto node = Ros2Node::open(settings.domain);
  ASSERT_TRUE(node);
  auto states = (*node)->publish<JointStateMessage>(settings.joint_states);
  ASSERT_TRUE(states);
  settings.silence = 0.03;
  auto made = Ros2Arm::without_thread(model, settings, clock);
  ASSERT_TRUE(made);
  for (int i = 0; i < 2600; ++i) {
    if (i % 5 == 0) send_states(*states, names());
    state = (*made)->receive();
  }
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("no controller listens to " + topic), std::string_view::npos) << state.reason;
}

TEST_F(Ros2Faults, NobodyThereIsAnErrorThatNamesTheTopic) {
  auto made = Ros2Arm::without_thread(model, settings, clock);
  ASSERT_TRUE(made);
  const auto states = (*made)->wait_for_states();
  ASSERT_FALSE(states);
  EXPECT_NE(states.error().message.find(settings.joint_states), std::string::npos) << states.error().message;
}

TEST_F(Ros2Faults, AnotherDomainIsNotSeen) {
  start();
  settings.domain = arm->ros2().domain + 1;
  settings.controller = arm->ros2().controller;
  settings.joint_states = arm->ros2().joint_states;
  auto made = Ros2Arm::without_thread(model, settings, clock);
  ASSERT_TRUE(made);
  ASSERT_EQ(run(0.5).status, ArmStatus::kStarting);
  EXPECT_FALSE((*made)->wait_for_states());
}

TEST_F(Ros2Faults, SettingsThatCannotBeAreRefused) {
  struct Bad {
    const char* word;
    std::function<void(Ros2Settings&)> spoil;
  };
  for (const Bad& bad : {Bad{"ros2.lead is 0.04", [](Ros2Settings& s) { s.lead = 0.04; }},
                         Bad{"ros2.lead is 0.5", [](Ros2Settings& s) { s.lead = 0.5; }},
                         Bad{"ros2.joints", [](Ros2Settings& s) { s.joints = "one,two"; }},
                         Bad{"domain is 233", [](Ros2Settings& s) { s.domain = 233; }},
                         Bad{"topic '//x y", [](Ros2Settings& s) { s.joint_states = "//x y"; }}}) {
    Ros2Settings spoiled = settings;
    bad.spoil(spoiled);
    const auto made = Ros2Arm::without_thread(model, spoiled, clock);
    ASSERT_FALSE(made) << bad.word;
    EXPECT_NE(made.error().message.find(bad.word), std::string::npos) << made.error().message;
  }
}

}  // namespace
}  // namespace steadyhand

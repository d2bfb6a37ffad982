#include "steadyhand/arms/ros2/ros2_gripper.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ros2/ros2_arm.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/fake_gripper_server.hpp"
#include "support/ros2/lockstep.hpp"

namespace steadyhand {
namespace {

constexpr int kSucceeded = 4, kCancelled = 5, kGivenUp = 6;

class Ros2GripperTest : public testing::Test {
 protected:
  Ros2GripperTest() : domain(isolated_ros2_domain()) {
    static int made = 0;
    settings.action = "/gripper" + std::to_string(getpid()) + "_" + std::to_string(made++);
    settings.closed = 0.8;
    settings.max_effort = 12.0;
    node = *Ros2Node::open(domain);
  }
  void join() {
    auto joined = Ros2Gripper::join(*node, settings, clock);
    ASSERT_TRUE(joined) << joined.error().message;
    gripper = *std::move(joined);
  }
  void serve() { server = std::make_unique<FakeGripperServer>(domain, settings.action); }
  /// Talks for so long. Endpoints of one process know each other at once.
  void run(double seconds = 0.2) {
    for (double t = 0.0; t < seconds; t += 0.01) {
      clock.advance(0.01);
      gripper->talk();
    }
  }
  void expect_trouble(const char* words) {
    EXPECT_NE(gripper->why_not().find(words), std::string_view::npos) << gripper->why_not();
    EXPECT_NE(gripper->why_not().find(settings.action), std::string_view::npos) << gripper->why_not();
  }

  int domain;
  ManualClock clock;
  Ros2GripperSettings settings;
  std::unique_ptr<FakeGripperServer> server;
  std::unique_ptr<Ros2Gripper> gripper;
  std::unique_ptr<Ros2Node> node;
};

TEST_F(Ros2GripperTest, EachPlaceThatIsWantedIsAGoalThatReplacesTheOneBefore) {
  join();
  run();
  expect_trouble("no action server");
  serve();
  run();
  EXPECT_EQ(gripper->why_not(), "");
  EXPECT_EQ(server->requests, 0) << "nothing moves before it is wanted";
  EXPECT_FALSE(gripper->position());
  gripper->move_to(0.5);
  run();
  ASSERT_EQ(server->goals.size(), 1u);
  EXPECT_DOUBLE_EQ(server->goals[0].position, 0.4);
  EXPECT_DOUBLE_EQ(server->goals[0].max_effort, 12.0);
  server->feed_back(0.2);
  EXPECT_DOUBLE_EQ(gripper->position().value(), 0.25);
  gripper->move_to(7.0);
  run();
  gripper->move_to(std::numeric_limits<double>::quiet_NaN());
  run();
  ASSERT_EQ(server->goals.size(), 2u);
  EXPECT_DOUBLE_EQ(server->goals[1].position, 0.8);
  EXPECT_EQ(server->goals[0].status, kCancelled);
  EXPECT_EQ(gripper->why_not(), "") << "that a goal was replaced by its own client is in order";
  server->end(kSucceeded, 0.76);
  run();
  EXPECT_NEAR(gripper->position().value(), 0.95, 1e-12) << "as the result tells";
  run(5.0);
  EXPECT_EQ(server->requests, 2);
  EXPECT_EQ(gripper->why_not(), "");
  EXPECT_TRUE(server->cancelled.empty());
}

TEST_F(Ros2GripperTest, AParallelGripperCommandIsSpokenToAsThat) {
  settings.joint = "knuckle";
  join();
  run();
  FakeParallelGripperServer parallel(domain, settings.action);
  run();
  EXPECT_EQ(gripper->why_not(), "");
  gripper->move_to(0.5);
  run();
  ASSERT_EQ(parallel.goals.size(), 1u);
  EXPECT_DOUBLE_EQ(parallel.goals[0].position, 0.4);
  EXPECT_DOUBLE_EQ(parallel.goals[0].max_effort, 12.0);
  parallel.feed_back(0.2);
  EXPECT_DOUBLE_EQ(gripper->position().value(), 0.25);
  parallel.end(kGivenUp, 0.36, true);
  run();
  EXPECT_NEAR(gripper->position().value(), 0.45, 1e-12);
  EXPECT_EQ(gripper->why_not(), "") << "stalled: it holds something";
  gripper->move_to(0.0);
  run();
  parallel.end(kGivenUp, 0.3);
  run();
  expect_trouble("gave up a goal");
}

TEST_F(Ros2GripperTest, GoalsAreTenASecondAtMostAndTheNewestComesThrough) {
  join();
  serve();
  for (int i = 0; i <= 100; ++i) {
    gripper->move_to(0.01 * i);
    run(0.01);
  }
  run();
  EXPECT_LE(server->requests, 11);
  EXPECT_GE(server->requests, 8);
  EXPECT_DOUBLE_EQ(server->goals.back().position, 0.8);
  gripper->move_to(0.995);
  run();
  EXPECT_DOUBLE_EQ(server->goals.back().position, 0.8) << "less than a hundredth is noise";
}

TEST_F(Ros2GripperTest, WhatItHoldsWhenTheSessionBeginsItGoesOnHolding) {
  join();
  serve();
  gripper->measured(0.4);
  run();
  gripper->move_to(0.5);  // what a session says at first: where it is
  run();
  EXPECT_EQ(server->requests, 0);
  gripper->move_to(1.0);
  run();
  EXPECT_EQ(server->requests, 1);
}

TEST_F(Ros2GripperTest, AnObjectBetweenTheFingersIsNoFault) {
  join();
  serve();
  gripper->move_to(1.0);
  run();
  server->end(kGivenUp, 0.4, true);  // as gripper controllers do if the goal is not reached
  run(5.0);
  EXPECT_EQ(gripper->why_not(), "");
  EXPECT_DOUBLE_EQ(gripper->position().value(), 0.5);
  EXPECT_EQ(server->requests, 1);
}

TEST_F(Ros2GripperTest, ThatRejectsAGoalSaysSoAndIsAskedAnewAfterAReset) {
  join();
  serve();
  server->rejects = true;
  gripper->move_to(1.0);
  run(0.6);
  expect_trouble("rejected a goal");
  gripper->move_to(0.2);
  run();
  EXPECT_EQ(server->requests, 1) << "nothing more is asked before a reset";
  server->rejects = false;
  gripper->restart();
  run();
  EXPECT_EQ(gripper->why_not(), "");
  EXPECT_TRUE(server->goals.empty()) << "nor is anything done late";
  gripper->move_to(0.2);
  run();
  ASSERT_EQ(server->goals.size(), 1u);
  EXPECT_DOUBLE_EQ(server->goals[0].position, 0.2 * 0.8);
}

TEST_F(Ros2GripperTest, ThatGivesUpAGoalSaysSo) {
  join();
  serve();
  gripper->move_to(1.0);
  run();
  server->end(kGivenUp, 0.1);
  run();
  expect_trouble("gave up a goal");
}

TEST_F(Ros2GripperTest, ThatDoesNotAnswerSaysSoAndItsGoalIsCancelled) {
  join();
  serve();
  server->silent = true;
  gripper->move_to(1.0);
  run(1.5);
  EXPECT_EQ(gripper->why_not(), "");
  run(1.0);
  expect_trouble("does not answer");
  ASSERT_EQ(server->cancelled.size(), 1u) << "a server that wakes up shall not do it late";
  server->silent = false;
  gripper->restart();
  gripper->move_to(1.0);
  run();
  ASSERT_EQ(server->goals.size(), 1u);
  EXPECT_NE(server->goals[0].id, server->cancelled[0]);
}

TEST_F(Ros2GripperTest, AnotherClientsGoalsAreNoticed) {
  join();
  serve();
  gripper->move_to(1.0);
  run();
  server->end(kSucceeded, 0.8);
  run();
  server->take_other();
  run();
  expect_trouble("another program");
  gripper->restart();
  run();
  EXPECT_EQ(gripper->why_not(), "");
}

TEST_F(Ros2GripperTest, AServerThatGoesIsNoticedAndSoIsASecondOne) {
  join();
  serve();
  run();
  {
    const FakeGripperServer second(domain, settings.action);
    run();
    expect_trouble("more than one");
  }
  run();
  EXPECT_EQ(gripper->why_not(), "") << "nothing was wanted yet";
  gripper->move_to(1.0);
  run();
  server.reset();
  run();
  expect_trouble("no action server");
  serve();
  run();
  expect_trouble("no action server");  // until a reset: no server reports the goal's result
  gripper->restart();
  gripper->move_to(1.0);
  run();
  EXPECT_EQ(gripper->why_not(), "");
  EXPECT_EQ(server->goals.size(), 1u);
}

TEST_F(Ros2GripperTest, PlacesThatAreNoneAreRefused) {
  settings.closed = settings.open;
  const auto joined = Ros2Gripper::join(*node, settings, clock);
  ASSERT_FALSE(joined);
  EXPECT_NE(joined.error().message.find("ros2.gripper_closed"), std::string::npos) << joined.error().message;
}

/// An arm with it: commands open and close it, and it stops the arm when it is not well.
class Ros2ArmWithGripper : public testing::Test {
 protected:
  Ros2ArmWithGripper() : random(4), model(random_arm(6, random, false)) {
    model.home = random_joints(6, 1.0, random);
    model.tools[0].gripper_time = 0.6;
    ros2.gripper.action = "/with" + std::to_string(getpid());
    ros2.gripper.joint = "fingers";
    arm = std::make_unique<Ros2Lockstep>(model, ReferenceController::Settings{}, clock, ros2);
    server = std::make_unique<FakeGripperServer>(arm->ros2().domain, ros2.gripper.action);
  }
  void run(double seconds, double closed) {
    for (const Time end = clock.now() + from_seconds(seconds); clock.now() < end;) {
      state = arm->receive();
      if (state.status != ArmStatus::kFollowing) continue;
      JointCommand command;
      command.stamp = state.joints.stamp;
      command.q = model.home;
      command.dq = command.ddq = JointVector::Zero(6);
      command.gripper[0] = closed;
      make_straight_stop(model, command, 0.0, plan);
      arm->follow(plan);
      arm->send(command);
    }
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
  Ros2Settings ros2;
  std::unique_ptr<Ros2Lockstep> arm;
  std::unique_ptr<FakeGripperServer> server;
  ArmState state;
  Plan plan;
};

TEST_F(Ros2ArmWithGripper, IsLedByItsCommandsAndStopsWhenTheGripperIsNotWell) {
  EXPECT_TRUE(arm->info().gripper[0]);
  run(1.5, 0.75);
  ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  ASSERT_EQ(server->goals.size(), 1u);
  EXPECT_DOUBLE_EQ(server->goals[0].position, 0.6);
  server->feed_back(0.6);
  run(0.1, 0.75);
  EXPECT_NEAR(state.joints.gripper[0].value_or(-1.0), 0.75, 1e-12);
  server->rejects = true;
  run(1.0, 0.0);
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("rejected a goal"), std::string_view::npos) << state.reason;
  EXPECT_EQ(server->goals[0].status, 2) << "it keeps its grip: the goal before is not given up";
  EXPECT_TRUE(server->cancelled.empty());
  server->rejects = false;
  arm->restart();
  run(1.5, 0.75);
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  ASSERT_EQ(server->goals.size(), 2u);
  EXPECT_DOUBLE_EQ(server->goals[1].position, 0.6);
}

TEST_F(Ros2ArmWithGripper, StopsWhenTheGripperIsSilentAndTheFingersKeepTheirGrip) {
  run(1.5, 0.75);
  ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  server->silent = true;
  run(3.0, 0.0);
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("does not answer"), std::string_view::npos) << state.reason;
  ASSERT_EQ(server->cancelled.size(), 1u);
  EXPECT_NE(server->cancelled[0], server->goals[0].id) << "the goal that holds is not cancelled";
}

TEST_F(Ros2ArmWithGripper, JointStatesTellWhereItIsAndWithoutAServerItDoesNotBegin) {
  auto driver = Ros2Node::open(arm->ros2().domain);
  auto states = (*driver)->publish<JointStateMessage>(arm->ros2().joint_states);
  ASSERT_TRUE(states);
  std::string name = "fingers", frame;
  std::vector<char*> names{name.data()};
  std::vector<double> at{0.2};
  JointStateMessage message{};
  message.header.frame_id = frame.data();
  message.name = sequence_of<decltype(message.name)>(names);
  message.position = sequence_of<decltype(message.position)>(at);
  EXPECT_TRUE(states->send(message));
  run(0.1, 0.25);
  EXPECT_NEAR(state.joints.gripper[0].value_or(-1.0), 0.25, 1e-12);
  server.reset();
  run(8.0, 0.25);
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("no action server"), std::string_view::npos) << state.reason;
}

}  // namespace
}  // namespace steadyhand

// Faults of an arm in motion behind a ROS 2 controller; docs/reference/ros2.md has a row for each test.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/lockstep.hpp"
#include "support/swing.hpp"

namespace steadyhand {
namespace {

constexpr double kGentle = 6.0;  ///< rad/s^2: the swing's 3.6, and what two differences of rounded stamps add

/// Mock hardware of ros2_control: its position is always exactly the commanded one.
ReferenceController::Settings mock_hardware() {
  ReferenceController::Settings settings;
  settings.servo_lag = 0.0;
  settings.hardware_speed = settings.hardware_acceleration = 1e6;
  return settings;
}

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

  /// Continues the swing for `seconds`, up to 1.8 rad/s, as long as the arm follows. Returns its last state.
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
  /// Follows a plan to its end, as long as the arm does.
  void follow(const Plan& to_rest, double seconds) {
    const Time end = clock.now() + from_seconds(seconds);
    for (bool told = false; clock.now() < end;) {
      state = arm->receive();
      if (state.status != ArmStatus::kFollowing) continue;
      if (!told) arm->follow(to_rest);
      told = true;
      JointCommand command = sample(to_rest, state.joints.stamp.made);
      command.stamp = {state.joints.stamp.made, state.joints.stamp.made};
      arm->send(command);
    }
  }
  /// Moves fast when the fault comes.
  void swing() {
    ASSERT_EQ(run(1.8).status, ArmStatus::kFollowing) << state.reason;
    ASSERT_GT(std::abs(state.joints.dq.mean()), 1.0);
    controller().forget_largest();
  }
  void expect_bridged() {
    EXPECT_EQ(run(1.0).status, ArmStatus::kFollowing) << state.reason;
    EXPECT_LT(controller().largest().ddq, kGentle);
    EXPECT_LT(std::abs(swinging.error()), 0.02);
    EXPECT_EQ(controller().last_stop(), "");
  }
  /// The arm follows its last plan to the end and stops there, and the session reports why.
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
  /// A second publisher of joint states, next to the controller's.
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
  Ros2Settings settings;  ///< for an arm without the lockstep
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
  expect_rest("does not execute");
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, AControllerThatLagsIsFollowed) {
  start();
  controller().lag(4);  // 8 ms each way
  swing();
  expect_bridged();
}

TEST_F(Ros2Faults, AControllerThatBeginsToLagStopsTheArm) {
  start(mock_hardware());  // other hardware would stop by itself
  swing();
  controller().lag(25);
  EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("no joint states"), std::string_view::npos) << state.reason;
  EXPECT_LT(controller().arm().dq().norm(), 0.02);
  // Plans on their way arrive too late. Here, where plans brake as hard as they can, the speed steps by at most this
  // much.
  EXPECT_LT(controller().largest().dq, 0.35);
}

TEST_F(Ros2Faults, AControllerThatIsSlowedDownStopsTheArm) {
  start(mock_hardware());
  swing();
  controller().scale(0.5);
  EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("does not execute"), std::string_view::npos) << state.reason;
  EXPECT_LT(controller().arm().dq().norm(), 0.02);
  EXPECT_LT(controller().largest().q, 0.01);  // one splice at most: 0.0036 of it are the motion
  EXPECT_EQ(controller().refused(), 0u) << controller().last_refusal();
}

TEST_F(Ros2Faults, WhileTheHardwareSaysThatItIsSlowedDownNothingMoves) {
  ReferenceController::Settings slider;
  slider.speed_scaling = topic + "/speed_scaling";
  Ros2Settings ros2;
  ros2.speed_scaling = slider.speed_scaling;
  arm = std::make_unique<Ros2Lockstep>(model, slider, clock, ros2);
  controller().scale(0.99);
  EXPECT_EQ(run(6.0).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("100 %"), std::string_view::npos) << state.reason;
  EXPECT_EQ(controller().accepted(), 0u);
  controller().scale(1.0);
  arm->restart();
  swing();
  controller().scale(0.99);
  EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("100 %"), std::string_view::npos) << state.reason;
  EXPECT_LT(controller().arm().dq().norm(), 0.02);
  EXPECT_LT(controller().largest().ddq, 1.05 * model.acceleration_max.maxCoeff());
}

TEST_F(Ros2Faults, AStepOfTheJointsStopsTheArm) {
  for (const double step : {0.015, -0.015}) {  // below what counts as off the plan
    clock = ManualClock();
    swinging.forget();
    start();
    swing();
    controller().arm().push(JointVector::Constant(6, step));
    (void)run(0.02);
    EXPECT_EQ(state.status, ArmStatus::kStopped) << step;
    EXPECT_NE(state.reason.find("the joints jumped"), std::string_view::npos) << state.reason;
  }
}

TEST_F(Ros2Faults, AnInactiveControllerIsNotLed) {
  ReferenceController::Settings loaded;
  loaded.active = false;
  start(loaded);
  EXPECT_EQ(run(6.0).status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("is not active"), std::string_view::npos) << state.reason;
  EXPECT_EQ(controller().refused(), 0u);
  controller().activate(true);
  expect_follows_after_restart();
}

TEST_F(Ros2Faults, AControllerThatIsDeactivatedStopsTheArm) {
  start(mock_hardware());
  swing();
  controller().activate(false);
  EXPECT_EQ(run(0.3).status, ArmStatus::kStopped);
  controller().activate(true);
  const JointVector stood = controller().arm().q();
  EXPECT_EQ(run(0.5).status, ArmStatus::kStopped);
  EXPECT_LT((controller().arm().q() - stood).norm(), 1e-4);
  expect_follows_after_restart();
}

/// The first number behind a key in the parameters of our launch file.
double launched(const std::string& key) {
  std::ifstream file(STEADYHAND_ROOT "/ros2/config/steadyhand_controllers.yaml");
  for (std::string line; std::getline(file, line);) {
    const std::size_t at = line.find(key + ": ");
    if (at != std::string::npos && line.find('#') == std::string::npos)
      return std::stod(line.substr(at + key.size() + 2));
  }
  ADD_FAILURE() << key;
  return 0.0;
}

/// With the tolerances of our launch file it holds the arm at its present position and does not catch up.
TEST_F(Ros2Faults, AControllerManagerThatWasFrozenDoesNotMakeTheArmJump) {
  for (const int cycles : {75, 150, 500}) {
    clock = ManualClock();
    swinging.forget();
    ReferenceController::Settings ours = mock_hardware();
    ours.parameters.trajectory = launched("{trajectory");
    ours.parameters.goal = launched(", goal");
    ours.parameters.goal_time = launched(" goal_time");
    start(ours);
    swing();
    controller().freeze(cycles);
    EXPECT_EQ(run(2.5).status, ArmStatus::kStopped);
    EXPECT_NE(state.reason.find("no joint states"), std::string_view::npos) << state.reason;
    EXPECT_LT(controller().largest().q, 0.004) << cycles;
    EXPECT_LT(controller().arm().dq().norm(), 0.02);
    arm->restart();
    EXPECT_EQ(run(1.5).status, ArmStatus::kFollowing) << state.reason;
    EXPECT_GT(std::abs(state.joints.dq.mean()), 1.0);
  }
}

TEST_F(Ros2Faults, AfterAStallItGoesOnAlongThePlanThatTheControllerHas) {
  for (const double stall : {0.02, 0.045, 0.08}) {
    clock = ManualClock();
    swinging.forget();
    start();
    swing();
    follow(plan, 0.02);
    clock.advance(stall);
    follow(plan, 1.0);
    EXPECT_EQ(state.status, ArmStatus::kFollowing) << stall << state.reason;
    EXPECT_LT(controller().largest().ddq, 1.05 * model.acceleration_max.maxCoeff()) << stall;
    EXPECT_LT(controller().arm().dq().norm(), 0.02);
    EXPECT_EQ(controller().last_stop(), "");
  }
}

/// After a stall the next plan starts where the controller reports that it has moved, so there is no step.
TEST_F(Ros2Faults, AfterAStallAnotherPlanBeginsWhereTheControllerHasGone) {
  for (const double stall : {0.02, 0.032, 0.045, 0.08}) {
    clock = ManualClock();
    swinging.forget();
    start();
    swing();
    clock.advance(stall);
    state = arm->receive();
    ASSERT_TRUE(state.carried_on) << stall;
    const JointCommand own = *state.carried_on;
    make_straight_stop(model, own, 1.5 * stop_time(model, own.dq), plan);
    arm->follow(plan);
    arm->send(sample(plan, state.joints.stamp.made));
    follow(plan, 1.0);
    EXPECT_EQ(state.status, ArmStatus::kFollowing) << stall << state.reason;
    EXPECT_LT(controller().largest().ddq, 1.05 * model.acceleration_max.maxCoeff()) << stall;
    EXPECT_LT(controller().arm().dq().norm(), 0.02);
    EXPECT_EQ(controller().last_stop(), "");
  }
}

/// Its speeds are differences of positions.
TEST_F(Ros2Faults, AnArmThatTellsPositionsOnlyIsFollowed) {
  ReferenceController::Settings positions;
  positions.told_speeds = NAN;
  start(positions);
  swing();
  EXPECT_LT((state.joints.dq - controller().arm().dq()).cwiseAbs().maxCoeff(), 0.2);
  expect_bridged();
}

/// The reason differs from the one for an arm that sends nothing.
TEST_F(Ros2Faults, JointStatesThatCannotBeUsedAreNamed) {
  using Settings = ReferenceController::Settings;
  const std::pair<const char*, std::function<void(Settings&)>> bads[] = {
      {"carry no stamp", [](Settings& s) { s.stamp = Time(0); }},
      {"does not change, so trajectories cannot be timed", [](Settings& s) { s.stamp = s.epoch; }},
      {"a position that is not a finite number", [](Settings& s) { s.told_positions = NAN; }},
      {"have less than 29 Hz", [](Settings& s) { s.states_every = 20; }},
      {"have less than 29 Hz", [](Settings& s) { s.states_every = 50; }},
      {"real-time factor of 1", [](Settings& s) { s.pace = 0.95; }},
      {"real-time factor of 1", [](Settings& s) { s.pace = 2.0; }},
      {"is beyond its position limits, ", [this](Settings&) { model.position_max[2] = -M_PI; }}};
  for (const auto& [words, spoil] : bads) {
    clock = ManualClock();
    ReferenceController::Settings spoiled;
    spoil(spoiled);
    start(spoiled);
    EXPECT_EQ(run(6.0).status, ArmStatus::kStopped) << words;
    EXPECT_NE(state.reason.find(words), std::string_view::npos) << state.reason;
    EXPECT_LT(controller().arm().dq().norm(), 0.02);
  }
}

TEST_F(Ros2Faults, AnArmWithoutLagIsFollowedAtFullSpeed) {
  start(mock_hardware());
  swing();
  expect_bridged();
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
  expect_rest("no joint states with this");
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
  EXPECT_NE(state.reason.find("another program"), std::string_view::npos) << state.reason;
  EXPECT_EQ(controller().refused(), 1u);  // that one was empty
  EXPECT_LT(controller().arm().dq().norm(), 0.02);
}

/// A clock that fails when it is asked for the time, as anything may for want of memory.
class FailingClock final : public Clock {
 public:
  Time now() const override {
    if (fails) throw std::runtime_error("no time");
    return time.now();
  }
  void sleep_until(Time deadline) override { time.sleep_until(deadline); }
  ManualClock time;
  bool fails = false;
};

TEST_F(Ros2Faults, WhatAThreadOfDdsThrowsStopsTheArm) {
  FailingClock failing;
  Ros2Lockstep lockstep(model, {}, failing);
  const auto state_after = [&](double seconds) {
    ArmState last;
    for (const Time end = failing.now() + from_seconds(seconds); failing.now() < end;) {
      last = lockstep.receive();
      if (last.status != ArmStatus::kFollowing) continue;
      JointCommand stands = {last.joints.stamp, model.home, JointVector::Zero(6), JointVector::Zero(6)};
      stand(model.home, failing.now(), plan);
      lockstep.follow(plan);
      lockstep.send(stands);
    }
    return last;
  };
  EXPECT_EQ(state_after(1.5).status, ArmStatus::kFollowing);
  auto other = lockstep.controller->node().publish<JointStateMessage>(lockstep.ros2().joint_states);
  ASSERT_TRUE(other);
  failing.fails = true;
  send_states(*other, {});
  failing.fails = false;
  const ArmState stopped = state_after(0.1);
  EXPECT_EQ(stopped.status, ArmStatus::kStopped);
  EXPECT_NE(stopped.reason.find("ROS 2 failed"), std::string_view::npos) << stopped.reason;
  lockstep.restart();
  EXPECT_EQ(state_after(1.5).status, ArmStatus::kFollowing);
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

/// As does a first state that was long on its way.
TEST_F(Ros2Faults, AClockThatIsSetBeforeTheArmFollowsDoesNotKeepItFromIt) {
  for (const Time change : {Time(std::chrono::seconds(1)), Time(std::chrono::seconds(-1))}) {
    for (const double after : {0.1, 0.4}) {
      clock = ManualClock();
      swinging.forget();
      start();
      EXPECT_EQ(run(after).status, ArmStatus::kStarting);
      controller().set_clock(change);
      EXPECT_EQ(run(3.0).status, ArmStatus::kFollowing) << state.reason;
      EXPECT_EQ(controller().last_stop(), "");
    }
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
    const double braking = 0.5 * speed / (behaviour.hardware_acceleration * model.acceleration_max.minCoeff());
    EXPECT_LT(to_seconds(clock.now() - begin), settings.path_tolerance / speed + braking + 0.02);
    EXPECT_NE(state.reason.find("not at its commanded position"), std::string_view::npos) << state.reason;
    EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);

    arm->restart();  // locked as it is: it stops again as soon as it should move, or does not begin
    EXPECT_EQ(run(6.0).status, ArmStatus::kStopped);
    const std::string_view why = behaviour.stopper ? "is not active" : "not at its commanded position";
    EXPECT_NE(state.reason.find(why), std::string_view::npos) << state.reason;

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
  settings.state_timeout = 0.03;
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
  for (const Bad& bad : {Bad{"ros2.look_ahead is 0.04", [](Ros2Settings& s) { s.look_ahead = 0.04; }},
                         Bad{"ros2.look_ahead is 0.5", [](Ros2Settings& s) { s.look_ahead = 0.5; }},
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

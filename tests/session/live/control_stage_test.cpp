// The control stage alone: plans and states are handed to it as a test wants them.
#include "steadyhand/session/live/control_stage.hpp"

#include "steadyhand/arms/driver/carry_on.hpp"
#include "steadyhand/arms/driver/command_check.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

/// An arm that follows its commands after a delay.
struct Loop {
  explicit Loop(const RobotModel& arm, ControlSettings settings = {}) : model(arm), delay(settings.arm_delay) {
    settings.soft_stop = 0.0;
    control = std::make_unique<ControlStage>(model, settings, links);
    state.status = ArmStatus::kFollowing;
    state.joints = {{}, model.home, JointVector::Zero(model.dof())};
    state.joints.stamp.made = std::chrono::seconds(5);
    command = {state.joints.stamp, model.home, state.joints.dq, state.joints.dq};
    for (int i = 0; i < 3; ++i) cycle();
    EXPECT_EQ(control->state(), SupervisionState::kReady);
  }

  const JointCommand& cycle() {
    ++state.cycle;
    state.joints.stamp.made += kPeriod;
    commands.push_back(command);
    const Time then = now() - from_seconds(delay);
    for (const JointCommand& c : commands) {
      if (c.stamp.made <= then) state.joints.q = c.q + to_seconds(then - c.stamp.made) * c.dq;
    }
    state.joints.q[0] = std::min(state.joints.q[0], wall);
    state.joints.dq = command.dq;
    state.joints.dq[0] += still_moves;
    return command = control->step(state).command;
  }
  /// `cycles` in which the arm continued by itself; it is measured `astray` rad from there.
  const JointCommand& gap(int cycles, double astray = 0.0) {
    const CarryOn how{0.004, model.acceleration_max};
    const JointCommand before = command;
    command = carried_on(before, 0.002 * cycles, how);
    state.cycle += static_cast<std::uint64_t>(cycles);
    state.joints.stamp.made += cycles * kPeriod;
    state.carried_on = command;
    ++state.cycle;
    state.joints.stamp.made += kPeriod;
    state.joints.q = carried_on(before, 0.002 * (cycles + 1) - delay, how).q.array() + astray;
    state.joints.q[0] = std::min(state.joints.q[0], wall);
    command = control->step(state).command;
    state.carried_on.reset();
    return command;
  }
  ControlView view() {
    ControlView seen;
    EXPECT_TRUE(links.control_view.read(seen));
    return seen;
  }
  Time now() const { return state.joints.stamp.made; }
  /// A plan from home on, these accelerations of two joints for 20 ms each.
  Plan plan(const std::vector<double>& first, const std::vector<double>& last) const {
    Plan made;
    stand(model.home, now() + 5 * kPeriod, made);
    made.dt = 0.02;
    made.intervals = static_cast<int>(first.size());
    for (int k = 0; k < made.intervals; ++k) {
      made.u[k] = JointVector::Zero(6);
      made.u[k][0] = first[k];
      made.u[k][5] = last[k];
      const JointVector q = made.x[k].head(6), dq = made.x[k].tail(6);
      made.x[k + 1].resize(12);
      made.x[k + 1] << q + made.dt * dq + 0.5 * made.dt * made.dt * made.u[k], dq + made.dt * made.u[k];
    }
    return made;
  }

  static constexpr Time kPeriod = std::chrono::milliseconds(2);
  RobotModel model;
  double delay;
  Links links;
  std::unique_ptr<ControlStage> control;
  ArmState state;
  JointCommand command;
  std::vector<JointCommand> commands;
  double wall = std::numeric_limits<double>::infinity();  ///< rad: the first joint comes no further
  double still_moves = 0.0;                               ///< rad/s: the first joint is measured to be so much faster
};

/// The first joint turns fast; the last one moves a little just then.
const std::vector<double> kTurn = {15, 15, 15, 15, 15, 15, 15, -15, -15, -15, -15, -15, -15, -15},
                          kMove = {0, 0, 0, 0, 0, 15, 0, -15, 0, 0, 0, 0, 0, 0};

/// Brakes in the fastest moment; where the last joint may not go beyond `room` rad from home.
struct Braked {
  double farthest = 0.0;  ///< rad, of the last joint
  double astray = 0.0;    ///< rad, most, from the plan
  double took = 0.0;      ///< s
};
Braked brake(double room) {
  RobotModel model = ur5e();
  model.position_max[5] = model.home[5] + room;
  Loop loop(model);
  const Plan plan = loop.plan(kTurn, kMove);
  loop.links.plan.write(plan);
  while (loop.now() < plan.start + std::chrono::milliseconds(140)) loop.cycle();
  EXPECT_NEAR(loop.command.dq[0], 2.1, 0.05);
  EXPECT_NEAR(loop.command.dq[5], 0.3, 0.05);
  const Time begin = loop.now();
  loop.links.asked.stop();
  Braked result;
  do {
    const JointCommand& c = loop.cycle();
    EXPECT_EQ(loop.control->state(), SupervisionState::kStopping);
    result.farthest = std::max(result.farthest, c.q[5] - model.home[5]);
    result.astray = std::max(result.astray, (c.q - sample(plan, loop.now()).q).cwiseAbs().maxCoeff());
  } while (!loop.control->at_rest() && loop.now() < begin + std::chrono::seconds(1));
  result.took = to_seconds(loop.now() - begin);
  EXPECT_TRUE(loop.command.dq.isZero(0.0));
  return result;
}

TEST(Brake, LeadsStraightOnWhereThereIsRoom) {
  const Braked result = brake(1.0);
  EXPECT_NEAR(result.took, 2.1 / 15.0, 0.006);
  EXPECT_GT(result.farthest, 0.025);  // 9 mrad, and on for half the time at 0.3 rad/s
  EXPECT_GT(result.astray, 0.01);
}

TEST(Brake, FollowsItsPlanToTheEndIfStraightOnWouldLeadIntoALimit) {
  const Braked result = brake(0.014);
  EXPECT_LT(result.farthest, 0.0125);  // as planned
  EXPECT_LT(result.astray, 1e-12);
  EXPECT_NEAR(result.took, 2.1 / 15.0, 0.006);
}

TEST(Gripper, FollowsTheHandButNotThroughAStop) {
  ControlSettings settings;
  settings.gripper = {true};
  Loop loop(*open_robot("ur5e"), settings);
  EXPECT_FALSE(loop.cycle().gripper[0]) << "nobody has told where it is, nor where it is to be";
  HandReport hand;
  const auto wants = [&](double gripper) {
    hand.gripper = gripper;
    hand.received = hand.good = hand.gripper_said = loop.now();
    loop.links.hands.write({hand});
    return loop.cycle().gripper[0];
  };
  EXPECT_EQ(wants(0.7), 0.7);
  EXPECT_EQ(loop.cycle().gripper[0], 0.7);
  loop.links.asked.stop();
  loop.cycle();
  ASSERT_EQ(loop.control->state(), SupervisionState::kStopping);
  EXPECT_EQ(wants(0.0), 0.7) << "it lets go of what it holds";
  loop.links.asked.reset();
  for (int i = 0; i < 50 && loop.control->state() != SupervisionState::kReady; ++i) loop.cycle();
  ASSERT_EQ(loop.control->state(), SupervisionState::kReady);
  EXPECT_EQ(loop.cycle().gripper[0], 0.7) << "what was wanted meanwhile is not done later";
  EXPECT_EQ(wants(0.2), 0.2);
}

TEST(Gripper, WhatIsWantedWhileTheArmGetsReadyIsDoneThenButNotThroughAStopNorLate) {
  const auto gets_ready = [](double seconds, bool stopped) {
    ControlSettings settings;
    settings.gripper = {true};
    Loop loop(*open_robot("ur5e"), settings);
    loop.state.joints.gripper[0] = 0.25;
    loop.state.status = ArmStatus::kStopped;  // switched off and on again
    loop.cycle();
    loop.links.asked.reset();
    loop.state.status = ArmStatus::kStarting;
    for (int i = 0; i < 200 && loop.control->state() != SupervisionState::kIdle; ++i) loop.cycle();
    EXPECT_EQ(loop.control->state(), SupervisionState::kIdle);
    HandReport hand;
    hand.gripper = 1.0;
    hand.received = hand.good = hand.gripper_said = loop.now();
    loop.links.hands.write({hand});
    for (double t = 0.0; t < seconds; t += 0.002) EXPECT_EQ(loop.cycle().gripper[0], 0.25);
    if (stopped) {
      loop.links.asked.stop();
      loop.cycle();
      EXPECT_EQ(loop.control->state(), SupervisionState::kStopping);
      loop.links.asked.reset();
    }
    loop.state.status = ArmStatus::kFollowing;
    for (int i = 0; i < 200 && loop.control->state() != SupervisionState::kReady; ++i) loop.cycle();
    EXPECT_EQ(loop.control->state(), SupervisionState::kReady);
    return loop.cycle().gripper[0].value_or(-1.0);
  };
  EXPECT_EQ(gets_ready(1.0, false), 1.0);
  EXPECT_EQ(gets_ready(1.0, true), 0.25) << "after a stop";
  EXPECT_EQ(gets_ready(5.1, false), 0.25) << "long after";
}

TEST(Gripper, OfAnArmWithoutOneIsNotCommanded) {
  Loop loop(*open_robot("ur5e"));
  HandReport hand;
  hand.gripper = 1.0;
  loop.links.hands.write({hand});
  EXPECT_FALSE(loop.cycle().gripper[0]);
}

/// A plan is followed only if it begins in time and on what is followed.
TEST(TakingPlans, OnesThatDoNotContinueWhatIsFollowedAreRefused) {
  const auto taken = [](const std::function<void(Plan&)>& spoil) {
    Loop loop(ur5e());
    Plan plan = loop.plan(kTurn, kMove);
    spoil(plan);
    loop.links.plan.write(plan);
    for (int i = 0; i < 20; ++i) loop.cycle();
    ControlView view;
    EXPECT_TRUE(loop.links.control_view.read(view));
    EXPECT_EQ(view.plans + view.rejected_plans, 1u);
    EXPECT_EQ(view.plans == 1, loop.command.dq[0] > 0.0);
    return view.plans == 1;
  };
  EXPECT_TRUE(taken([](Plan&) {}));
  EXPECT_TRUE(taken([](Plan& p) { p.start -= 4 * Loop::kPeriod - Time(1); }));
  EXPECT_FALSE(taken([](Plan& p) { p.start -= 5 * Loop::kPeriod; }));  // that cycle is over
  EXPECT_FALSE(taken([](Plan& p) { p.x[0][3] += 1e-5; }));
  EXPECT_FALSE(taken([](Plan& p) { p.x[0][9] += 1e-5; }));
}

TEST(TakingPlans, NoneInAHardStopThoughItContinuesThat) {
  Loop loop(ur5e());
  const Plan plan = loop.plan(kTurn, kMove);
  loop.links.plan.write(plan);
  while (loop.now() < plan.start + std::chrono::milliseconds(140)) loop.cycle();
  const std::uint64_t plans = loop.view().plans;
  loop.links.asked.stop();
  const JointCommand braking = loop.cycle();
  Plan slower;
  make_straight_stop(loop.model, braking, 0.0, slower);
  const JointCommand later = sample(slower, loop.now() + 10 * Loop::kPeriod);
  make_straight_stop(loop.model, later, 1.0, slower);
  loop.links.plan.write(slower);
  for (int i = 0; i < 80; ++i) loop.cycle();
  EXPECT_TRUE(loop.control->at_rest());
  EXPECT_EQ(loop.view().plans, plans);
}

/// The expected position of a delay ago is on the arm's own path in the gap, not where its earlier speed would have
/// taken it.
TEST(OffPath, IsJudgedByWhereTheArmWentInAGap) {
  for (const double delay : {0.0, 0.02}) {
    for (const bool astray : {false, true}) {
      ControlSettings settings;
      settings.arm_delay = delay;
      settings.path_tolerance = 0.002;
      Loop loop(ur5e(), settings);
      const Plan plan = loop.plan(kTurn, kMove);
      loop.links.plan.write(plan);
      while (loop.now() < plan.start + std::chrono::milliseconds(130)) {
        loop.cycle();
        ASSERT_EQ(loop.control->state(), SupervisionState::kReady) << delay;
      }
      const JointCommand own = loop.gap(25, astray ? 0.0025 : 0.0);
      EXPECT_EQ(loop.control->state(), astray ? SupervisionState::kStopping : SupervisionState::kReady) << delay;
      EXPECT_LT(own.dq[0], 2.1 - 15.0 * 0.045);
    }
  }
}

/// For any delay that the settings allow.
TEST(OffPath, IsSeenHoweverLateTheArmIsMeasured) {
  for (const double delay : {0.1, 0.3, 1.0}) {
    ControlSettings settings;
    settings.arm_delay = delay;
    Loop loop(ur5e(), settings);
    for (int i = 0; i < 1000; ++i) loop.cycle();
    ASSERT_EQ(loop.control->state(), SupervisionState::kReady) << delay;
    loop.state.joints.q[0] += 2.0 * settings.path_tolerance;
    loop.commands.clear();  // it stays there
    loop.cycle();
    EXPECT_EQ(loop.control->state(), SupervisionState::kStopping) << delay;
  }
}

/// If an arm is taken over again, commands from before, elsewhere, do not count.
TEST(OffPath, BeginsAnewWhereTheArmIsTakenOver) {
  ControlSettings settings;
  settings.arm_delay = 0.02;
  Links links;
  ControlStage control(ur5e(), settings, links);
  ArmState state;
  state.joints = {{}, ur5e().home, JointVector::Zero(6)};
  for (int i = 0; i < 50; ++i) {
    ++state.cycle;
    state.joints.stamp.made += Loop::kPeriod;
    if (i == 20) {
      state.joints.q.array() += 0.1;
      state.status = ArmStatus::kFollowing;
    }
    EXPECT_EQ(control.step(state).command.q, state.joints.q);
    EXPECT_EQ(control.state(), i < 20 ? SupervisionState::kIdle : SupervisionState::kReady);
  }
}

/// For any reason to stop, and even if cycles are missed on the way: an arm that is held off its commands does not
/// press on. The commands end where the arm is measured.
TEST(OffPath, EndsWhereTheArmIsMeasured) {
  enum class Why { kOffPath, kStop, kFailure, kMissedCycles };
  for (const double delay : {0.0, 0.014, 0.2}) {
    for (const Why why : {Why::kOffPath, Why::kStop, Why::kFailure, Why::kMissedCycles}) {
      ControlSettings settings;
      settings.arm_delay = delay;
      Loop loop(ur5e(), settings);
      loop.wall = ur5e().home[0] + 0.05;
      const Plan plan = loop.plan(kTurn, kMove);
      loop.links.plan.write(plan);
      const Time asked = plan.start + std::chrono::milliseconds(110), end = asked + std::chrono::milliseconds(1500);
      CommandCheck limits(ur5e());
      JointVector before;
      for (bool missed = false; loop.now() < end;) {
        if (loop.now() >= asked && why == Why::kStop) loop.links.asked.stops = 1;
        if (loop.now() >= asked && why == Why::kFailure) loop.links.failure = "it failed";
        before = loop.command.q;
        EXPECT_EQ(limits.refusal(loop.cycle(), loop.state.joints.q), "");
        if (why != Why::kMissedCycles || missed || loop.command.dq[0] >= 0.0) continue;
        missed = true;  // on the way back
        limits.take(loop.gap(3));
      }
      const std::string which = fmt::format("case {}, delay {}", static_cast<int>(why), delay);
      EXPECT_EQ(loop.control->state(), why == Why::kFailure ? SupervisionState::kFault : SupervisionState::kStopping);
      EXPECT_LT((loop.command.q - loop.state.joints.q).cwiseAbs().maxCoeff(), 1e-9) << which;
      EXPECT_TRUE(loop.control->at_rest() && loop.command.q == before) << which;
    }
  }
}

/// While it moves to its measured position it obeys a stop as at any other time, and stays there.
TEST(OffPath, AStopEndsTheMoveToTheMeasuredPose) {
  for (const bool fails : {false, true}) {
    Loop loop(ur5e());
    loop.wall = ur5e().home[0] + 0.05;
    loop.links.plan.write(loop.plan(kTurn, kMove));
    for (int i = 0; i < 1000 && loop.command.dq[0] > -0.5; ++i) loop.cycle();
    ASSERT_EQ(loop.control->state(), SupervisionState::kStopping);
    ASSERT_LT(loop.command.dq[0], -0.5) << "it moves back";
    if (fails) loop.links.failure = "it failed";
    if (!fails) loop.links.asked.stops = 1;
    const Time still = loop.now() + from_seconds(stop_time(loop.model, loop.command.dq)) + 3 * Loop::kPeriod;
    while (loop.now() < still) loop.cycle();
    const JointVector q = loop.command.q;
    for (int i = 0; i < 500; ++i) loop.cycle();
    EXPECT_EQ(loop.command.q, q);
    EXPECT_GT(q[0] - loop.state.joints.q[0], 1e-3) << "the way was not at its end";
  }
}

/// The commands follow an arm that sinks under a load once, and not all the way down.
TEST(OffPath, FollowsAnArmThatSinksOnce) {
  Loop loop(ur5e());
  for (const double sunk : {0.06, 0.12, 0.18}) {
    loop.wall = loop.model.home[0] - sunk;
    for (int i = 0; i < 500; ++i) loop.cycle();
    EXPECT_NEAR(loop.command.q[0], loop.model.home[0] - 0.06, 1e-9);
    EXPECT_EQ(loop.control->state(), SupervisionState::kStopping);
  }
}

/// An arm that still moves may be on its way back to the commands. A measured speed that never ends is noise.
TEST(OffPath, IsFollowedOnceTheArmStands) {
  for (const bool for_good : {false, true}) {
    Loop loop(ur5e());
    loop.wall = loop.model.home[0] - 0.06;
    loop.still_moves = 0.1;
    for (int i = 0; i < 200; ++i) loop.cycle();
    ASSERT_EQ(loop.control->state(), SupervisionState::kStopping);
    EXPECT_EQ(loop.command.q, loop.model.home);
    if (!for_good) loop.still_moves = 0.0;
    for (int i = 0; i < 200; ++i) loop.cycle();
    EXPECT_NEAR(loop.command.q[0], loop.wall, 1e-9) << for_good;
  }
}

TEST(OffPath, IsNotFollowedFarAway) {
  Loop loop(ur5e());
  loop.wall = loop.model.home[0] - 0.4;  // as a wrong encoder has it
  for (int i = 0; i < 500; ++i) loop.cycle();
  EXPECT_EQ(loop.control->state(), SupervisionState::kStopping);
  EXPECT_EQ(loop.command.q, loop.model.home);
}

/// A hard stop in which cycles are lost takes no longer than one in which none are.
TEST(LostCycles, InAHardStopLeaveItAHardStop) {
  for (const int lost : {1, 5, 20}) {
    Loop loop(ur5e());
    const Plan plan = loop.plan(kTurn, kMove);
    loop.links.plan.write(plan);
    while (loop.now() < plan.start + std::chrono::milliseconds(140)) loop.cycle();
    loop.links.asked.stop();
    const Time begin = loop.now();
    loop.cycle();
    loop.gap(lost);
    while (!loop.control->at_rest() && loop.now() < begin + std::chrono::seconds(1)) loop.cycle();
    EXPECT_LE(to_seconds(loop.now() - begin), 2.1 / 15.0 + 0.006) << lost;
  }
}

/// After missed cycles commands return to the plan that was checked, which is followed to its end.
TEST(AfterMissedCycles, CommandsReturnToThePlan) {
  for (const int missed : {1, 4, 9, 24}) {
    Loop loop(ur5e());
    const Plan plan = loop.plan({9, 9, 9, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -9, -9, -9},
                                {0, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -5, 0});
    loop.links.plan.write(plan);
    while (loop.now() < plan.start + std::chrono::milliseconds(80)) loop.cycle();
    loop.gap(missed);
    const auto astray = [&] { return (loop.command.q - sample(plan, loop.now()).q).cwiseAbs().maxCoeff(); };
    const double before = astray();
    double hardest = 0.0;
    const Time until = loop.now() + std::chrono::milliseconds(170);
    while (loop.now() < until) {
      const JointVector dq = loop.command.dq;
      hardest = std::max(hardest, (loop.cycle().dq - dq).cwiseAbs().maxCoeff() / 0.002);
    }
    EXPECT_LT(astray(), 5e-4) << missed << " cycles, " << before << " rad at first";
    EXPECT_LT(hardest, loop.model.acceleration_max[0] + 1e-3) << missed;
    while (loop.now() < plan.start + std::chrono::milliseconds(420)) loop.cycle();
    EXPECT_LT(astray(), 5e-4) << missed << " cycles, at the end";
    EXPECT_LT(loop.command.dq.norm(), 1e-9) << missed;
    EXPECT_EQ(loop.control->state(), SupervisionState::kReady);
  }
}

TEST(AfterMissedCycles, WithoutAWayBackInsideTheLimitsTheArmComesToRest) {
  Loop loop(ur5e());
  std::vector<double> turn(40, 0.0);  // at 3 rad/s nothing catches up below the limit of 3.14 rad/s
  std::fill_n(turn.begin(), 10, 15.0);
  std::fill_n(turn.rbegin(), 10, -15.0);
  const Plan plan = loop.plan(turn, std::vector<double>(40, 0.0));
  loop.links.plan.write(plan);
  while (loop.now() < plan.start + std::chrono::milliseconds(300)) loop.cycle();
  loop.gap(25);
  for (int i = 0; i < 110; ++i) loop.cycle();
  EXPECT_TRUE(loop.command.dq.isZero(1e-9));
  EXPECT_GT((loop.command.q - sample(plan, loop.now()).q).cwiseAbs().maxCoeff(), 0.01);
}

/// A return may be faster than the plan, but not than the plan's profile allows.
TEST(AfterMissedCycles, TheWayBackKeepsToTheSpeedOfTheProfile) {
  const auto fastest = [](double velocity_max) {
    Loop loop(ur5e());
    std::vector<double> turn(40, 0.0);  // 1 rad/s
    std::fill_n(turn.begin(), 10, 5.0);
    std::fill_n(turn.rbegin(), 10, -5.0);
    Plan plan = loop.plan(turn, std::vector<double>(40, 0.0));
    plan.velocity_max = JointVector::Constant(6, velocity_max);
    loop.links.plan.write(plan);
    while (loop.now() < plan.start + std::chrono::milliseconds(300)) loop.cycle();
    loop.gap(10);
    double most = 0.0;
    for (int i = 0; i < 100; ++i) most = std::max(most, loop.cycle().dq.cwiseAbs().maxCoeff());
    return most;
  };
  EXPECT_GT(fastest(3.0), 1.02) << "otherwise this shows nothing";
  EXPECT_LT(fastest(1.0), 1.0 + 1e-5);
}

/// A fresh grip and a reset take a full glass: planner and monitor learn of both by one counter.
TEST(FreshGlass, IsCountedAtAGripAndAReset) {
  Loop loop(ur5e());
  const std::uint64_t first = loop.links.refills[0];
  HandReport hand;
  hand.trusted = hand.clutch = true;
  hand.grips = 1;
  hand.received = hand.good = loop.now();
  loop.links.hands.write({hand});
  loop.cycle();
  ASSERT_EQ(loop.control->state(), SupervisionState::kEngaged);
  EXPECT_EQ(loop.links.refills[0], first + 1);
  loop.links.asked.stop();
  for (int i = 0; i < 20; ++i) loop.cycle();
  ASSERT_EQ(loop.control->state(), SupervisionState::kStopping);
  EXPECT_EQ(loop.links.refills[0], first + 1);
  loop.links.asked.reset();
  for (int i = 0; i < 20; ++i) loop.cycle();
  EXPECT_EQ(loop.control->state(), SupervisionState::kReady);
  EXPECT_EQ(loop.links.refills[0], first + 2);
}

}  // namespace
}  // namespace steadyhand

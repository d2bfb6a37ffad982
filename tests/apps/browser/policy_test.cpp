#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/session/live/one_thread_session.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using Kind = OperatorRequest::Kind;
using State = SupervisionState;

/// A whole session in virtual time: a policy that sends the tool's target, and a person with a hand at the same
/// operator interface.
struct Policy : testing::Test {
  explicit Policy(const RobotModel& robot = ur5e()) : arm(robot, robot.home, {}, clock) {
    LiveSettings settings = operator_defaults();
    settings.planner_rate_hz = 50.0;
    settings.time_budget = false;
    settings.planning.retarget.scale = 1.0;
    settings.planning.retarget.yaw = 0.0;
    const std::vector<Profile> profiles{*load_profile("tracking")};
    take_profiles(profiles, 0, settings);
    session = std::move(*OneThreadSession::make(robot, settings, arm, clock));
    desk = std::make_unique<OperatorInterface>(*session, profiles, 0, settings.planning.retarget, settings.glass,
                                               std::vector<NamedRecording>{});
    LiveTaps taps;
    taps.look = [this](const SessionSnapshot& seen) { see(seen); };
    taps.change = [this](const SupervisionChange& change) { changes.emplace_back(change.reason); };
    taps.command = [this](const JointCommand& command) { commanded = command; };
    session->start(std::move(taps));
    run(0.2);
    home = look.tools[0].X_base_tool;
    wanted = [this](double) { return home; };
    hand = home;
  }

  /// The person's hand, and what there is to see of the target: how far it steps in 10 ms.
  void see(const SessionSnapshot& now) {
    if (now.tools[0].target.engaged && look.tools[0].target.engaged) {
      farthest_step =
          std::max(farthest_step, (now.tools[0].target.X_base_tool.p - look.tools[0].target.X_base_tool.p).norm());
    }
    look = now;
    OperatorSample sample;
    sample.stamp = {now.now, now.now};
    for (int t = 0; t < now.tool_count; ++t) {
      sample.tool = t;
      sample.X_operator_hand = hand;
      sample.clutch = t == 0 ? grips : second_grips;
      if (person_speaks) desk->hand(sample);
    }
  }
  void run(double seconds) {
    for (const Time end = clock.now() + from_seconds(seconds); clock.now() < end;) {
      if (wanted && policy_speaks && clock.now() >= next_target) {
        desk->target({wanted(now()), gripper}, clock.now());
        if (wanted_second) desk->target({wanted_second(now()), gripper, 1}, clock.now());
        next_target += from_seconds(period);
        if (next_target < clock.now()) next_target = clock.now();
      }
      session->step();
      (void)desk->poll(clock.now());
    }
  }
  Status ask(Kind kind, double value = 0.0) { return desk->apply({kind, "", value}, clock.now()); }
  /// A policy that has control.
  void lead() {
    ASSERT_TRUE(desk->connect(PolicyInfo{"test", period}));
    ASSERT_TRUE(ask(Kind::kPolicy, 1.0));
    run(0.3);
    ASSERT_EQ(look.state, State::kEngaged) << look.reason;
    ASSERT_EQ(look.tools[0].target.leader, Leader::kPolicy);
  }
  Pose from_home(const Vector3& by) const { return {home.p + by, home.q}; }
  double now() const { return to_seconds(clock.now()); }
  double off(const Pose& X) const { return (look.tools[0].X_base_tool.p - X.p).norm(); }
  bool at_rest() const { return look.measured.dq.cwiseAbs().maxCoeff() < 1e-3; }
  bool turn() const { return desk->controls().policy_turn; }
  ~Policy() override {
    const MonitorResult seen = session->summary().monitor;
    EXPECT_TRUE(seen.beyond_limits == 0 && seen.too_fast == 0 && seen.in_contact == 0) << to_text(seen);
  }

  SteppedClock clock{nullptr};
  SimulatedArm arm;
  std::unique_ptr<OneThreadSession> session;
  std::unique_ptr<OperatorInterface> desk;
  SessionSnapshot look;
  JointCommand commanded;
  std::vector<std::string> changes;
  Pose home, hand;
  bool grips = false, second_grips = false, person_speaks = true, policy_speaks = true;
  double period = 0.05, farthest_step = 0.0;
  std::optional<double> gripper;
  Time next_target{0};
  std::function<Pose(double)> wanted, wanted_second;
};

TEST_F(Policy, LeadsFromWhereTheArmIsToWhereItWants) {
  const Pose there = from_home({0.1, 0.25, 0.05});
  wanted = [&](double) { return there; };
  lead();
  run(3.0);
  EXPECT_LT(off(there), 0.003);
  EXPECT_LT(farthest_step, 0.005) << "what is far away is come to at 0.25 m/s on average";
  EXPECT_EQ(desk->controls().policy, "test");
}

TEST_F(Policy, TurnsWithoutAStep) {
  const Pose there{home.p, home.q * Quaternion(Eigen::AngleAxisd(0.5, Vector3::UnitZ()))};
  wanted = [&](double) { return there; };
  lead();
  run(2.0);
  EXPECT_LT(look.tools[0].X_base_tool.q.angularDistance(there.q), 0.01);
}

TEST_F(Policy, SlowOnesAreFollowedSmoothly) {
  period = 0.2;
  wanted = [&](double t) { return from_home({0.0, 0.1 * std::sin(t), 0.0}); };
  lead();
  run(2.0);
  double most = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Vector3 before = look.tools[0].target.X_base_tool.p;
    run(0.01);
    most = std::max(most, (look.tools[0].target.X_base_tool.p - before).norm());
  }
  EXPECT_LT(most, 0.003) << "targets that are 20 mm apart are gone to along a line";
}

TEST_F(Policy, APersonTakesOverFromWhereTheArmIsAndThePolicyGoesOn) {
  wanted = [&](double t) { return from_home({0.0, 0.15 * std::sin(t), 0.0}); };
  lead();
  run(1.0);
  const double spin = 2.0;
  for (int i = 0; i < 3; ++i) {
    hand = {Vector3(5.0, -3.0, 1.0), Quaternion(Eigen::AngleAxisd(spin, Vector3::UnitX()))};  // anywhere
    grips = true;
    farthest_step = 0.0;
    const Vector3 before = look.tools[0].X_base_tool.p;
    run(0.1);
    ASSERT_EQ(look.state, State::kEngaged) << look.reason;
    EXPECT_EQ(look.tools[0].target.leader, Leader::kPerson);
    EXPECT_LT((look.tools[0].target.X_base_tool.p - before).norm(), 0.05)
        << "from where the arm is, some 0.15 m/s fast";
    for (int k = 0; k < 100; ++k) {
      hand.p.x() += 0.001;
      run(0.01);
    }
    EXPECT_GT(std::abs(look.tools[0].X_base_tool.p.x() - before.x()), 0.05) << "the hand leads";
    grips = false;
    run(0.1);
    ASSERT_EQ(look.state, State::kEngaged) << look.reason;
    EXPECT_EQ(look.tools[0].target.leader, Leader::kPolicy);
    EXPECT_TRUE(turn());
    run(2.5);
    EXPECT_LT(off(wanted(now())), 0.03) << "the policy's again";
    EXPECT_LT(farthest_step, 0.02);
  }
  const auto count = [&](const char* reason) { return std::count(changes.begin(), changes.end(), reason); };
  EXPECT_EQ(count("the arm follows the policy"), 4);
  EXPECT_EQ(count("the arm is engaged"), 3);
}

TEST_F(Policy, AHandThatWasClosedBeforeItsTurnTakesNothingOver) {
  grips = true;
  run(0.5);
  EXPECT_EQ(look.state, State::kEngaged);
  ASSERT_TRUE(desk->connect(PolicyInfo{"test", period}));
  EXPECT_FALSE(ask(Kind::kPolicy, 1.0)) << "let go first";
  grips = false;
  run(0.5);
  lead();
}

TEST_F(Policy, ThatFallsSilentHoldsTheArmAndGoesOnWhenItIsBack) {
  lead();
  policy_speaks = false;
  run(1.5);
  EXPECT_EQ(look.state, State::kHolding);
  EXPECT_EQ(look.reason, "no target of the policy was received for a while");
  EXPECT_EQ(look.tools[0].target.leader, Leader::kPolicy) << "who is waited for";
  EXPECT_TRUE(at_rest());
  policy_speaks = true;
  run(0.5);
  EXPECT_EQ(look.state, State::kEngaged) << look.reason;
  EXPECT_EQ(look.reason, "the policy's targets are back");
}

TEST_F(Policy, WhoseTargetsAreNotNumbersHoldsTheArm) {
  lead();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  wanted = [&](double) { return Pose{Vector3::Constant(nan), home.q}; };
  run(1.0);
  EXPECT_EQ(look.state, State::kHolding);
  EXPECT_EQ(look.reason, "the policy's target is not a number");
  EXPECT_TRUE(at_rest());
  wanted = [&](double) { return home; };
  run(0.5);
  EXPECT_EQ(look.state, State::kEngaged) << look.reason;
}

TEST_F(Policy, WhoseTargetJumpsIsNotFollowedThere) {
  lead();
  run(1.0);
  wanted = [&](double) { return from_home({0.0, 0.4, 0.0}); };
  for (int i = 0; i < 100; ++i) {
    run(0.01);
    EXPECT_LT(off(home), 0.03);
  }
  EXPECT_EQ(look.state, State::kHolding);
  EXPECT_TRUE(at_rest());
  run(2.0);
  EXPECT_EQ(look.state, State::kHolding) << "only a person gives it its turn again";
  EXPECT_EQ(look.reason, "the policy's target jumped");
  ASSERT_TRUE(ask(Kind::kPolicy, 1.0));
  run(3.5);
  EXPECT_LT(off(from_home({0.0, 0.4, 0.0})), 0.01);
}

TEST_F(Policy, AStopEndsItsTurnAndAResetDoesNotBringItBack) {
  wanted = [&](double t) { return from_home({0.0, 0.15 * std::sin(t), 0.0}); };
  lead();
  session->ask_stop();  // any client may ask for it
  run(1.0);
  EXPECT_EQ(look.state, State::kStopping);
  EXPECT_FALSE(turn());
  EXPECT_FALSE(ask(Kind::kPolicy, 1.0)) << "an arm that was stopped";
  ASSERT_TRUE(ask(Kind::kReset));
  run(2.0);
  EXPECT_EQ(look.state, State::kReady);
  EXPECT_TRUE(at_rest());
  ASSERT_TRUE(ask(Kind::kPolicy, 1.0));
  run(0.5);
  EXPECT_EQ(look.state, State::kEngaged);
}

TEST_F(Policy, AStopWhileAPersonLeadsInItsTurnEndsItToo) {
  lead();
  grips = true;
  run(0.5);
  ASSERT_EQ(look.tools[0].target.leader, Leader::kPerson);
  ASSERT_TRUE(ask(Kind::kStop));
  run(1.0);
  grips = false;
  ASSERT_TRUE(ask(Kind::kReset));
  run(1.0);
  EXPECT_EQ(look.state, State::kReady) << "the policy does not go on by itself";
}

TEST_F(Policy, WhoseProgramGoesLeavesTheArmAtRest) {
  wanted = [&](double t) { return from_home({0.0, 0.15 * std::sin(2.0 * t), 0.0}); };
  lead();
  ASSERT_TRUE(desk->connect(std::nullopt));
  run(1.6);
  EXPECT_EQ(look.state, State::kReady);
  EXPECT_TRUE(at_rest());
  EXPECT_FALSE(turn());
  ASSERT_TRUE(desk->connect(PolicyInfo{"another", period}));
  run(0.5);
  EXPECT_EQ(look.state, State::kReady) << "only a person gives it its turn";
}

TEST_F(Policy, ItsTurnEndsWithTheLeaseOfWhoGaveIt) {
  lead();
  desk->change_hands();
  run(1.6);
  EXPECT_EQ(look.state, State::kReady);
  EXPECT_FALSE(turn());
}

TEST_F(Policy, ItsTurnEndsWhenTheServerFallsSilentThroughWhichAStopWouldCome) {
  desk->note_server_alive(clock.now());
  lead();
  run(2.0);
  EXPECT_EQ(look.state, State::kReady);
  EXPECT_FALSE(turn());
}

TEST_F(Policy, APersonsDeviceThatFallsSilentInItsTurnDoesNotHandBack) {
  lead();
  grips = true;
  run(0.5);
  person_speaks = false;
  run(1.5);
  EXPECT_EQ(look.state, State::kReady);
  EXPECT_TRUE(at_rest());
  person_speaks = true;  // closed still
  run(0.5);
  EXPECT_EQ(look.state, State::kReady) << "a fresh grip is needed";
  grips = false;
  run(0.5);
  EXPECT_EQ(look.tools[0].target.leader, Leader::kPolicy) << "it has let go";
  EXPECT_EQ(look.state, State::kEngaged);
}

TEST_F(Policy, HasItsPaceRefusedWhereItIsNone) {
  EXPECT_FALSE(desk->connect(PolicyInfo{"slow", 0.6}));
  EXPECT_FALSE(desk->connect(PolicyInfo{"fast", 0.001}));
  EXPECT_FALSE(desk->connect(PolicyInfo{"none", std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_FALSE(ask(Kind::kPolicy, 1.0)) << "none is connected";
  EXPECT_FALSE(ask(Kind::kPolicy, 0.5));
}

const RobotModel& two_arms() {
  static const Result<RobotModel> model = open_robot("two_ur5e");
  EXPECT_TRUE(model) << model.error().message;
  return *model;
}

/// A policy that moves both tools of a robot back and forth.
struct PolicyOfTwo : Policy {
  PolicyOfTwo() : Policy(two_arms()), second_home(look.tools[1].X_base_tool) {
    wanted = [this](double t) { return from_home({0.0, 0.0, 0.1 * std::sin(t)}); };
    wanted_second = [this](double t) { return Pose{second_home.p + Vector3(0.1 * std::sin(t), 0, 0), second_home.q}; };
  }
  bool follow(Leader first, Leader second) const { return follows(0, first) && follows(1, second); }
  bool follows(int tool, Leader leader) const {
    return look.tools[tool].state == State::kEngaged && look.tools[tool].target.leader == leader;
  }
  bool waits(int tool) const { return look.tools[tool].state == State::kReady; }
  double off_second() const { return (look.tools[1].X_base_tool.p - wanted_second(now()).p).norm(); }

  Pose second_home;
};

TEST_F(PolicyOfTwo, MovesBothTools) {
  lead();
  EXPECT_TRUE(follow(Leader::kPolicy, Leader::kPolicy)) << look.tools[1].reason;
  run(3.0);
  EXPECT_LT(off(wanted(now())), 0.03);
  EXPECT_LT(off_second(), 0.03);
}

TEST_F(PolicyOfTwo, MovesOnlyToolsThatItSendsTargetsFor) {
  wanted_second = nullptr;
  lead();
  run(1.0);
  EXPECT_TRUE(follows(0, Leader::kPolicy));
  EXPECT_TRUE(waits(1));
  EXPECT_LT((look.tools[1].X_base_tool.p - second_home.p).norm(), 1e-6);
}

TEST_F(PolicyOfTwo, APersonTakesOverBothToolsWithEitherHand) {
  lead();
  run(1.0);
  second_grips = true;
  run(1.5);
  EXPECT_TRUE(follows(1, Leader::kPerson)) << look.tools[1].reason;
  EXPECT_TRUE(waits(0)) << "the policy waits with all tools: " << look.tools[0].reason;
  const Vector3 rest = look.tools[0].X_base_tool.p;
  run(0.5);
  EXPECT_LT((look.tools[0].X_base_tool.p - rest).norm(), 1e-6);
  grips = true;
  run(0.5);
  EXPECT_TRUE(follow(Leader::kPerson, Leader::kPerson)) << look.tools[0].reason;
  second_grips = false;
  run(0.5);
  EXPECT_TRUE(follows(0, Leader::kPerson)) << "it does not release with the other: " << look.tools[0].reason;
  EXPECT_TRUE(waits(1)) << look.tools[1].reason;
  EXPECT_TRUE(turn());
  grips = false;
  run(3.0);
  EXPECT_TRUE(follow(Leader::kPolicy, Leader::kPolicy)) << look.tools[0].reason << "; " << look.tools[1].reason;
  EXPECT_LT(off(wanted(now())) + off_second(), 0.06);
  EXPECT_LT(farthest_step, 0.02);
}

TEST_F(PolicyOfTwo, ThatLosesOneToolHoldsBoth) {
  lead();
  run(1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  wanted_second = [this, nan](double) { return Pose{Vector3::Constant(nan), second_home.q}; };
  run(1.5);
  EXPECT_EQ(look.tools[1].state, State::kHolding) << look.tools[1].reason;
  EXPECT_EQ(look.tools[0].state, State::kHolding) << look.tools[0].reason;
  EXPECT_TRUE(at_rest());
}

TEST_F(PolicyOfTwo, AHandThatIsClosedLetsNoTurnBegin) {
  second_grips = true;
  run(0.5);
  ASSERT_TRUE(desk->connect(PolicyInfo{"test", period}));
  EXPECT_FALSE(ask(Kind::kPolicy, 1.0));
  desk->target({home, {}, 2}, clock.now());  // ignored, as that of another robot
  desk->target({home, {}, -1}, clock.now());
}

}  // namespace
}  // namespace steadyhand

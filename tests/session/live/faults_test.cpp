// Each test is a row of docs/reference/safety.md: the fault, and the arm's reaction.
#include <random>

#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using State = SupervisionState;

/// Engaged for 2 s with a hand that moves.
struct Faults : testing::Test {
  Faults() {
    session.hand = sweeping({0.15, 0.2, 0.1});
    session.run(0.2);
    EXPECT_EQ(session.state(), State::kReady);
    EXPECT_TRUE(session.grip());
    session.run(2.0);
    EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
  }
  void TearDown() override { session.expect_safe(forced); }

  /// The commands bring the arm to rest within `seconds`, and the state is this.
  void expect_rest_within(double seconds, State state) {
    EXPECT_TRUE(session.run_until([&] { return session.at_rest() && session.state() == state; }, seconds))
        << to_string(session.state()) << ": " << session.view.reason;
    const JointVector q = session.last_command.q;
    session.run(1.0);
    EXPECT_EQ(session.state(), state);
    EXPECT_LT((session.last_command.q - q).norm(), 1e-9);
  }
  /// Largest move of the commanded glass from one cycle to the next while `what` runs, m.
  template <typename What>
  double largest_move(const What& what) {
    double largest = 0.0;
    Vector3 last = session.glass(session.last_command.q).p;
    session.on_command = [&](const JointCommand& c) {
      const Vector3 p = session.glass(c.q).p;
      largest = std::max(largest, (p - last).norm());
      last = p;
    };
    what();
    session.on_command = [](const JointCommand&) {};
    return largest;
  }

  VirtualSession session;
  bool forced = false;  ///< the arm was moved by force
};

TEST_F(Faults, ReleaseBringsTheArmToRestAndGrippingAgainMovesIt) {
  session.clutch = false;
  expect_rest_within(1.5, State::kReady);
  EXPECT_TRUE(session.grip());
  session.run(1.0);
  EXPECT_EQ(session.state(), State::kEngaged);
}

TEST_F(Faults, SilenceDisengagesAndReconnectingMovesNothing) {
  session.channel = [](const OperatorSample&) {};
  expect_rest_within(2.0, State::kReady);
  session.channel = [&](const OperatorSample& s) { session.deliver(s); };  // the clutch is closed still
  const JointVector q = session.last_command.q;
  session.run(2.0);
  EXPECT_EQ(session.state(), State::kReady);
  EXPECT_LT((session.last_command.q - q).norm(), 1e-9);
  EXPECT_TRUE(session.grip());
}

TEST_F(Faults, AReleaseThatIsOldOrOutOfOrderCounts) {
  for (const int age_ms : {15, 90, 210, 5000}) {
    bool said = false;
    session.channel = [&](OperatorSample s) {  // says it once, and no more
      if (!said) {
        s.stamp.hand -= std::chrono::milliseconds(age_ms);
        s.clutch = false;
        session.deliver(s);
      }
      said = true;
    };
    EXPECT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 0.05)) << age_ms;
    EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 1.5));
    session.channel = [&](const OperatorSample& s) { session.deliver(s); };
    EXPECT_TRUE(session.grip());
    session.run(1.0);
  }
}

/// Samples of another person's hand, elsewhere.
OperatorSample of_another_hand(OperatorSample sample) {
  sample.X_operator_hand.p += Vector3(0.8, -0.5, 0.3);
  return sample;
}

TEST_F(Faults, AnotherHandsFirstGripIsFollowedHoweverSoonItComes) {
  const double usual = largest_move([&] { session.run(1.0); });
  bool changed = false;
  session.channel = [&](const OperatorSample& s) {
    if (!changed) {  // all of this between two steps of the planner
      session.deliver(s);
      ++session.planner_side().holder;
      OperatorSample open = of_another_hand(s);
      open.stamp.hand -= std::chrono::milliseconds(1);
      open.clutch = false;
      session.deliver(open);
      changed = true;
    }
    session.deliver(of_another_hand(s));
  };
  EXPECT_LT(largest_move([&] { session.run(1.0); }), 1.2 * usual);  // it takes hold of the glass where that is
  EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
  EXPECT_EQ(session.view.reason, "the arm is engaged");
}

TEST_F(Faults, AnotherHandThatComesWithItsClutchClosedIsNotFollowed) {
  ++session.planner_side().holder;
  session.channel = [&](const OperatorSample& s) { session.deliver(of_another_hand(s)); };
  expect_rest_within(1.5, State::kReady);
  EXPECT_TRUE(session.grip());
}

TEST_F(Faults, PacketsLostAtRandomAreNotNoticed) {
  std::mt19937 random(1);
  std::bernoulli_distribution lost(0.3);
  session.channel = [&](const OperatorSample& s) {
    if (!lost(random)) session.deliver(s);
  };
  session.run(5.0);
  EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
}

TEST_F(Faults, BurstsHoldTheArmAndTheNewestWins) {
  std::vector<OperatorSample> waiting;
  session.hand = sweeping({0.05, 0.05, 0.02}, 1.0);
  session.clutch = false;
  session.run(1.0);
  ASSERT_TRUE(session.grip());
  session.run(1.0);
  const double usual = largest_move([&] { session.run(3.0); });
  session.channel = [&](const OperatorSample& s) {  // 300 ms at once
    waiting.push_back(s);
    if (to_seconds(s.stamp.hand - waiting.front().stamp.hand) < 0.3) return;
    for (const OperatorSample& each : waiting) session.deliver(each);
    waiting.clear();
  };
  bool held = false;
  const double move = largest_move([&] {
    for (int i = 0; i < 2500; ++i) {
      session.cycle();
      held = held || session.state() != State::kEngaged;
    }
  });
  EXPECT_TRUE(held);
  EXPECT_LT(move, 1.2 * usual);
}

TEST_F(Faults, RepeatedAndReorderedPacketsChangeNothing) {
  std::vector<OperatorSample> recent;
  std::mt19937 random(2);
  session.channel = [&](const OperatorSample& s) {
    session.deliver(s);
    recent.push_back(s);
    session.deliver(recent[std::uniform_int_distribution<std::size_t>(0, recent.size() - 1)(random)]);
    if (recent.size() > 20) recent.erase(recent.begin());
  };
  session.run(5.0);
  EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
}

TEST_F(Faults, ATeleportOf70CentimetresDoesNotMoveTheGlass) {
  const auto sweep = session.hand;
  for (const int frames : {1, 5, 100}) {
    const double begin = session.now(), usual = largest_move([&] { session.run(1.0); });
    session.hand = [&](double t) {
      Pose pose = sweep(t);
      if (t > begin + 1.2 && t < begin + 1.2 + 0.011 * frames) pose.p.x() += 0.7;
      return pose;
    };
    const double move = largest_move([&] { session.run(2.5); });
    EXPECT_LT(move - usual, 0.002 * 0.002 / 0.011) << frames;  // 2 mm in a frame of the headset, at 500 Hz
    session.hand = sweep;
    ASSERT_TRUE(session.grip());
    session.run(1.0);
  }
}

TEST_F(Faults, PosesThatAreNotNumbersOrGuessedHold) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(OperatorSample&)>> spoils = {
      [=](OperatorSample& s) { s.X_operator_hand.p.y() = nan; },
      [](OperatorSample& s) { s.X_operator_hand.p.x() = INFINITY; },
      [=](OperatorSample& s) { s.X_operator_hand.q.z() = nan; },
      [](OperatorSample& s) { s.X_operator_hand.q.coeffs().setZero(); },
      [](OperatorSample& s) { s.tracked = false; },
      [](OperatorSample& s) { s.emulated = true; }};
  for (const auto& spoil : spoils) {
    session.channel = [&](OperatorSample s) {
      spoil(s);
      session.deliver(s);
    };
    expect_rest_within(1.5, State::kHolding);
    session.channel = [&](const OperatorSample& s) { session.deliver(s); };
    ASSERT_TRUE(session.grip());
    session.run(1.0);
    EXPECT_EQ(session.state(), State::kEngaged);
  }
}

TEST_F(Faults, TheDevicesClockIsSetBackOrAhead) {
  for (const double step : {-3600.0, -2.0, 3.0}) {
    session.channel = [&](OperatorSample s) {
      s.stamp.hand += from_seconds(step);
      session.deliver(s);
    };
    EXPECT_TRUE(session.run_until([&] { return session.state() != State::kEngaged; }, 0.3)) << step;
    EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 1.5));
    session.channel = [&](const OperatorSample& s) { session.deliver(s); };
    session.run(0.5);
    EXPECT_NE(session.state(), State::kEngaged) << "only a fresh grip";
    ASSERT_TRUE(session.grip()) << step << session.view.reason;
    session.run(1.0);
  }
}

TEST_F(Faults, APlannerThatIsLateByAFifthOfASecondHoldsAndFollowsAgainByItself) {
  session.planner_runs = false;
  session.run(0.2);
  EXPECT_EQ(session.state(), State::kHolding) << session.view.reason;
  session.planner_runs = true;
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kEngaged; }, 0.2)) << session.view.reason;
  EXPECT_EQ(session.view.reason, "the hand is back");
  const JointVector q = session.last_command.q;
  session.run(1.0);
  EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
  EXPECT_GT((session.last_command.q - q).norm(), 0.05);
}

TEST_F(Faults, APlannerThatIsLateByHalfASecondNeedsAFreshGrip) {
  session.planner_runs = false;
  session.run(0.5);
  EXPECT_EQ(session.state(), State::kReady) << session.view.reason;
  session.planner_runs = true;
  expect_rest_within(1.5, State::kReady);
  EXPECT_TRUE(session.grip());
  session.run(1.0);
  EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
}

TEST_F(Faults, APlannerThatDiedLeavesTheArmAtRest) {
  session.planner_runs = false;
  EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 1.5));
  const JointVector q = session.last_command.q;
  session.run(1.0);
  EXPECT_LT((session.last_command.q - q).norm(), 1e-9);
  EXPECT_NE(session.state(), State::kEngaged);
}

TEST_F(Faults, PlansThatComeLateAreNotFollowed) {
  if (session.options().planner_rate_hz != 50.0) GTEST_SKIP() << "its times are those of 50 Hz";
  session.options().solve_time = 0.018;
  session.run(0.8);
  EXPECT_EQ(session.view.rejected_plans > 10, true);
  EXPECT_EQ(session.state(), State::kHolding) << session.view.reason;
  session.options().solve_time = 0.003;
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kEngaged; }, 1.0)) << session.view.reason;
}

TEST_F(Faults, ASolverThatFailsLeavesTheArmAtRestAndRecovers) {
  OperatorSettings bad;
  bad.objectives = static_cast<int>(session.planning().ocp().objectives().size());
  for (int i = 0; i < bad.objectives; ++i) {
    const int count = session.planning().ocp().objectives()[i]->weight_count(session.planning().ocp().model());
    bad.weights[i] = JointVector::Constant(count, std::numeric_limits<double>::quiet_NaN());
  }
  bad.scale = 1.0;
  OperatorSettings good = bad;
  for (int i = 0; i < bad.objectives; ++i) good.weights[i].setConstant(1.0);
  session.planner_side().settings.write(bad);
  expect_rest_within(2.0, State::kHolding);
  EXPECT_GT(session.planner_view.failed, 5u);
  session.planner_side().settings.write(good);
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kEngaged; }, 1.0)) << session.view.reason;
}

TEST(Budget, ASolverThatHasNoTimeIsAPlannerThatIsLate) {
  VirtualSession::Options options;
  options.budget.time_us = 1e-3;
  VirtualSession session(options);
  session.lead(sweeping({0.15, 0.2, 0.1}));
  const JointVector q = session.last_command.q;
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kHolding; }, 0.5));
  EXPECT_EQ(session.view.reason, "the planner is late");
  session.run(1.0);
  EXPECT_EQ(session.state(), State::kHolding);
  EXPECT_EQ(session.last_command.q, q);
  EXPECT_GT(session.planner_view.failed, 10u);
  session.expect_safe();
}

TEST_F(Faults, AnArmThatStopsByItselfIsAFaultUntilReset) {
  session.arm().trip("emergency button");
  session.run(0.01);
  EXPECT_EQ(session.state(), State::kFault);
  EXPECT_EQ(session.view.reason, "emergency button");
  session.run(1.0);
  EXPECT_EQ(session.state(), State::kFault);
  session.ask_reset();
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 0.5));
  EXPECT_TRUE(session.grip());
  session.run(1.0);
  EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
}

TEST_F(Faults, APartOfTheProgramThatFailsIsAFaultAtRest) {
  const double speed = session.last_command.dq.cwiseAbs().maxCoeff();
  ASSERT_GT(speed, 0.1);
  session.fail("the planner failed");
  session.cycle();
  EXPECT_EQ(session.state(), State::kFault);
  EXPECT_EQ(session.view.reason, "the planner failed");
  EXPECT_FALSE(session.at_rest());
  expect_rest_within(speed / 15.0 + 0.03, State::kFault);
  EXPECT_FALSE(session.grip());
  session.ask_reset();
  session.run(0.5);
  EXPECT_EQ(session.state(), State::kFault);
}

TEST_F(Faults, AnArmThatIsPushedOffItsPlanStopsAndIsTakenOverWhereItStands) {
  forced = true;
  session.arm().push(JointVector::Constant(6, 0.3));
  session.run(0.01);
  EXPECT_EQ(session.state(), State::kStopping);
  EXPECT_EQ(session.view.reason, "the arm is not at its commanded position");
  session.run(0.5);
  session.ask_reset();
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 0.5)) << session.view.reason;
  EXPECT_LT((session.last_command.q - session.arm().q()).norm(), 1e-3);
  EXPECT_TRUE(session.grip());
}

TEST_F(Faults, AStopIsObeyedAtOnceAndLastsUntilReset) {
  session.ask_stop();
  session.cycle();
  EXPECT_EQ(session.state(), State::kStopping);
  const double most = session.last_command.dq.cwiseAbs().maxCoeff() / 15.0 + 0.5;
  expect_rest_within(most + 0.03, State::kStopping);
  EXPECT_FALSE(session.grip());
  session.ask_reset();
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 0.5));
  EXPECT_TRUE(session.grip());
}

/// Follows only after restart(), which no session calls when it begins.
class WaitsForRestart final : public Arm {
 public:
  explicit WaitsForRestart(Clock& clock) : arm_(ur5e(), ur5e().home, {}, clock) {}
  const ArmInfo& info() const override { return arm_.info(); }
  ArmState receive() override {
    ArmState state = arm_.receive();
    if (restarts == 0) state.status = ArmStatus::kStarting;
    return state;
  }
  void send(const JointCommand& command) override { arm_.send(command); }
  void restart() override {
    ++restarts;
    arm_.restart();
  }

  int restarts = 0;

 private:
  SimulatedArm arm_;
};

TEST(Starting, AnArmThatDoesNotBeginToFollowIsReported) {
  WaitsForRestart* arm = nullptr;
  VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
  options.make_arm = [&](Clock& clock) {
    auto made = std::make_unique<WaitsForRestart>(clock);
    arm = made.get();
    return made;
  };
  VirtualSession session(options);
  session.planner_runs = false;
  session.run(9.0);
  EXPECT_EQ(session.view.reason, "starting");
  session.run(12.0);
  EXPECT_EQ(session.state(), State::kIdle);
  EXPECT_EQ(session.view.reason, "the arm is still starting: it has not reported that it follows");
  EXPECT_EQ(arm->restarts, 0);
  session.ask_stop();
  session.run(0.1);
  session.ask_reset();
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 0.5)) << session.view.reason;
  EXPECT_EQ(arm->restarts, 1);
}

TEST(Stalls, AControlLoopThatSleptStopsTheArm) {
  for (const double timeout : {1.0, 0.1}) {  // the arm's own, which comes first or does not
    VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
    options.arm.command_timeout = timeout;
    VirtualSession session(options);
    session.lead(sweeping({0.15, 0.2, 0.1}), 2.0);
    session.clock().advance(0.15);
    session.cycle();
    EXPECT_EQ(session.state(), timeout > 0.15 ? State::kStopping : State::kFault) << session.view.reason;
    EXPECT_EQ(session.view.reason, timeout > 0.15 ? "the control loop stalled" : "no command arrived in time");
    EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 0.5));
    const JointVector q = session.last_command.q;
    session.run(1.0);
    EXPECT_LT((session.last_command.q - q).norm(), 1e-3);
    EXPECT_FALSE(session.grip());
    session.ask_reset();
    EXPECT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 0.5)) << session.view.reason;
    EXPECT_TRUE(session.grip());
    session.expect_safe();
  }
}

TEST_F(Faults, ShortSleepsOfTheControlLoopAreNoReasonToStop) {
  for (int i = 0; i < 20; ++i) {
    session.clock().advance(0.001 * (4 + i % 17));
    session.run(0.1);
    EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
  }
}

}  // namespace
}  // namespace steadyhand

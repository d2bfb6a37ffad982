// Commands after missed cycles: one cycle or several seconds, at any speed and in every state.
#include <cmath>
#include <random>

#include "support/ur/lockstep.hpp"
#include "support/virtual_session.hpp"
#ifdef STEADYHAND_ROS2
#include "support/ros2/lockstep.hpp"
#endif

namespace steadyhand {
namespace {

using State = SupervisionState;

/// Looks at what an arm is sent as that arm receives it: each set-point, sent or its own, against the one before.
class Receiver {
 public:
  explicit Receiver(VirtualSession& session) {
    session.on_state = [this](const ArmState& state) { hear(state); };
    session.on_command = [this, &session](const JointCommand& command) {
      if (session.state() == State::kIdle) known_ = follows_ = false;  // it was just restarted
      if (follows_) judge(command, "sent");
    };
  }

  std::uint64_t judged = 0, carried_on = 0;
  double fastest = 0.0;  ///< share of the speed limit, measured

 private:
  void hear(const ArmState& state) {
    const JointVector share = state.joints.dq.cwiseAbs().cwiseQuotient(ur5e().velocity_max);
    fastest = std::max(fastest, share.maxCoeff());
    follows_ = state.status == ArmStatus::kFollowing;
    if (!follows_) known_ = false;
    if (!state.carried_on) return;
    EXPECT_NEAR(to_seconds(state.joints.stamp.made - state.carried_on->stamp.made), 0.002, 2e-9);
    judge(*state.carried_on, "carried on");
    ++carried_on;
  }

  /// Checks that the command changes no more than |ddq| <= most allows between two set-points.
  void judge(const JointCommand& c, const char* what) {
    if (known_) {
      const double dt = to_seconds(c.stamp.made - before_.stamp.made);
      const JointVector &speed_max = ur5e().velocity_max, &most = ur5e().acceleration_max;
      const JointVector way = (c.q - before_.q).cwiseAbs(), change = (c.dq - before_.dq).cwiseAbs();
      const JointVector astray = (c.q - before_.q - 0.5 * dt * (c.dq + before_.dq)).cwiseAbs();
      ASSERT_GT(dt, 0.0);
      ASSERT_LE((c.dq.cwiseAbs() - speed_max).maxCoeff(), 1e-9) << what << " after " << dt;
      ASSERT_LE((way - dt * speed_max).maxCoeff(), 3e-6) << what << " after " << dt;
      ASSERT_LE((change - dt * most).maxCoeff(), 2e-5) << what << " after " << dt;
      ASSERT_LE((astray - 0.25 * dt * dt * most).maxCoeff(), 3e-6) << what << " after " << dt;
      ++judged;
    }
    before_ = c;
    known_ = true;
  }

  bool follows_ = false, known_ = false;
  JointCommand before_;
};

/// Suspends the session for that many seconds, as if it got no processor.
void sleep(VirtualSession& session, double seconds) {
  session.clock().advance(seconds);
  session.cycle();
}

VirtualSession::Options patient_arm() {
  VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
  options.arm.command_timeout = 60.0;  // a gap must not end in a timeout
  return options;
}

struct Gaps : testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(, Gaps, testing::Values(1, 2, 3, 4));

/// While it follows, stops after release or loss, stops softly or hard, and is stationary.
TEST_P(Gaps, OfAnyLengthAtAnySpeedInAnyStateCommandsGoOnWhereTheArmIs) {
  VirtualSession session(patient_arm());
  std::mt19937 random(GetParam());
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  session.hand = sweeping({0.15, 0.25, 0.1}, 1.5 + 0.6 * GetParam());
  session.run(0.2);
  Receiver arm(session);
  int stalls = 0, followed_on = 0;
  double fastest_asleep = 0.0;
  for (int i = 0; i < 40 && !HasFatalFailure(); ++i) {
    ASSERT_TRUE(session.grip()) << session.view.reason;
    session.run(0.2 + 0.8 * unit(random));
    const int state = std::max(0, static_cast<int>(9 * unit(random)) - 3);
    if (state == 1) session.clutch = false;
    if (state == 2) session.channel = [](const OperatorSample&) {};
    if (state == 3 || state == 4) session.ask_stop();
    if (state == 4) {
      session.cycle();
      session.ask_stop();
    }
    if (state == 5) session.planner_runs = false;
    if (state > 0) session.run(0.25 * unit(random));
    const bool engaged = session.state() == State::kEngaged;
    const int sleeps = 1 + static_cast<int>(3 * unit(random));
    double slept = 0.0;
    for (int k = 0; k < sleeps; ++k) {
      const double seconds = 0.002 * std::pow(1500.0, unit(random));
      slept += seconds;
      fastest_asleep = std::max(fastest_asleep, session.last_command.dq.cwiseAbs().maxCoeff());
      sleep(session, seconds);
      session.run(0.03 * unit(random));
    }
    ASSERT_NE(session.state(), State::kFault) << session.view.reason;
    if (engaged && slept < 0.06 && state == 0) {
      EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
      ++followed_on;
    }
    session.channel = [&](const OperatorSample& s) { session.deliver(s); };
    session.planner_runs = true;
    if (session.state() != State::kStopping) continue;
    ++stalls;
    ASSERT_TRUE(session.run_until([&] { return session.at_rest(); }, 1.0));
    session.ask_reset();
    ASSERT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 0.5)) << session.view.reason;
  }
  EXPECT_LE(arm.fastest, 1.001);
  EXPECT_GT(arm.judged, 10000u);
  EXPECT_GT(arm.carried_on, 40u);
  EXPECT_GT(fastest_asleep, 1.0);
  EXPECT_GT(stalls, 5);
  EXPECT_GT(followed_on, 0);
  session.expect_safe();
}

/// A planner that learns where the arm went has it following again within two of its periods.
TEST(Gap, OfFiftyMillisecondsCostsLittleSpeed) {
  VirtualSession session(patient_arm());
  session.lead(sweeping({0.15, 0.25, 0.1}, 3.0), 1.0);
  Receiver arm(session);
  for (int i = 0; i < 10; ++i) {
    session.run(0.1);
    sleep(session, 0.05);
    const std::uint64_t plans = session.view.plans;
    session.run(0.06);
    EXPECT_GT(session.view.plans, plans);
    EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
  }
  EXPECT_EQ(session.view.missed_deadlines, 240u);
  session.expect_safe();
}

TEST(Gap, ThatStallsTheLoopRunsToRestWhereTheArmIs) {
  VirtualSession session(patient_arm());
  session.lead(sweeping({0.15, 0.25, 0.1}, 3.0));
  ASSERT_TRUE(session.run_until([&] { return session.last_command.dq.cwiseAbs().maxCoeff() > 1.8; }, 3.0));
  Receiver arm(session);
  sleep(session, 0.102);
  EXPECT_EQ(session.state(), State::kStopping);
  EXPECT_EQ(session.view.reason, "the control loop stalled");
  EXPECT_FALSE(session.at_rest());  // it has braked meanwhile, and is on its way still
  EXPECT_TRUE(session.run_until([&] { return session.at_rest(); }, 0.3));
  const JointVector q = session.last_command.q;
  session.run(0.5);
  EXPECT_EQ(session.last_command.q, q);
  EXPECT_LT((session.arm().q() - q).norm(), 1e-4);
  EXPECT_EQ(session.state(), State::kStopping);
  session.expect_safe();
}

/// A plan from before the gap, for an arm that has moved elsewhere since, is not used after it.
TEST(Gap, OutdatesThePlansFromBefore) {
  VirtualSession::Options options = patient_arm();
  options.solve_time = 0.0;
  VirtualSession session(options);
  session.lead(sweeping({0.15, 0.25, 0.1}, 3.0));
  Receiver arm(session);
  for (int i = 0; i < 30; ++i) {
    session.run(0.2 + 0.002 * i);
    sleep(session, 0.07);
  }
  EXPECT_GT(session.view.rejected_plans, 0u);
  EXPECT_EQ(session.state(), State::kEngaged) << session.view.reason;
  session.expect_safe();
}

// ---------------------------------------------------------------------------------------------- arms as they are

/// The program on a UR's controller bridges and brakes by itself for 50 ms, and then ends.
TEST(Gap, ThatAUrBridgesIsGoneOnFrom) {
  UrLockstep* ur = nullptr;
  VirtualSession::Options options = VirtualSession::Options::at_rate(50.0);
  options.make_arm = [&](Clock& clock) {
    auto made = std::make_unique<UrLockstep>(ur5e(), FakeUrController::Settings{}, clock);
    ur = made.get();
    return made;
  };
  VirtualSession session(options);
  std::mt19937 random(2);
  session.hand = sweeping({0.15, 0.25, 0.1}, 3.0);
  ASSERT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 5.0)) << session.view.reason;
  ASSERT_TRUE(session.grip());
  session.run(0.5);
  Receiver arm(session);
  for (int i = 0; i < 40; ++i) {
    session.run(0.1);
    if (i % 4 == 3) ur->controller.unplug(8);  // to the session that is the same
    sleep(session, i % 4 == 3 ? 0.0 : std::uniform_real_distribution<double>(0.002, 0.045)(random));
    ASSERT_EQ(session.state(), State::kEngaged) << session.view.reason;
  }
  EXPECT_GT(arm.carried_on, 30u);
  EXPECT_LE(ur->controller.largest_acceleration(), 1.3 * 15.0 + 0.5);
  EXPECT_LE(ur->controller.largest_speed(), ur5e().velocity_max.maxCoeff());
  sleep(session, 0.2);
  EXPECT_TRUE(session.run_until([&] { return session.state() == State::kFault; }, 0.1));
  session.run(0.5);
  EXPECT_LT(ur->controller.arm().dq().norm(), 0.02);
  EXPECT_LE(ur->controller.largest_acceleration(), 1.3 * 15.0 + 0.5);
}

#ifdef STEADYHAND_ROS2
/// A trajectory controller continues along the plan that it was sent.
TEST(Gap, ThatAControllerOfTrajectoriesFillsIsGoneOnFrom) {
  Ros2Lockstep* ros2 = nullptr;
  VirtualSession::Options options = VirtualSession::Options::at_rate(50.0);
  options.make_arm = [&](Clock& clock) {
    auto made = std::make_unique<Ros2Lockstep>(ur5e(), ReferenceController::Settings{}, clock);
    ros2 = made.get();
    return made;
  };
  VirtualSession session(options);
  std::mt19937 random(2);
  session.hand = sweeping({0.15, 0.25, 0.1}, 3.0);
  ASSERT_TRUE(session.run_until([&] { return session.state() == State::kReady; }, 5.0)) << session.view.reason;
  ASSERT_TRUE(session.grip());
  session.run(0.5);
  Receiver arm(session);
  for (int i = 0; i < 40; ++i) {
    session.run(0.1);
    sleep(session, std::uniform_real_distribution<double>(0.002, 0.064)(random));
    ASSERT_EQ(session.state(), State::kEngaged) << session.view.reason;
  }
  EXPECT_GT(arm.carried_on, 30u);
  session.run(0.2);
  EXPECT_LE(ros2->controller->largest().ddq, 1.15 * 15.0);
  EXPECT_EQ(ros2->controller->last_stop(), "");
}
#endif

}  // namespace
}  // namespace steadyhand

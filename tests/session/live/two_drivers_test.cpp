// Two hands move two arms, each behind its own driver, of other rate and delay.
#include "steadyhand/arms/driver/composite_arm.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using State = SupervisionState;

struct TwoDrivers : testing::Test {
  TwoDrivers() : model(*open_robot("two_ur5e")) {
    VirtualSession::Options options = VirtualSession::Options::at_rate(VirtualSession::usual_rate());
    options.model = &model;
    options.profile = "tracking";
    options.make_arm = [this](Clock& clock) -> std::unique_ptr<Arm> {
      SimulatedArmSettings settings[kMaxTools];
      settings[0].rate_hz = 200.0;
      settings[1].latency = 0.02;
      std::array<CompositeArm::Make, kMaxTools> make;
      for (int i = 0; i < kMaxTools; ++i) {
        make[i] = [this, i, of = settings[i]](const RobotModel& arm, Clock& own) -> Result<std::unique_ptr<Arm>> {
          parts[i] = new SimulatedArm(arm, arm.home, of, own);
          return std::unique_ptr<Arm>(parts[i]);
        };
      }
      return *CompositeArm::make(model, make, clock, CompositeArm::Turns::kOneThread);
    };
    session.emplace(options);
    session->hand = sweeping({0.10, 0.12, 0.08});
    session->second_hand = sweeping({0.08, 0.10, 0.10}, 2.5);
    session->run(0.3);
  }
  void lead_both(double seconds) {
    ASSERT_EQ(session->state(), State::kReady) << session->view.reason;
    ASSERT_TRUE(session->grip(0)) << session->view.reason;
    ASSERT_TRUE(session->grip(1)) << session->view.reason;
    session->run(seconds);
    for (int t = 0; t < kMaxTools; ++t)
      ASSERT_EQ(session->view.hands[t].state, State::kEngaged) << session->view.hands[t].reason;
  }

  RobotModel model;
  std::array<SimulatedArm*, kMaxTools> parts{};
  std::optional<VirtualSession> session;
};

TEST_F(TwoDrivers, FollowBothHands) {
  lead_both(3.0);
  for (int t = 0; t < kMaxTools; ++t) EXPECT_LT(session->planner_view.tracking_error[t], 0.05);
  session->expect_safe();
}

TEST_F(TwoDrivers, OneThatStopsIsAFaultAndTheOtherBrakesWithinItsLimits) {
  for (int stops = 0; stops < kMaxTools; ++stops) {
    lead_both(1.0);
    parts[stops]->trip("protective stop");
    session->run(0.05);
    EXPECT_EQ(session->state(), State::kFault);
    EXPECT_EQ(session->view.reason, stops == 0 ? "left: protective stop" : "right: protective stop");
    ASSERT_TRUE(session->run_until([&] { return session->at_rest(); }, 1.0));
    session->run(0.1);  // the servo lags
    EXPECT_LT(parts[1 - stops]->dq().norm(), 1e-3);
    session->clutch = session->second_clutch = false;
    session->ask_reset();
    session->run(0.5);
  }
  lead_both(1.0);
  session->expect_safe();
}

/// Up to 60 ms they continue to follow.
TEST_F(TwoDrivers, ContinueAfterMissedCycles) {
  lead_both(1.0);
  for (const double missed : {0.004, 0.01, 0.02, 0.045, 0.06}) {
    session->clock().advance(missed);
    session->run(0.5);
    for (int t = 0; t < kMaxTools; ++t)
      EXPECT_EQ(session->view.hands[t].state, State::kEngaged) << missed << ": " << session->view.hands[t].reason;
  }
  session->expect_safe();
}

}  // namespace
}  // namespace steadyhand

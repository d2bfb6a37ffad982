#include <gtest/gtest.h>

#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/session/live/one_thread_session.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

/// A hand that controls an arm on a machine whose planning time the test sets.
struct PlannerRate : testing::Test {
  void begin(double rate_hz) {
    LiveSettings settings = operator_defaults();
    settings.planner_rate_hz = rate_hz;
    settings.time_budget = false;
    const std::vector<Profile> profiles{*load_profile("tracking")};
    take_profiles(profiles, 0, settings);
    session = std::move(*OneThreadSession::make(ur5e(), settings, arm, clock));
    desk = std::make_unique<OperatorInterface>(*session, profiles, 0, settings.planning.retarget, settings.glass,
                                               std::vector<NamedRecording>{});
    LiveTaps taps;
    taps.look = [this](const SessionSnapshot& seen) { look = seen; };
    session->start(std::move(taps));
    run(0.2);
    grips = true;
    run(0.2);
    ASSERT_EQ(look.state, SupervisionState::kEngaged) << look.reason;
  }
  void run(double seconds) {
    for (const Time end = clock.now() + from_seconds(seconds); clock.now() < end;) {
      OperatorSample sample;
      sample.stamp = {clock.now(), clock.now()};
      sample.clutch = grips;
      desk->hand(sample);
      session->step();
      (void)desk->poll(clock.now());
    }
  }

  Time wall{0}, look_takes = std::chrono::microseconds(50);  ///< at the clock: a step looks some times
  SteppedClock clock{[this] { return wall += look_takes; }};
  SimulatedArm arm{ur5e(), ur5e().home, {}, clock};
  std::unique_ptr<OneThreadSession> session;
  std::unique_ptr<OperatorInterface> desk;
  SessionSnapshot look;
  bool grips = false;
};

TEST_F(PlannerRate, FollowsTheMachineUntilSomeoneChoosesOne) {
  begin(0.0);
  const double fast = session->planner_rate_hz();
  ASSERT_GE(fast, 250.0);
  look_takes *= 20;
  run(0.3);
  const double slow = session->planner_rate_hz();
  EXPECT_LT(slow, fast / 4);
  EXPECT_EQ(look.planner_rate_hz, slow);
  look_takes /= 20;
  run(3.0);
  EXPECT_EQ(session->planner_rate_hz(), slow);
  run(4.0);
  EXPECT_EQ(session->planner_rate_hz(), fast);
  ASSERT_TRUE(session->set_planner_rate(200.0));
  look_takes *= 20;
  run(1.0);
  EXPECT_EQ(session->planner_rate_hz(), 200.0);
  EXPECT_FALSE(look.planner_rate_automatic);
}

TEST_F(PlannerRate, FollowsTheMachineAgainOnceAskedTo) {
  begin(250.0);
  EXPECT_FALSE(look.planner_rate_automatic);
  ASSERT_TRUE(session->set_planner_rate(0.0));
  look_takes *= 20;
  run(0.5);
  EXPECT_TRUE(look.planner_rate_automatic);
  EXPECT_LE(session->planner_rate_hz(), 100.0);
}

TEST_F(PlannerRate, StaysAsItWasTold) {
  begin(250.0);
  look_takes *= 20;
  run(1.0);
  EXPECT_EQ(session->planner_rate_hz(), 250.0);
}

}  // namespace
}  // namespace steadyhand

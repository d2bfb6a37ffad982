// How the threads of a session handle exceptions.
#include "steadyhand/session/live/live_session.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <stdexcept>
#include <thread>

#include "steadyhand/planning/pipeline/pipeline.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using State = SupervisionState;

/// Throws on the thread of this name, once it is set.
struct BrittleClock final : Clock {
  Time now() const override {
    char name[16];
    pthread_getname_np(pthread_self(), name, sizeof(name));
    const char* broken = breaks;
    if (broken != nullptr && std::string(name) == broken) throw std::runtime_error("the clock broke");
    return clock.now();
  }
  void sleep_until(Time deadline) override { clock.sleep_until(deadline); }
  MonotonicClock clock;
  std::atomic<const char*> breaks{nullptr};
};

TEST(SettingsOfAProfile, AreThoseOfAPipeline) {
  Profile profile = *load_profile("carry");
  profile.tilt_max = 1.0;
  profile.tolerance = 1e-3;
  profile.solver = "other";
  profile.ocp.velocity_scale = 0.3;
  const PlanningSettings live = LiveSettings(profile).planning;
  const PipelineSettings replayed(profile);
  EXPECT_EQ(live.retarget.tilt_max, 1.0);
  EXPECT_EQ(live.predictor.model, Prediction::kDecaying);
  EXPECT_EQ(live.planner.tolerance, 1e-3);
  EXPECT_EQ(live.planner.solver, "other");
  EXPECT_EQ(live.ocp.velocity_scale, 0.3);
  EXPECT_EQ(live.ocp.weights, profile.ocp.weights);
  EXPECT_EQ(live.retarget.tilt_max, replayed.retarget.tilt_max);
  EXPECT_EQ(live.predictor.model, replayed.predictor.model);
  EXPECT_EQ(live.planner.tolerance, replayed.planner.tolerance);
}

/// A session that follows a hand which moves.
struct Threads : testing::Test {
  Threads() {
    const LiveSettings settings(*load_profile("waiter"));
    session = std::move(*LiveSession::make(ur5e(), settings, arm, clock));
    LiveTaps taps;
    taps.state = [this](const JointState&) {
      if (listener_breaks) throw std::bad_alloc();
    };
    session->start(std::move(taps));
    EXPECT_TRUE(leads_until([&] { return is(State::kReady); }, false));
    EXPECT_TRUE(leads_until([&] { return is(State::kEngaged); }, true));
    EXPECT_TRUE(leads_until([&] { return session->snapshot().command.dq.cwiseAbs().maxCoeff() > 0.1; }, true));
  }
  ~Threads() override {
    clock.breaks = nullptr;
    if (!session->is_running()) return;
    const LiveSummary summary = session->finish();
    EXPECT_EQ(summary.monitor.beyond_limits, 0u);
    EXPECT_EQ(summary.monitor.in_contact, 0u);
  }

  bool is(State state) const { return session->snapshot().state == state; }
  bool stands() const { return session->snapshot().command.dq.isZero(0.0); }
  /// Moves the hand until the condition holds; false if that takes 20 s.
  bool leads_until(const std::function<bool()>& condition, bool clutch) {
    for (int i = 0; i < 2000 && !condition(); ++i) {
      const Time now = clock.clock.now();
      OperatorSample sample;
      sample.stamp = {now, now};
      sample.X_operator_hand = sweeping({0.1, 0.1, 0.1})(to_seconds(now));
      sample.clutch = clutch;
      session->feed(sample);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return condition();
  }
  /// At rest in a fault with this reason, and a reset does not help.
  void expect_fault(const std::string& reason) {
    EXPECT_TRUE(leads_until([&] { return is(State::kFault) && stands(); }, true));
    EXPECT_EQ(session->snapshot().reason, reason);
    EXPECT_TRUE(leads_until([&] { return session->stopped_at_rest(); }, true));
    session->ask_reset();
    for (const bool clutch : {false, true}) {
      int cycles = 0;
      (void)leads_until([&] { return !stands() || ++cycles == 30; }, clutch);
      EXPECT_TRUE(stands());
    }
    EXPECT_TRUE(is(State::kFault));
    const std::vector<std::string> said = session->warnings();
    const auto tells = [&](const std::string& line) { return line.find(reason) == 0; };
    EXPECT_EQ(std::count_if(said.begin(), said.end(), tells), 1);
  }

  BrittleClock clock;
  SimulatedArm arm{ur5e(), ur5e().home, {}, clock};
  std::unique_ptr<LiveSession> session;
  std::atomic<bool> listener_breaks{false};
};

TEST_F(Threads, APlannerThatThrowsIsAFault) {
  clock.breaks = "planner";
  expect_fault("the planner failed: restart the program");
}

TEST_F(Threads, AListenerThatThrowsIsAFault) {
  listener_breaks = true;
  expect_fault("the recording failed: restart the program");
}

TEST_F(Threads, TheEndBringsTheArmToRest) {
  EXPECT_FALSE(stands());
  const LiveSummary summary = session->finish();
  EXPECT_TRUE(stands());
  EXPECT_TRUE(session->stopped_at_rest());
  ASSERT_FALSE(summary.holds.empty());  // a busy machine may have others before
  EXPECT_EQ(summary.holds.back().first, "a stop was asked for");
}

TEST_F(Threads, AnArmThatStandsCountsAsStoppedOnlyWhenEveryStopWasObeyed) {
  session->ask_stop();
  EXPECT_TRUE(leads_until([&] { return session->stopped_at_rest(); }, true));
  int waits = 0;
  for (int i = 0; i < 50; ++i) {  // some of them are not obeyed yet when it is asked
    session->ask_stop();
    waits += !session->stopped_at_rest();
    EXPECT_TRUE(leads_until([&] { return session->stopped_at_rest(); }, true));
  }
  EXPECT_GT(waits, 25);
}

TEST_F(Threads, AControlLoopThatThrowsIsTold) {
  clock.breaks = "control";
  EXPECT_TRUE(leads_until([&] { return is(State::kFault); }, true));
  EXPECT_EQ(session->snapshot().reason, "the control loop failed: restart the program");
  EXPECT_TRUE(session->is_halted());
}

}  // namespace
}  // namespace steadyhand

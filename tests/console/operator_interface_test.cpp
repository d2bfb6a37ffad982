#include "steadyhand/console/operator_interface.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using Kind = OperatorRequest::Kind;
constexpr int kLateral = 4;  ///< among the default objectives

/// A desk before a session whose threads were not started.
template <typename SessionClock>
struct DeskBefore : testing::Test {
  DeskBefore() : arm(ur5e(), ur5e().home, {}, clock) {
    std::vector<Profile> profiles;
    for (const char* name : {"tracking", "waiter"}) profiles.push_back(*load_profile(name));
    LiveSettings settings;
    settings.planning.ocp = profiles[1].ocp;
    session = std::move(*LiveSession::make(ur5e(), settings, arm, clock));
    Recording still;
    still.samples.resize(2);
    still.samples[1].stamp.hand = std::chrono::seconds(1);
    operator_interface = std::make_unique<OperatorInterface>(
        *session, profiles, 1, RetargetSettings{}, std::vector<NamedRecording>{{"still", still}}, ur5e(), Cell{});
  }
  Status ask(Kind kind, const std::string& text = "", double value = 0.0) {
    return operator_interface->apply({kind, text, value, {}}, clock.now());
  }

  SessionClock clock;
  SimulatedArm arm;
  std::unique_ptr<LiveSession> session;
  std::unique_ptr<OperatorInterface> operator_interface;
};
using Desk = DeskBefore<ManualClock>;

TEST_F(Desk, TellsWhatIsChosen) {
  EXPECT_EQ(operator_interface->controls().profile, 1);
  ASSERT_EQ(session->ocp().objectives()[kLateral]->name(), "lateral");
  EXPECT_EQ(operator_interface->controls().weights[kLateral], 3.0);
  EXPECT_TRUE(ask(Kind::kProfile, "tracking"));
  EXPECT_EQ(operator_interface->controls().profile, 0);
  EXPECT_EQ(operator_interface->controls().weights[kLateral], 0.0);
  EXPECT_TRUE(ask(Kind::kWeight, "lateral", 7.0));
  EXPECT_EQ(operator_interface->controls().weights[kLateral], 7.0);
  EXPECT_TRUE(ask(Kind::kScale, "", 0.8));
  EXPECT_TRUE(ask(Kind::kYaw, "", 1.0));
  EXPECT_EQ(operator_interface->controls().scale, 0.8);
  EXPECT_EQ(operator_interface->controls().yaw, 1.0);
  EXPECT_TRUE(ask(Kind::kPlayback, "still"));
  EXPECT_EQ(operator_interface->controls().playback, 0);
  EXPECT_TRUE(ask(Kind::kPlayback, ""));
  EXPECT_EQ(operator_interface->controls().playback, -1);
  EXPECT_TRUE(ask(Kind::kRate, "", 100.0));
  EXPECT_EQ(session->planner_rate_hz(), 100.0);
  EXPECT_TRUE(ask(Kind::kStop));
  EXPECT_TRUE(ask(Kind::kReset));
}

TEST_F(Desk, AGripEndsARecordingThatPlays) {
  ASSERT_TRUE(ask(Kind::kPlayback, "still"));
  OperatorSample sample;
  operator_interface->hand(sample);
  EXPECT_EQ(operator_interface->controls().playback, 0);
  sample.clutch = true;
  operator_interface->hand(sample);
  EXPECT_EQ(operator_interface->controls().playback, -1);
}

TEST_F(Desk, ARecordingEndsWithTheLeaseOrAStop) {
  ASSERT_TRUE(ask(Kind::kPlayback, "still"));
  operator_interface->change_hands();
  EXPECT_EQ(operator_interface->controls().playback, -1);
  ASSERT_TRUE(ask(Kind::kPlayback, "still"));
  ASSERT_TRUE(ask(Kind::kStop));
  EXPECT_EQ(operator_interface->controls().playback, -1);
}

TEST_F(Desk, ARecordingEndsWhenTheServerFallsSilent) {
  ASSERT_TRUE(ask(Kind::kPlayback, "still"));
  operator_interface->note_server_alive(clock.now());
  clock.advance(0.99);
  EXPECT_NE(operator_interface->poll(clock.now()), Time::max());
  operator_interface->note_server_alive(clock.now());
  clock.advance(0.99);
  EXPECT_NE(operator_interface->poll(clock.now()), Time::max());
  clock.advance(0.02);
  EXPECT_EQ(operator_interface->poll(clock.now()), Time::max());
  EXPECT_EQ(operator_interface->controls().playback, -1);
}

/// A desk before a session that runs.
struct RunningDesk : DeskBefore<MonotonicClock> {
  RunningDesk() {
    session->start();
    EXPECT_TRUE(plays_until([&] { return is(SupervisionState::kReady); }));
    EXPECT_TRUE(ask(Kind::kPlayback, "still"));
    EXPECT_TRUE(plays_until([&] { return is(SupervisionState::kEngaged); }));
  }
  ~RunningDesk() override { (void)session->finish(); }

  bool is(SupervisionState state) const { return session->snapshot().state == state; }
  bool plays() const { return operator_interface->controls().playback >= 0; }
  void play(double seconds) {
    (void)plays_until([until = clock.now() + from_seconds(seconds), this] { return clock.now() > until; });
  }
  /// Lets the recording play until the condition holds; false if that takes 20 s.
  bool plays_until(const std::function<bool()>& condition) {
    for (int i = 0; i < 4000 && !condition(); ++i) {
      (void)operator_interface->poll(clock.now());
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return condition();
  }
};

TEST_F(RunningDesk, ARecordingEndsWhoeverStopsTheArmAndAResetDoesNotBringItBack) {
  session->ask_stop();  // not through the operator_interface
  EXPECT_TRUE(plays_until([&] { return !plays(); }));
  EXPECT_TRUE(plays_until([&] { return session->stopped_at_rest(); }));
  EXPECT_FALSE(ask(Kind::kPlayback, "still")) << "while the arm is stopped";
  ASSERT_TRUE(ask(Kind::kReset));
  EXPECT_TRUE(plays_until([&] { return is(SupervisionState::kReady); }));
  play(1.5);
  EXPECT_TRUE(is(SupervisionState::kReady));
  EXPECT_FALSE(plays());
  EXPECT_TRUE(ask(Kind::kPlayback, "still"));
  EXPECT_TRUE(plays_until([&] { return is(SupervisionState::kEngaged); }));
}

TEST_F(RunningDesk, ARecordingEndsWithAFault) {
  session->fail("something broke", "a test");
  EXPECT_TRUE(plays_until([&] { return !plays() && is(SupervisionState::kFault); }));
  EXPECT_FALSE(ask(Kind::kPlayback, "still"));
}

TEST_F(RunningDesk, ARecordingEndsWithTheLease) {
  operator_interface->change_hands();
  EXPECT_TRUE(plays_until([&] { return is(SupervisionState::kReady); }));
  play(1.5);
  EXPECT_TRUE(is(SupervisionState::kReady));
}

TEST_F(Desk, RefusesWithAReasonAndChangesNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Bad {
    Kind kind;
    std::string text;
    double value;
    std::string word;
  };
  for (const Bad& bad :
       {Bad{Kind::kProfile, "waitr", 0, "waiter"}, Bad{Kind::kWeight, "latteral", 1, "lateral"},
        Bad{Kind::kWeight, "lateral", -1, "-1"}, Bad{Kind::kWeight, "lateral", nan, "nan"},
        Bad{Kind::kScale, "", 0, "scale"}, Bad{Kind::kScale, "", nan, "scale"}, Bad{Kind::kYaw, "", 100, "yaw"},
        Bad{Kind::kYaw, "", nan, "yaw"}, Bad{Kind::kPlayback, "stil", 0, "still"}, Bad{Kind::kRate, "", 2, "16 to 500"},
        Bad{Kind::kRate, "", 501, "501"}, Bad{Kind::kRate, "", nan, "nan"}}) {
    const Status status = ask(bad.kind, bad.text, bad.value);
    ASSERT_FALSE(status) << bad.text << bad.value;
    EXPECT_NE(status.error().message.find(bad.word), std::string::npos) << status.error().message;
    EXPECT_EQ(operator_interface->controls().profile, 1);
    EXPECT_EQ(operator_interface->controls().weights[kLateral], 3.0);
    EXPECT_EQ(operator_interface->controls().scale, RetargetSettings{}.scale);
    EXPECT_EQ(operator_interface->controls().playback, -1);
  }
}

TEST(Session, RefusesSettingsOutOfRange) {
  ManualClock clock;
  SimulatedArm arm(ur5e(), ur5e().home, {}, clock);
  for (const double rate : {-1.0, 3.0, 501.0, std::numeric_limits<double>::quiet_NaN()}) {
    LiveSettings settings;
    settings.planner_rate_hz = rate;
    EXPECT_FALSE(LiveSession::make(ur5e(), settings, arm, clock)) << rate;
  }
  LiveSettings settings;
  settings.planner_rate_hz = 50.0;
  settings.look_ahead = 0.03;  // longer than the period of 0.02 s
  EXPECT_FALSE(LiveSession::make(ur5e(), settings, arm, clock));
}

}  // namespace
}  // namespace steadyhand

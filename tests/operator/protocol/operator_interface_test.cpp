#include "steadyhand/operator/protocol/operator_interface.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <thread>

#include "steadyhand/session/live/live_session.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using Kind = OperatorRequest::Kind;
constexpr int kLateral = 4;  ///< among the default objectives

/// An operator interface to a session whose threads were not started.
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
    operator_interface = std::make_unique<OperatorInterface>(*session, profiles, 1, RetargetSettings{}, GlassSettings{},
                                                             std::vector<NamedRecording>{{"still", still}});
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
  EXPECT_FALSE(ask(Kind::kRate, "", -1.0));
  EXPECT_EQ(session->planner_rate_hz(), 100.0);
  EXPECT_TRUE(ask(Kind::kRefill));
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

CellObject ball(const Vector3& p, const Vector3& velocity = Vector3::Zero()) {
  CellObject object;
  object.shape = Shape::sphere(0.1);
  object.origin = Eigen::Translation3d(p) * Eigen::Isometry3d::Identity();
  object.velocity = velocity;
  return object;
}

/// An operator interface with a table whose top the glass may touch.
struct DeskWithTable : Desk {
  DeskWithTable() {
    CellObject table = ball({0, 0, -0.5});
    table.name = "table";
    table.color = "#123456";
    table.may_be_touched_by = {"wrist_3_link"};
    EXPECT_TRUE(session->set_cell({"desk", {table}}, clock.now()));
  }
  Status set(const std::string& name, const std::optional<CellObject>& object) {
    return operator_interface->apply({Kind::kObject, name, 0.0, object}, clock.now());
  }
  Cell cell() const { return session->cell(clock.now()); }
  double x(int object) const { return cell().objects.at(object).origin.translation().x(); }
};

/// Objects at the end of the world are in no one's way, and no reason to refuse the requests of others.
TEST_F(DeskWithTable, WhatHasFlownOutOfTheCellHoldsNothingUp) {
  ASSERT_TRUE(set("one", ball({2, 0, 0}, {100, 0, 0})));
  ASSERT_TRUE(set("other", ball({0, 2, 0}, {0, 60, 80})));
  clock.advance(3600.0);
  ASSERT_TRUE(set("table", ball({0, 0, -0.7})));
  EXPECT_NEAR(x(1), Obstacles::kFarthest, 1e-5);
  clock.advance(3600.0);
  EXPECT_TRUE(set("one", {}));
  EXPECT_TRUE(set("other", {}));
}

TEST_F(DeskWithTable, ObjectsComeMoveAndGo) {
  EXPECT_EQ(operator_interface->cell(), nullptr) << "nobody has changed it";
  ASSERT_TRUE(set("ball", ball({2, 0, 0})));
  ASSERT_EQ(cell().objects.size(), 2u);
  EXPECT_EQ(cell().objects[1].name, "ball");
  const auto told = operator_interface->cell();
  EXPECT_NE(told->find("\"ball\""), std::string::npos) << *told;
  ASSERT_TRUE(set("ball", ball({3, 0, 0})));
  EXPECT_EQ(cell().objects.size(), 2u);
  EXPECT_EQ(x(1), 3.0);
  EXPECT_NE(operator_interface->cell(), told);
  ASSERT_TRUE(set("ball", {}));
  EXPECT_EQ(cell().objects.size(), 1u);
  EXPECT_EQ(operator_interface->cell()->find("\"ball\""), std::string::npos) << *operator_interface->cell();
}

TEST_F(DeskWithTable, WhatMovesByItselfGoesOnWhileOthersChange) {
  ASSERT_TRUE(set("ball", ball({2, 0, 0}, {0.5, 0, 0})));
  clock.advance(2.0);
  EXPECT_NEAR(x(1), 3.0, 1e-9);
  ASSERT_TRUE(set("other", ball({0, 3, 0})));
  EXPECT_NEAR(x(1), 3.0, 1e-9);
  EXPECT_NE(operator_interface->cell()->find(fmt::format("\"at_s\":{:.1f}", to_seconds(clock.now()))),
            std::string::npos)
      << "who comes later cannot tell else where it is: " << *operator_interface->cell();
  clock.advance(2.0);
  EXPECT_NEAR(x(1), 4.0, 1e-9);
}

TEST_F(DeskWithTable, WhatIsMovedKeepsItsColourAndWhoMayTouchIt) {
  ASSERT_TRUE(set("table", ball({0, 0, -0.6})));
  EXPECT_EQ(cell().objects[0].origin.translation().z(), -0.6);
  EXPECT_EQ(cell().objects[0].color, "#123456");
  EXPECT_EQ(cell().objects[0].may_be_touched_by, std::vector<std::string>{"wrist_3_link"});
}

TEST_F(DeskWithTable, WhatTheToolCarriesIsNotMovedByOthersAndMayVanish) {
  const auto carry = [&](Kind kind, const std::string& name) {
    const Status done = operator_interface->apply({kind, name, 0.0, {}}, clock.now());
    return done ? "" : done.error().message;
  };
  Cell with_bottle = cell();
  with_bottle.objects.push_back(ball({0, 0, 0.2}));
  with_bottle.objects.back().name = "bottle";
  with_bottle.objects.back().attached = true;
  ASSERT_TRUE(session->set_cell(with_bottle, clock.now()));
  const Status moved = set("bottle", ball({0.6, 0, 0.8}));
  ASSERT_FALSE(moved);
  EXPECT_EQ(moved.error().message, "object 'bottle' is carried by the tool; detach it first");
  EXPECT_EQ(carry(Kind::kDetach, "bottle"), "the arm has not reported its position yet") << "it has not started";
  EXPECT_EQ(carry(Kind::kAttach, "table"), "the arm has not reported its position yet");
  EXPECT_TRUE(set("bottle", {}));
  EXPECT_EQ(cell().objects.size(), 1u);
}

TEST_F(DeskWithTable, RefusesObjectsThatCannotBeAndKeepsTheCell) {
  EXPECT_FALSE(set("ball", {})) << "there is none to remove";
  CellObject bad = ball({0, 0, 0});
  bad.shape = Shape::sphere(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(set("ball", bad));
  bad = ball({0, 0, std::numeric_limits<double>::infinity()});
  EXPECT_FALSE(set("ball", bad));
  bad = ball({0, 0, 0});
  bad.margin = -1.0;
  EXPECT_FALSE(set("ball", bad));
  EXPECT_EQ(operator_interface->cell(), nullptr);
  for (int i = 1; i < Obstacles::kMost; ++i) ASSERT_TRUE(set("ball " + std::to_string(i), ball({2, 0, 0})));
  const Status status = set("one more", ball({2, 0, 0}));
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("64"), std::string::npos) << status.error().message;
  EXPECT_EQ(static_cast<int>(cell().objects.size()), Obstacles::kMost);
}

/// An operator interface to a running session.
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

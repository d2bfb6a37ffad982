#include <gtest/gtest.h>

#include "steadyhand/operator/protocol/operator_interface.hpp"
#include "steadyhand/operator/protocol/session_setup.hpp"
#include "steadyhand/session/live/one_thread_session.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using Kind = OperatorRequest::Kind;
using State = SupervisionState;

/// A session in virtual time that begins with the first of some profiles, and a hand that sweeps.
struct ProfileSession {
  explicit ProfileSession(const std::vector<Profile>& profiles) : arm(ur5e(), ur5e().home, {}, clock) {
    LiveSettings settings = operator_defaults();
    settings.planner_rate_hz = 25.0;
    settings.time_budget = false;
    take_profiles(profiles, 0, settings);
    settings.planning.retarget.scale = 1.0;
    auto made = OneThreadSession::make(ur5e(), settings, arm, clock);
    EXPECT_TRUE(made) << made.error().message;
    session = std::move(*made);
    desk = std::make_unique<OperatorInterface>(*session, profiles, 0, settings.planning.retarget, settings.glass,
                                               std::vector<NamedRecording>{});
    LiveTaps taps;
    taps.look = [this](const SessionSnapshot& seen) { look = seen; };
    taps.command = [this](const JointCommand& command) { commands.push_back(command); };
    taps.settings = [this](const AppliedSettings& now) { applied = now.settings; };
    taps.step = [this](const PlanningRecord& step) { solves[step.ocp] += step.engaged[0] ? 1 : 0; };
    session->start(std::move(taps));
    run(0.1);
  }
  ~ProfileSession() {
    const MonitorResult seen = session->summary().monitor;
    EXPECT_TRUE(seen.beyond_limits == 0 && seen.too_fast == 0 && seen.in_contact == 0) << to_text(seen);
  }

  void run(double seconds) {
    for (const Time end = clock.now() + from_seconds(seconds); clock.now() < end;) {
      if (grips) swept += 0.002;
      OperatorSample sample;
      sample.stamp = {clock.now(), clock.now()};
      sample.X_operator_hand = sweeping({0.25, 0.3, 0.1}, 4.0)(swept);
      sample.X_operator_hand.q = Eigen::AngleAxisd(0.3 * std::sin(3.0 * swept), Vector3::UnitX());
      sample.clutch = grips;
      if (speaks) desk->hand(sample);
      session->step();
      (void)desk->poll(clock.now());
    }
  }
  Status choose(const std::string& profile) { return desk->apply({Kind::kProfile, profile, 0.0}, clock.now()); }
  void grip(double seconds) {
    grips = false;
    run(0.05);
    commands.clear();
    grips = true;
    run(seconds);
    EXPECT_EQ(look.state, State::kEngaged) << look.reason;
  }
  /// Share of the limits, over the commands since the last grip.
  double fastest() const {
    double most = 0.0;
    for (const JointCommand& command : commands)
      most = std::max(most, command.dq.cwiseAbs().cwiseQuotient(ur5e().velocity_max).maxCoeff());
    return most;
  }

  SteppedClock clock{nullptr};
  SimulatedArm arm;
  std::unique_ptr<OneThreadSession> session;
  std::unique_ptr<OperatorInterface> desk;
  SessionSnapshot look;
  std::vector<JointCommand> commands;
  OperatorSettings applied;
  std::map<const Ocp*, int> solves;  ///< steps towards the hand, by what was solved
  double swept = 0.0;                ///< s of the hand's motion
  bool grips = false, speaks = true;
};

Profile named(const char* file, const char* name, const std::function<void(Profile&)>& change = {}) {
  Profile profile = *load_profile(file);
  profile.name = name;
  if (change) change(profile);
  return profile;
}
Profile gentle() {
  return named("tracking", "gentle", [](Profile& p) { p.ocp.velocity_scale = 0.1; });
}

/// A key of a profile file, and what it sets.
struct Key {
  const char* name;
  std::function<void(Profile&)> change;
  bool at_rest = true;
};
class EveryKey : public testing::TestWithParam<Key> {};

/// A session in which the profile was chosen has the commands of one that started with it.
TEST_P(EveryKey, OfAChosenProfileTakesEffect) {
  const Profile first = named("carry", "first"), own = named("carry", "own", GetParam().change);
  EXPECT_EQ(planner_differences(first, own), GetParam().at_rest ? GetParam().name : "");
  ProfileSession before({first}), started({own}), chosen({first, own});
  ASSERT_TRUE(chosen.choose("own"));
  for (ProfileSession* session : {&before, &started, &chosen}) {
    session->run(0.1);
    session->grip(1.0);
  }
  const auto apart = [&](const ProfileSession& other) {
    double most = 0.0;
    for (std::size_t i = 0; i < std::min(other.commands.size(), started.commands.size()); ++i)
      most = std::max(most, (other.commands[i].q - started.commands[i].q).cwiseAbs().maxCoeff());
    return most;
  };
  ASSERT_GT(started.commands.size(), 400u);
  EXPECT_LT(apart(chosen), 1e-10);
  EXPECT_GT(apart(before), 1e-6) << "the key changes nothing here";
}

INSTANTIATE_TEST_SUITE_P(
    Profiles, EveryKey,
    testing::Values(Key{"limits.velocity_scale", [](Profile& p) { p.ocp.velocity_scale = 0.1; }},
                    Key{"limits.acceleration_scale", [](Profile& p) { p.ocp.acceleration_scale = 0.1; }},
                    Key{"horizon", [](Profile& p) { p.ocp.horizon = 5; }},
                    Key{"dt", [](Profile& p) { p.ocp.dt = 0.08; }},
                    Key{"tolerance", [](Profile& p) { p.tolerance = 0.1; }},
                    Key{"liquid.margin", [](Profile& p) { p.ocp.liquid->margin = 1e-3; }},
                    Key{"liquid.price", [](Profile& p) { p.ocp.liquid->price = 50.0; }},
                    Key{"liquid.lean", [](Profile& p) { p.ocp.liquid->lean_max = 0.05; }},
                    Key{"liquid.frequencies", [](Profile& p) { p.ocp.liquid->frequencies = {0.9, 1.0, 1.1}; }},
                    Key{"weights", [](Profile& p) { p.ocp.weights["velocity"] = {1, 2, 3, 4, 5, 6}; }, false},
                    Key{"prediction", [](Profile& p) { p.prediction = Prediction::kConstantVelocity; }, false},
                    Key{"tilt", [](Profile& p) { p.tilt_max = 1.0; }, false}),
    [](const auto& key) {
      std::string name = key.param.name;
      std::replace(name.begin(), name.end(), '.', '_');
      return name;
    });

TEST(Profiles, ASolverThatIsChosenSolves) {
  if (solver_names().size() < 2) GTEST_SKIP() << "this build has one solver";
  const Profile first = named("tracking", "first");
  const Profile own = named("tracking", "own", [&](Profile& p) {
    for (const std::string& name : solver_names())
      if (name != first.solver) p.solver = name;
  });
  ProfileSession started({own}), chosen({first, own});
  ASSERT_TRUE(chosen.choose("own"));
  for (ProfileSession* session : {&started, &chosen}) {
    session->run(0.1);
    session->grip(0.5);
  }
  for (std::size_t i = 0; i < started.commands.size(); ++i) ASSERT_EQ(started.commands[i].q, chosen.commands[i].q) << i;
}

/// Other limits apply once at rest: the arm is released, stops, and follows the next grip within them.
TEST(Profiles, OneThatIsChosenInMotionTakesEffectAtRestAndAsAWhole) {
  ProfileSession s({named("tracking", "quick"), gentle()});
  s.grip(1.0);
  ASSERT_GT(s.fastest(), 0.2);
  ASSERT_TRUE(s.choose("gentle"));
  s.run(2.0);
  EXPECT_EQ(s.look.state, State::kReady) << "the hand has not opened since";
  EXPECT_EQ(s.look.reason, "the new profile starts after the arm has stopped: release and engage again");
  EXPECT_TRUE(s.look.command.dq.isZero(0.0));
  s.grip(2.0);
  EXPECT_LT(s.fastest(), 0.1 * (1.0 + 1e-4));
  EXPECT_GT(s.fastest(), 0.09);
  ASSERT_TRUE(s.choose("quick"));
  s.run(2.0);
  s.grip(1.0);
  EXPECT_GT(s.fastest(), 0.2);
}

/// A hand that engages again while the arm still stops does not follow within the old limits.
TEST(Profiles, AGripInTheStopWaitsForTheProfile) {
  ProfileSession s({named("tracking", "quick"), gentle()});
  s.grip(1.0);
  ASSERT_TRUE(s.choose("gentle"));
  s.run(0.05);
  ASSERT_FALSE(s.look.command.dq.isZero(0.0));
  ASSERT_EQ(s.solves.size(), 1u);
  const auto quick = *s.solves.begin();
  for (int i = 0; i < 60; ++i) {
    s.grips = !s.grips;
    s.run(0.03);
  }
  EXPECT_EQ(s.solves[quick.first], quick.second);
  ASSERT_EQ(s.solves.size(), 2u);
  for (const auto& [solved, steps] : s.solves) EXPECT_GT(steps, 0);
}

TEST(Profiles, ThoseThatDifferInWeightsAloneChangeInMotion) {
  std::vector<Profile> profiles;
  for (const char* name : {"tracking", "anti-slosh", "waiter", "follow", "carry"})
    profiles.push_back(*load_profile(name));
  ASSERT_EQ(planners_of(profiles, 2).kinds.size(), 1u) << "of ours";
  ProfileSession s(profiles);
  s.grip(0.5);
  for (const Profile& profile : profiles) {
    ASSERT_TRUE(s.choose(profile.name));
    s.run(0.1);
    EXPECT_EQ(s.look.state, State::kEngaged) << profile.name;
  }
}

/// The liquid of one counts for all, also where the first one knows none.
TEST(Profiles, PlannersAreSharedWhereTheyCanBe) {
  const std::vector<Profile> profiles{named("carry", "wary", [](Profile& p) { p.ocp.liquid->margin = 8e-3; }),
                                      named("tracking", "plain"), named("carry", "carry"), gentle()};
  EXPECT_EQ(planners_of(profiles, 1).of_profile, (std::vector<int>{0, 0, 1, 2}));
  LiveSettings settings;
  take_profiles(profiles, 1, settings);
  ASSERT_EQ(settings.planning.more.size(), 2u);
  ASSERT_TRUE(settings.planning.ocp.liquid && settings.planning.more[1].ocp.liquid);
  EXPECT_EQ(settings.planning.ocp.liquid->margin, 8e-3);
  EXPECT_EQ(settings.planning.more[0].ocp.liquid->margin, 5e-3);
  EXPECT_EQ(settings.planning.more[1].ocp.velocity_scale, 0.1);
}

/// A slider has one number for all weights of a term: the largest.
TEST(Profiles, AWeightThatIsSetKeepsTheRatiosOfTheProfile) {
  ProfileSession s({named("tracking", "own", [](Profile& p) { p.ocp.weights["orientation"] = {0.0, 1.0, 4.0}; })});
  constexpr int kOrientation = 1;
  ASSERT_EQ(s.session->ocp().objectives()[kOrientation]->name(), "orientation");
  const auto set = [&](double value) {
    EXPECT_TRUE(s.desk->apply({Kind::kWeight, "orientation", value}, s.clock.now()));
    EXPECT_EQ(s.desk->controls().weights[kOrientation], value);
    s.run(0.1);
    return Vector3(s.applied.weights[kOrientation]);
  };
  EXPECT_EQ(s.desk->controls().weights[kOrientation], 4.0);
  EXPECT_EQ(set(8.0), Vector3(0.0, 2.0, 8.0));
  EXPECT_EQ(set(0.0), Vector3(0.0, 0.0, 0.0));
  EXPECT_EQ(set(2.0), Vector3(0.0, 0.5, 2.0));
}

TEST(Profiles, InAPolicysTurnAStopForAProfileIsRefused) {
  ProfileSession s({named("tracking", "quick"), gentle(), named("waiter", "other")});
  ASSERT_TRUE(s.desk->connect(PolicyInfo{"test", 0.05}));
  ASSERT_TRUE(s.desk->apply({Kind::kPolicy, "", 1.0}, s.clock.now()));
  const Status refused = s.choose("gentle");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message,
            "profile 'gentle' differs from 'quick' in limits.velocity_scale: the arm must stop for that; end the "
            "policy's turn first");
  EXPECT_EQ(s.desk->controls().profile, 0);
  EXPECT_TRUE(s.choose("other"));
}

/// A turn that starts while the arm still stops for a profile: the policy sends only once that its hand is open.
TEST(Profiles, APolicysTurnThatBeginsDuringTheStopIsNotLost) {
  ProfileSession s({named("tracking", "quick"), gentle()});
  ASSERT_TRUE(s.desk->connect(PolicyInfo{"test", 0.05}));
  s.grip(1.0);
  ASSERT_TRUE(s.choose("gentle"));
  s.grips = false;
  s.run(0.02);
  s.speaks = false;
  const auto turn = [&] { return bool(s.desk->apply({Kind::kPolicy, "", 1.0}, s.clock.now())); };
  for (int i = 0; i < 100 && !turn(); ++i) s.run(0.01);
  ASSERT_TRUE(s.desk->controls().policy_turn);
  ASSERT_EQ(s.applied.planner, 0) << "not in force yet";
  for (int i = 0; i < 60; ++i) {
    s.desk->target({s.look.tools[0].X_base_tool, {}}, s.clock.now());
    s.run(0.05);
  }
  EXPECT_EQ(s.applied.planner, 1);
  EXPECT_EQ(s.look.state, State::kEngaged) << s.look.reason;
}

}  // namespace
}  // namespace steadyhand

// The summary of a session, computed from its recording.
#include <gtest/gtest.h>

#include <algorithm>

#include "steadyhand/report/figures/past_session.hpp"
#include "steadyhand/report/figures/session_story.hpp"

namespace steadyhand {
namespace {

/// One joint; planned ten times a second while the hand controls it.
struct Told : testing::Test {
  Told() {
    session.overview.first = Time(0);
    session.overview.last = from_seconds(20.0);
  }
  void plan(double from, double until) {
    for (double t = from; t < until; t += 0.1) {
      PlanStep step;
      step.t_s = t;
      step.q = step.dq = step.ddq = JointVector::Zero(1);
      step.tools[0].engaged = true;
      session.steps.push_back(step);
    }
  }
  /// The joint goes from 0 to 1 rad between these times.
  void move(double from, double until) {
    for (double t = 0.0; t < 20.0; t += 0.1) {
      JointState state{{from_seconds(t), from_seconds(t)}, JointVector::Zero(1), JointVector::Zero(1)};
      state.q[0] = std::clamp((t - from) / (until - from), 0.0, 1.0);
      session.states.push_back(state);
    }
  }
  void change(double t, const char* to) { session.changes.push_back({from_seconds(t), "", to, ""}); }
  void see(double t, double spilled_share, double lateral = 0.0) {
    LiquidState liquid;
    liquid.spilled = spilled_share > 0.0;
    liquid.spilled_share = spilled_share;
    liquid.lateral = lateral;
    session.liquids[0].states.emplace_back(from_seconds(t), liquid);
    session.liquids[0].spills.see(from_seconds(t), liquid);
  }
  std::vector<std::string> of(const std::string& kind) const {
    std::vector<std::string> found;
    for (const auto& event : tell_story(session).events) {
      if (event.kind == kind) found.push_back(fmt::format("{:.1f} {}", event.t_s, event.what));
    }
    return found;
  }
  using Lines = std::vector<std::string>;
  SessionFile session;
};

TEST_F(Told, AnArmThatNeedsNoPlanRestsFromWhenItStands) {
  plan(1.0, 3.05);
  plan(15.0, 16.0);
  move(1.0, 3.5);  // to the end of its last plan, or in a stop
  change(1.0, "engaged");
  change(3.0, "stopping");
  change(15.0, "engaged");
  EXPECT_EQ(of("gap"), Lines());
  EXPECT_EQ(of("rest"), Lines{"3.5 stationary for 11.5 s"});
  EXPECT_NEAR(tell_story(session).led_s, 2.0 + 5.0, 1e-9);
}

TEST_F(Told, AHandThatLedWithoutAPlanIsAGap) {
  plan(1.0, 3.05);
  plan(8.0, 9.0);
  move(1.0, 8.0);
  change(1.0, "engaged");
  EXPECT_EQ(of("gap"), Lines{"3.0 no plan for 5.0 s while engaged"});
  EXPECT_EQ(of("rest"), Lines());
}

TEST_F(Told, ARefillIsSaid) {
  for (const auto& [t, share] : {std::pair(1.0, 0.0), {2.0, 0.1}, {3.0, 0.1}, {4.0, 0.0}}) see(t, share);
  EXPECT_EQ(of("spill"), Lines{"2.0 spilled 10.0 % of the liquid"});
  EXPECT_EQ(of("refill"), Lines{"4.0 a full glass"});
}

TEST_F(Told, AGripperHasNoLiquidThoughItsSessionsRecordOneAtRest) {
  see(1.0, 0.0);
  EXPECT_TRUE(tell_story(session).knows_liquid);
  session.overview.metadata["robot"]["json"] = R"({"gripper":{"closes_in":0.8}})";
  EXPECT_FALSE(tell_story(session).knows_liquid || tell_story(session).has_glass);
}

TEST_F(Told, ASpillSaysWithinWhichTimeItLostAllOfIt) {
  double t = 1.0;
  for (const double share : {0.0, 0.2, 0.6, 1.0, 1.0, 1.0, 0.0}) see(t += 0.3, share);
  EXPECT_EQ(of("spill"), Lines{"1.6 spilled 100 % of the liquid within 0.6 s"});
}

/// By the names that the page shows while the arm moves.
TEST_F(Told, WhatHeldTheArmIsNamed) {
  session.names.joints = {"wrist_3_joint"};
  session.overview.metadata["robot"]["json"] = R"({"bodies":[{"name":"forearm_5"},{"name":"glass"}]})";
  Cell empty, set;
  set.objects.resize(2);
  set.objects[1].name = "Table";
  session.cells = {{Time(0), empty}, {from_seconds(5.0), set}};
  for (const auto& [t, kind, first, second] : {std::tuple(1.0, "velocity", 0, -1),
                                               {4.0, "obstacle", 0, 1},
                                               {6.0, "obstacle", 0, 1},
                                               {8.0, "self_collision", 1, 0},
                                               {10.0, "obstacle", 129, 7},
                                               {12.0, "acceleration", 9, -1},
                                               {14.0, "reach", -1, -1}}) {
    session.limits.push_back({from_seconds(t), kind, first, second});
  }
  EXPECT_EQ(of("limit"),
            (Lines{"1.0 wrist 3 is at its top speed", "4.0 forearm is close to an object",
                   "6.0 forearm is close to Table", "8.0 glass is close to forearm", "10.0 Table is close to an object",
                   "12.0 a joint is at its top acceleration", "14.0 the target is out of reach"}));
  for (const char* damaged :
       {"{broken", "", "[1]", R"({"bodies":3})", R"({"bodies":[{"name":3},{}]})", R"({"bodies":[1,2]})"}) {
    session.overview.metadata["robot"]["json"] = damaged;
    EXPECT_EQ(of("limit")[3], "8.0 the arm is close to the arm") << damaged;
  }
}

TEST(Parts, AreNamedAsPeopleCallThem) {
  for (const auto& [name, text] : {std::pair("forearm_5", "forearm"),
                                   {"wrist_3_joint", "wrist 3"},
                                   {"wrist_3_0", "wrist 3"},
                                   {"shoulder_pan_joint", "shoulder pan"},
                                   {"joint_2", "joint 2"},
                                   {"upper_arm_link", "upper arm"}}) {
    EXPECT_EQ(part_text(name), text);
  }
}

/// How often, how much and why the liquid went over the rim, at its time and under its profile.
TEST_F(Told, ASpillIsExplained) {
  plan(1.0, 15.0);
  change(1.0, "engaged");
  change(12.0, "stopping");
  SettingsChange settings;
  settings.profile = "tracking";
  settings.no_spill = false;
  session.settings.push_back(settings);
  settings.profile = "carry";
  settings.no_spill = true;
  settings.at = from_seconds(5.0);
  session.settings.push_back(settings);
  const auto share_at = [](double t) {
    for (const auto& [until, share] :
         {std::pair(2.0, 0.0), {2.5, 0.1}, {4.0, 0.744}, {6.0, 0.0}, {7.0, 0.02}, {12.5, 0.0}, {99.0, 0.3}}) {
      if (t < until - 1e-9) return share;
    }
    return 0.0;
  };
  for (int k = 10; k < 150; ++k)
    see(0.1 * k, share_at(0.1 * k), k == 18 ? 12.6 : k == 14 ? 20.0 : k == 24 ? 15.0 : 3.0);
  const SessionStory story = tell_story(session);
  ASSERT_TRUE(story.knows_liquid);
  ASSERT_EQ(story.spills.size(), 3u);
  EXPECT_DOUBLE_EQ(story.spills[0].share, 0.744);
  EXPECT_DOUBLE_EQ(story.spills[0].lateral, 12.6);
  EXPECT_EQ(story.spills[0].cause,
            "tracking does not keep the liquid in; lateral specific force up to 12.60 m/s² just before, 15.00 while it "
            "ran out");
  EXPECT_EQ(story.spills[1].cause,
            "carry should have kept the liquid in; lateral specific force up to 3.00 m/s² just before");
  EXPECT_EQ(story.spills[2].cause, "in a stop, under carry; lateral specific force up to 3.00 m/s² just before");
  const auto told =
      std::find_if(story.events.begin(), story.events.end(), [](const auto& e) { return e.kind == "spill"; });
  EXPECT_EQ(told->why, story.spills[0].cause);
  EXPECT_DOUBLE_EQ(told->amount, 0.744);
  const std::vector<ProfileResult> results = split_by_settings(session);
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[0].liquids[0].spills, 1);
  EXPECT_EQ(results[1].liquids[0].spills, 2);
  EXPECT_DOUBLE_EQ(results[1].liquids[0].spilled_share, 0.3);
}

TEST_F(Told, WeightsAreNumbersForPeople) {
  plan(1.0, 3.0);
  change(1.0, "engaged");
  SettingsChange settings;
  settings.profile = "carry";
  settings.weights = {{"lateral", {0.04}}, {"position", {1500.0, 1500.0, 1500.0}}};
  session.settings.push_back(settings);
  EXPECT_EQ(split_by_settings(session).at(0).weights, settings.weights);
  EXPECT_EQ(weight_text({0.03981071705534972}), "0.0398");
  EXPECT_EQ(weight_text({1500.0, 1500.0, 1500.0}), "1500");
  EXPECT_EQ(weight_text({1.0, 1.0, 2e-3}), "1 1 0.002");
}

TEST_F(Told, WhatAnArmsOwnStopSpilledIsNoFaultOfTheProfile) {
  SettingsChange settings;
  settings.profile = "carry";
  settings.no_spill = true;
  session.settings.push_back(settings);
  change(1.0, "engaged");
  change(2.0, "fault");
  see(1.9, 0.0), see(2.0, 0.1);
  const SessionStory story = tell_story(session);
  ASSERT_EQ(story.spills.size(), 1u);
  EXPECT_EQ(story.spills[0].cause, "in a stop by a fault, under carry");
}

TEST_F(Told, EachProfileHasWhatItSpilled) {
  const auto lose = [&](double t, double share, const char* profile) {
    LiquidState liquid;
    liquid.spilled = share > 0.0;
    liquid.spilled_share = share;
    session.liquids[0].states.emplace_back(from_seconds(t), liquid);
    session.liquids[0].spills.see(from_seconds(t), liquid, profile);
  };
  lose(1.0, 0.0, "carry");
  lose(2.0, 0.001, "carry");
  lose(3.0, 0.001, "tracking");  // it has lost nothing yet
  lose(4.0, 0.11, "tracking");
  lose(5.0, 1.0, "tracking");
  lose(6.0, 1.0, "carry");
  lose(7.0, 0.0, "carry");
  EXPECT_EQ(of("spill"), (Lines{"2.0 spilled 0.1 % of the liquid", "4.0 spilled 99.9 % of the liquid within 1.0 s"}));
  EXPECT_EQ(of("refill"), Lines{"7.0 a full glass"});
  ASSERT_NE(worst_of(session.liquids[0].spills.spills()), nullptr);
  EXPECT_EQ(worst_of(session.liquids[0].spills.spills())->profile, "tracking");
}

TEST_F(Told, APlannerThatWasLateIsWhatASpillCameOf) {
  SettingsChange settings;
  settings.profile = "carry";
  settings.no_spill = true;
  session.settings.push_back(settings);
  change(1.0, "engaged");
  for (const double t : {3.0, 10.0}) {
    see(t - 0.1, 0.0);
    see(t, 0.2);
  }
  see(11.0, 0.0);
  const auto causes = [&] {
    std::vector<std::string> found;
    for (const auto& spill : tell_story(session).spills) found.push_back(spill.cause.substr(0, spill.cause.find(':')));
    return found;
  };
  const Lines innocent(2, "carry should have kept the liquid in");
  EXPECT_EQ(causes(), innocent);
  session.changes.push_back({from_seconds(9.5), "engaged", "holding", "", false, ReasonCode::kPlannerLate});
  session.changes.push_back({from_seconds(9.6), "holding", "engaged", ""});
  EXPECT_EQ(causes(), (Lines{innocent.front(), "the planner was late"}));
  for (const double t : {1.0, 2.0, 2.5, 4.0}) {
    SessionStatistics counted;
    counted.now = from_seconds(t);
    counted.rejected_plans = t > 2.0 ? 7 : 0;
    session.statistics.push_back(counted);
  }
  EXPECT_EQ(causes(), Lines(2, "the planner was late"));
}

TEST_F(Told, WhatWasSpilledBeforeIsNotOfThisRecording) {
  see(1.0, 0.4), see(2.0, 0.4), see(3.0, 0.0), see(4.0, 0.0);
  EXPECT_EQ(of("spill"), Lines());
  session.liquids[0].states.clear();
  session.liquids[0].spills = {};
  see(1.0, 0.4), see(2.0, 0.4), see(3.0, 0.7), see(4.0, 0.0), see(5.0, 0.2);
  EXPECT_EQ(of("spill"), (Lines{"3.0 spilled 30.0 % of the liquid", "5.0 spilled 20.0 % of the liquid"}));
}

TEST_F(Told, WithoutALiquidNothingIsSaidOfSpills) {
  plan(1.0, 2.0);
  EXPECT_FALSE(tell_story(session).knows_liquid);
  EXPECT_EQ(split_by_settings(session).front().liquids[0].spills, -1);
}

/// Misses in quick succession are one line, or they would bury everything else.
TEST_F(Told, MissedDeadlinesAreToldTogether) {
  std::uint64_t missed = 0;
  for (double t = 0.0; t < 19.5; t += 1.0) {
    if (t == 2.0 || t == 3.0 || t == 5.0) missed += 2;
    if (t == 17.0) ++missed;
    SessionStatistics counted;
    counted.now = from_seconds(t);
    counted.missed_deadlines = missed;
    counted.latency_us.p50 = counted.latency_us.p99 = t < 10.0 ? 0.0 : 2000.0;
    session.statistics.push_back(counted);
  }
  EXPECT_EQ(tell_story(session).latency.front().t_s, 10.0);  // the arm was not engaged before
  EXPECT_EQ(of("missed"), (Lines{"2.0 6 missed deadlines of control within 3 s", "17.0 1 missed deadline of control"}));
  EXPECT_EQ(tell_story(session).events.front().why, "too short to stop the arm, which followed its plan");
  session.changes.push_back({from_seconds(18.0), "", "stopping", "", true, ReasonCode::kStalled});
  EXPECT_EQ(tell_story(session).events.front().why, "");
}

/// A program's later recordings begin where its clock is by then.
TEST_F(Told, AReportCountsFromTheArmsFirstPosture) {
  session.overview.first = from_seconds(0.8);
  plan(1.0, 3.05);
  move(1.0, 3.0);
  std::erase_if(session.states, [](const JointState& state) { return state.stamp.made < from_seconds(0.95); });
  change(1.0, "engaged");
  see(1.0, 0.0);
  see(2.0, 0.1);
  const Result<ReportInput> report = report_of_session(session, "");
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_NEAR(report->begin_s, 1.0, 1e-9);
  EXPECT_EQ(report->story->begin_s, 0.0);
  EXPECT_NEAR(report->story->end_s, 19.0, 1e-9);
  ASSERT_EQ(report->story->spills.size(), 1u);
  EXPECT_NEAR(report->story->spills[0].t_s, 1.0, 1e-9);
  EXPECT_NEAR(report->story->events.front().t_s, 0.0, 1e-9);
  EXPECT_NEAR(report->profiles.front().steps.front().t_s, 0.0, 1e-9);
  session.states.clear();
  EXPECT_EQ(report_of_session(session, "")->begin_s, 0.8) << "where the arm never said where it was";
}

/// Each profile has the values measured while the hand controlled the arm with it; a stop and the rest after it count
/// for none.
TEST_F(Told, WhatWasFeltAndLedBelongsToTheProfileOfThen) {
  plan(1.0, 9.0);
  change(1.0, "engaged");
  change(9.0, "stopping");
  SettingsChange settings;
  settings.profile = "tracking";
  session.settings.push_back(settings);
  settings.profile = "carry";
  settings.at = from_seconds(4.0);
  session.settings.push_back(settings);
  for (double t = 0.05; t < 12.0; t += 0.1) {
    session.liquids[0].felt.push_back({from_seconds(t), t < 4.0 ? 6.0 : 2.0, t < 4.0 ? 4.0 : t < 8.9 ? 1.5 : 50.0, 2});
  }
  const std::vector<ProfileResult> results = split_by_settings(session);
  ASSERT_EQ(results.size(), 2u);
  EXPECT_NEAR(results[0].led_s, 3.0, 1e-9);
  EXPECT_NEAR(results[1].led_s, 5.0, 1e-9);
  EXPECT_EQ(results[0].liquids[0].felt.size(), 30u);
  EXPECT_EQ(results[1].liquids[0].felt.size(), 49u) << "not what began before the stop and ended in it";
  ToolMetrics metrics;
  count_felt(results[0].liquids[0].felt, metrics);
  EXPECT_DOUBLE_EQ(metrics.lateral_mean, 3.0);
  EXPECT_DOUBLE_EQ(metrics.lateral_max, 4.0);
  count_felt(results[1].liquids[0].felt, metrics);
  EXPECT_DOUBLE_EQ(metrics.lateral_mean, 1.0);
  EXPECT_DOUBLE_EQ(metrics.lateral_max, 1.5);
}

}  // namespace
}  // namespace steadyhand

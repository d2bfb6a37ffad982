// Figures of a robot with two tools.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "sample_run.hpp"
#include "steadyhand/report/figures/motion.hpp"
#include "steadyhand/report/figures/page_data.hpp"
#include "steadyhand/report/figures/session_story.hpp"
#include "steadyhand/report/figures/table.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

/// Both tools engaged; the second is 0.1 m further off its target.
ProfileResult two_tool_profile() {
  ProfileResult result = test::sample_profile("tracking", "P1 tracking", 0.03, 1.0, 2100, 1);
  result.names.tools = {"left", "right"};
  for (PlanStep& step : result.steps) {
    step.tool_count = 2;
    step.tools[1] = step.tools[0];
    step.tools[0].X_base_planned.p = step.tools[0].X_base_target.p;
    step.tools[1].X_base_planned.p = step.tools[1].X_base_target.p + Vector3(0.1, 0.0, 0.0);
    step.distance_between_arms_m = 0.25 + 0.1 * step.t_s;
  }
  return result;
}

TEST(TwoToolFigures, AreOfEachToolByItsName) {
  const Metrics m = metrics_of(two_tool_profile());
  EXPECT_EQ(m.tool_count, 2);
  EXPECT_NEAR(m.tools[0].position_rms, 0.0, 1e-12);
  EXPECT_NEAR(m.tools[1].position_rms, 0.1, 1e-12);
  EXPECT_NEAR(m.distance_between_arms, 0.25, 1e-12);
  const std::string table = format_table({two_tool_profile()});
  for (const char* row :
       {"Position error, RMS, left ", "Position error, RMS, right ", "Distance between arms, smallest "})
    EXPECT_NE(table.find(row), std::string::npos) << table;
  EXPECT_EQ(table.find("Solve time, mean, left"), std::string::npos);
  const std::string one = format_table({test::sample_profile("tracking", "P1 tracking", 0.03, 1.0, 2100, 1)});
  EXPECT_EQ(one.find("left"), std::string::npos);
  EXPECT_EQ(one.find("Distance between arms"), std::string::npos);
}

TEST(TwoToolFigures, ThePageHasTheCurvesOfTheOtherTool) {
  ReportInput input = test::sample_input();
  input.profiles = {two_tool_profile()};
  const Json data = Json::parse(page_data(input, {}));
  EXPECT_EQ(data["tools"], Json({"left", "right"}));
  ASSERT_EQ(data["targets"].size(), 2u);
  EXPECT_EQ(data["targets"][1]["label"], "target, right");
  const Json& profile = data["profiles"][0];
  ASSERT_EQ(profile["other_tools"].size(), 1u);
  const Json& right = profile["other_tools"][0];
  EXPECT_EQ(right["name"], "right");
  EXPECT_NEAR(right["position_error"][0], 100.0, 1e-3);
  EXPECT_NEAR(right["metrics"]["position_rms"], 0.1, 1e-6);
  EXPECT_EQ(right["x"].size(), profile["t"].size());
  EXPECT_NEAR(profile["distance_between_arms"][0], 250.0, 1e-3);
}

/// A session in which the left tool is engaged from 1 s to 5 s, the right one from 3 s to 8 s.
SessionFile two_tool_session() {
  SessionFile session;
  session.overview.last = from_seconds(10.0);
  session.names.tools = {"left", "right"};
  session.velocity_max = session.acceleration_max = JointVector::Ones(1);
  for (int i = 0; i < 100; ++i) {
    PlanStep& step = session.steps.emplace_back();
    step.t_s = 0.1 * i;
    step.q = step.dq = step.ddq = JointVector::Zero(1);
    step.tool_count = 2;
    step.tools[0].engaged = i >= 10 && i < 50;
    step.tools[1].engaged = i >= 30 && i < 80;
    step.tools[1].X_base_planned.p.x() = 0.02;
    for (const int t : {0, 1}) {
      LiquidState liquid;
      liquid.freeboard = 0.01;
      liquid.spilled = t == 1 && i >= 40;
      liquid.spilled_share = liquid.spilled ? 0.5 : 0.0;
      SessionFile::Liquid& known = session.liquids[t];
      known.states.emplace_back(from_seconds(step.t_s), liquid);
      known.spills.see(from_seconds(step.t_s), liquid);
      known.felt.push_back({from_seconds(step.t_s), t + 1.0, t + 1.0, 1});
    }
    JointState& state = session.states.emplace_back();
    state.stamp.made = from_seconds(step.t_s);
    state.q = state.dq = JointVector::Zero(1);
    state.gripper[1] = 0.5;
  }
  const auto change = [&](double t, const char* to, int tool) {
    session.changes.push_back({from_seconds(t), "", to, "why", false, std::nullopt, tool});
  };
  change(0.5, "ready", 0);
  change(0.5, "ready", 1);
  change(1.0, "engaged", 0);
  change(3.0, "engaged", 1);
  change(5.0, "ready", 0);
  change(8.0, "stopping", 0);
  change(8.0, "stopping", 1);
  return session;
}

TEST(TwoToolFigures, OfASessionNameTheToolOfEachEvent) {
  const SessionStory story = tell_story(two_tool_session());
  EXPECT_NEAR(story.led_s, 7.0, 1e-9) << "with any hand";
  std::vector<std::string> states, spills;
  for (const auto& event : story.events) {
    if (event.kind == "state") states.push_back(event.what + " " + event.why);
    if (event.kind == "spill") spills.push_back(event.what);
  }
  const std::vector<std::string> expected{"ready why", "engaged left: why", "engaged right: why", "ready left: why",
                                          "stopping why"};
  EXPECT_EQ(states, expected);
  ASSERT_EQ(spills.size(), 1u);
  EXPECT_EQ(spills[0], "right: spilled 50.0 % of the liquid");
  const std::vector<ProfileResult> results = split_by_settings(two_tool_session());
  ASSERT_EQ(results.size(), 1u);
  EXPECT_NEAR(results[0].led_s, 7.0, 1e-9);
  EXPECT_EQ(results[0].liquids[0].spills, 0);
  EXPECT_EQ(results[0].liquids[1].spills, 1);
  EXPECT_EQ(results[0].liquids[0].felt.size(), 40u) << "while that tool is engaged";
  EXPECT_EQ(results[0].liquids[1].felt.size(), 50u);
}

TEST(TwoToolFigures, TheMotionHasTheOtherTool) {
  const Json motion = Json::parse(motion_json(two_tool_session(), 0.1, 1000));
  EXPECT_EQ(motion["tool"], "left");
  EXPECT_EQ(motion["gripper"][0], Json());
  ASSERT_EQ(motion["other_tools"].size(), 1u);
  const Json& right = motion["other_tools"][0];
  EXPECT_EQ(right["name"], "right");
  EXPECT_EQ(right["gripper"][0], 0.5);
  EXPECT_EQ(right["gripper"].size(), motion["t_s"].size());
  EXPECT_NEAR(right["off_target_mm"], 20.0, 1e-9);
  EXPECT_EQ(motion["off_target_mm"], 0.0);
  EXPECT_EQ(right["liquid"]["spilled"].back(), 1);
  EXPECT_EQ(motion["liquid"]["spilled"].back(), 0);
}

}  // namespace
}  // namespace steadyhand

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "sample_run.hpp"
#include "steadyhand/report/figures/motion.hpp"
#include "steadyhand/report/figures/page_data.hpp"
#include "steadyhand/report/figures/session_story.hpp"
#include "support/temporary_folder.hpp"

/// The data of the page; tests/python/test_report.py opens it in a browser.
namespace steadyhand {
namespace {

using Json = nlohmann::json;

std::string write_and_read(const ReportInput& input) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "report.html";
  const Status status = write_report(input, path);
  EXPECT_TRUE(status) << status.error().message;
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(PageData, HoldsEveryCurveAtItsLength) {
  const ReportInput input = test::sample_input();
  const Thinning thinning = choose_thinning(input);
  EXPECT_EQ(thinning.steps_per_point, 1);
  const Json data = Json::parse(page_data(input, thinning));
  EXPECT_EQ(data["targets"].size(), 1u);  // the same for all profiles
  ASSERT_EQ(data["profiles"].size(), 3u);
  for (const Json& profile : data["profiles"]) {
    for (const char* name : {"t", "x", "y", "z", "roll", "pitch", "yaw", "lateral", "vertical", "position_error",
                             "orientation_error", "solve_time", "iterations", "distance"}) {
      EXPECT_EQ(profile[name].size(), 220u) << name;
    }
    ASSERT_EQ(profile["shares"].size(), 6u);
    for (const Json& share : profile["shares"]) EXPECT_EQ(share.size(), 220u);
    ASSERT_EQ(profile["speeds"]["percent"].size(), 6u);
    for (const Json& joint : profile["speeds"]["percent"]) EXPECT_EQ(joint.size(), profile["speeds"]["t"].size());
    EXPECT_LE(profile["speeds"]["t"].size(), 3000u);
    EXPECT_EQ(profile["failures"].size(), 1u);
  }
}

TEST(PageData, NamesJointsAndTermsInWordsAndKeepsTheirNames) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  RunNames& names = input.profiles[0].names;
  names.joints = {"shoulder_pan_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "slide_joint", "slide_link"};
  const Json profile = Json::parse(page_data(input, {}))["profiles"][0];
  EXPECT_EQ(profile["joints"],
            Json({"shoulder pan", "elbow", "wrist 1", "wrist 2", "slide_joint", "slide_link"}));  // two of one name
  EXPECT_EQ(profile["joint_names"], Json(names.joints));
  EXPECT_EQ(profile["term_names"], Json(names.terms));
  ASSERT_EQ(profile["terms"].size(), names.terms.size());
  for (std::size_t i = 0; i < names.terms.size(); ++i) EXPECT_EQ(profile["terms"][i], term_text(names.terms[i]));
}

TEST(PageData, HasWeightsByName) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  input.profiles[0].weights = {{"acceleration_step", {0.001, 0.001}}, {"posture", {1, 1, 2e-3}}};
  EXPECT_EQ(
      Json::parse(page_data(input, {}))["profiles"][0]["weights"],
      Json::parse(R"([{"name": "acceleration_step", "text": "0.001"}, {"name": "posture", "text": "1 1 0.002"}])"));
}

TEST(PageData, ThinningKeepsTheWorst) {
  ReportInput input = test::sample_input();
  input.profiles = {test::sample_profile("long", "Long", 0.1, 0.5, 3000, 4, 60, 200)};
  const ProfileResult& profile = input.profiles[0];
  const Thinning thinning = choose_thinning(input);
  ASSERT_GT(thinning.steps_per_point, 1);
  ASSERT_GT(thinning.commands_per_point, 1);
  const Json data = Json::parse(page_data(input, thinning))["profiles"][0];
  EXPECT_LE(data["t"].size(), 4000u);

  const Metrics metrics = evaluate(profile.steps, profile.commands, profile.limits);
  double speed = 0, speed_on_page = 0;
  for (const JointCommand& c : profile.commands)
    speed = std::max(speed, largest_ratio(c.dq, profile.limits.velocity_max));
  const auto largest = [](const Json& curve) { return std::max_element(curve.begin(), curve.end())->get<double>(); };
  for (const Json& joint : data["speeds"]["percent"]) speed_on_page = std::max(speed_on_page, largest(joint));
  const double smallest_distance = *std::min_element(data["distance"].begin(), data["distance"].end());
  constexpr double kRounding = 1e-5;  // the page has six figures
  EXPECT_NEAR(largest(data["solve_time"]) / (1e-3 * metrics.solve_max), 1, kRounding);
  EXPECT_NEAR(largest(data["position_error"]) / (1e3 * metrics.tools[0].position_max), 1, kRounding);
  EXPECT_NEAR(smallest_distance / (1e3 * metrics.smallest_distance), 1, kRounding);
  EXPECT_NEAR(speed_on_page / (100 * speed), 1, kRounding);
}

TEST(PageData, TheTailEndsWithTheSlowestStep) {
  for (const double duration : {0.05, 1.0, 20.0, 300.0}) {
    ReportInput input = test::sample_input();
    input.profiles = {test::sample_profile("p", "P", 0.1, 0.5, 3000, 5, duration)};
    const Json tail = Json::parse(page_data(input, choose_thinning(input)))["profiles"][0]["tail"];
    const double steps = static_cast<double>(input.profiles[0].steps.size());
    ASSERT_EQ(tail["ms"].size(), tail["percent"].size());
    EXPECT_EQ(tail["percent"].front(), 100);
    EXPECT_NEAR(tail["percent"].back(), 100 / steps, 1e-3);
    EXPECT_TRUE(std::is_sorted(tail["ms"].begin(), tail["ms"].end()));
    EXPECT_TRUE(std::is_sorted(tail["percent"].rbegin(), tail["percent"].rend()));
  }
}

TEST(PageData, RollBreaksWhereItPassesHalfATurn) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  for (PlanStep& step : input.profiles[0].steps) {
    step.tools[0].X_base_planned.q = Eigen::AngleAxisd(step.t_s, Vector3::UnitX());  // to 10.95 rad: past pi and 3 pi
  }
  const Json roll = Json::parse(page_data(input, {}))["profiles"][0]["roll"];
  int breaks = 0;
  for (std::size_t k = 0; k < 220; ++k) {
    if (roll[k].is_null()) {
      ++breaks;
      continue;
    }
    const double expected = std::remainder(input.profiles[0].steps[k].t_s, 2 * std::numbers::pi);
    EXPECT_NEAR(roll[k], expected * 180 / std::numbers::pi, 1e-3);
    if (k > 0 && roll[k - 1].is_number()) {
      EXPECT_LT(std::abs(roll[k].get<double>() - roll[k - 1].get<double>()), 180);
    }
  }
  EXPECT_EQ(breaks, 2);
}

TEST(PageData, ABreakOfRollOutlivesThinning) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  for (PlanStep& step : input.profiles[0].steps) {
    step.tools[0].X_base_planned.q = Eigen::AngleAxisd(step.t_s, Vector3::UnitX());
  }
  const Json roll =
      Json::parse(page_data(input, {.steps_per_point = 4, .commands_per_point = 1}))["profiles"][0]["roll"];
  EXPECT_EQ(std::count_if(roll.begin(), roll.end(), [](const Json& angle) { return angle.is_null(); }), 2);
}

TEST(PageData, NobodyIsOffFromATargetThatNobodyLeads) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  std::vector<PlanStep>& steps = input.profiles[0].steps;
  for (std::size_t i = 100; i < steps.size(); ++i) {
    steps[i].tools[0].engaged = false;
    steps[i].tools[0].X_base_target.p.x() += 5.0;
  }
  const Json data = Json::parse(page_data(input, {}))["profiles"][0];
  for (const char* name : {"position_error", "orientation_error"}) {
    EXPECT_TRUE(data[name][99].is_number());
    EXPECT_TRUE(data[name][100].is_null());
  }
}

/// The row of the comparison with this label; null: there is none.
Json row(const ReportInput& input, const std::string& label) {
  const Json figures = Json::parse(page_data(input, {}))["figures"];
  for (const Json& each : figures) {
    if (each["label"] == label) return each;
  }
  return {};
}

TEST(PageData, HasSpillsWhereTheyAreKnown) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  EXPECT_TRUE(row(input, "Spills").is_null());
  EXPECT_TRUE(Json::parse(page_data(input, {}))["profiles"][0]["metrics"]["spills"].is_null());
  input.profiles[0].liquids[0].spills = 1;
  input.profiles[0].liquids[0].spilled_share = 0.744;
  EXPECT_EQ(row(input, "Spilled at once, most")["texts"], Json::array({"74.4"}));
  EXPECT_EQ(Json::parse(page_data(input, {}))["profiles"][0]["metrics"]["spilled_share"], 0.744);
  input.profiles[0].liquids[0].spilled_share = 1e-4;
  EXPECT_EQ(row(input, "Spilled at once, most")["texts"], Json::array({"< 0.1"}));
}

/// 6 in half a minute are more than 7 in three minutes: a longer engaged time must not count against a profile.
TEST(PageData, CallsNoCountOfSpillsBestButThatPerMinute) {
  ReportInput input = test::sample_input();
  input.profiles.resize(2);
  input.profiles[0].liquids[0].spills = 7;
  input.profiles[0].led_s = 180.0;
  input.profiles[1].liquids[0].spills = 6;
  input.profiles[1].led_s = 30.0;
  EXPECT_EQ(row(input, "Spills")["texts"], Json::array({"7", "6"}));
  EXPECT_EQ(row(input, "Spills")["best"], -1);
  EXPECT_EQ(row(input, "Spills per minute engaged")["texts"], Json::array({"2.33", "12.00"}));
  EXPECT_EQ(row(input, "Spills per minute engaged")["best"], 0);
}

/// Two steps are soon done well.
TEST(PageData, CallsNothingBestThatLedForAMomentOnly) {
  ReportInput input = test::sample_input();
  input.profiles.resize(2);
  const auto some_best = [&] {
    const Json rows = Json::parse(page_data(input, {}))["figures"];
    return std::any_of(rows.begin(), rows.end(), [](const Json& each) { return each["best"] != -1; });
  };
  EXPECT_TRUE(some_best());
  input.profiles[1].steps.resize(2);
  EXPECT_FALSE(some_best());
}

TEST(PageData, HasOfASessionWhatTheReplayIsMadeOf) {
  ReportInput input = test::sample_input();
  EXPECT_FALSE(Json::parse(page_data(input, {})).contains("session"));
  input.story.emplace();
  EXPECT_TRUE(Json::parse(page_data(input, {}))["session"]["motion"].is_null());
  input.begin_s = 123456.7891;
  input.motion = R"({"name":"<b>"})";
  const Json session = Json::parse(page_data(input, {}))["session"];
  EXPECT_EQ(session["zero_s"], 123456.7891) << "of a program that ran for days";
  EXPECT_EQ(session["motion"]["name"], "<b>");
}

TEST(Motion, TheWorstOutlivesThinning) {
  SessionFile session;
  session.name = "long";
  for (int i = 0; i < 30000; ++i) {
    const Time at = from_seconds(0.01 * i);
    LiquidState liquid;
    liquid.freeboard = 0.03;
    liquid.spilled_share = i > 5001 ? 0.25 : 0.0;
    session.liquids[0].states.emplace_back(at, liquid);
    session.liquids[0].waves.push_back({at, i == 5001 ? -0.0015 : 0.03, 0.0});
    session.liquids[0].felt.push_back({at, 2.0, i == 7003 ? 9.5 : 1.0, 2});
    PlanStep step;
    step.t_s = 0.01 * i;
    step.tools[0].engaged = true;
    step.tools[0].X_base_target.p.x() = i == 9001 ? 0.05 : 0.0;
    session.steps.push_back(step);
  }
  const Json all = Json::parse(motion_json(session, 0.0)), motion = Json::parse(motion_json(session, 0.0, 9000));
  const auto largest = [](const Json& values) { return *std::max_element(values.begin(), values.end()); };
  EXPECT_EQ(all["felt"]["t_s"].size(), 30000u);
  for (const char* name : {"felt", "liquid", "target"}) EXPECT_LE(motion[name]["t_s"].size(), 9000u) << name;
  const Json& freeboard = motion["liquid"]["freeboard_mm"];
  EXPECT_EQ(*std::min_element(freeboard.begin(), freeboard.end()), -1.5);
  EXPECT_EQ(motion["liquid"]["spilled_share"].front(), 0.0);
  EXPECT_EQ(motion["liquid"]["spilled_share"].back(), 0.25);
  EXPECT_EQ(largest(motion["felt"]["largest"]), 9.5);
  EXPECT_EQ(motion["felt"]["mean"].front(), 1.0);
  EXPECT_EQ(motion["felt"]["count"].front(), 8);
  EXPECT_EQ(largest(motion["target"]["error_mm"]), 50.0);
}

TEST(PageData, TargetsOfTheirOwnAreShown) {
  ReportInput input = test::sample_input();
  input.profiles[2].steps.back().tools[0].X_base_target.p.y() += 0.01;
  const Json targets = Json::parse(page_data(input, {}))["targets"];
  ASSERT_EQ(targets.size(), 2u);
  EXPECT_EQ(targets[1]["label"], "target of P3 waiter");
}

TEST(Page, NamesCannotBreakOut) {
  ReportInput input = test::sample_input();
  const std::string hostile = "</script><script>alert(\"1\")</script>{{data}}";
  input.recording = input.command = input.profiles[1].label = hostile;
  input.profiles[1].weights = {{hostile, {1.0}}};
  input.profiles[1].names.terms[0] = hostile;
  const std::string page = write_and_read(input);
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_EQ(Json::parse(page_data(input, {}))["recording"], hostile);
}

TEST(Page, WorksForOneProfileWithoutCommands) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  input.profiles[0].commands.clear();
  input.profiles[0].steps.resize(1);
  const std::string page = write_and_read(input);
  EXPECT_NE(page.find("</html>"), std::string::npos);
}

TEST(Page, RefusesWhatCannotBeReported) {
  ReportInput input = test::sample_input();
  const Status nowhere = write_report(input, "/nowhere/report.html");
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().message.find("/nowhere/report.html"), std::string::npos);
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_FALSE(write_report(input, "/dev/full"));
  }

  const TemporaryFolder folder;
  input.profiles[1].steps.clear();
  const Status empty = write_report(input, folder.path() / "report.html");
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().message.find("anti-slosh"), std::string::npos);
  input.profiles.clear();
  EXPECT_FALSE(write_report(input, folder.path() / "report.html"));
}

}  // namespace
}  // namespace steadyhand

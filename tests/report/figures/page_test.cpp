#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "sample_run.hpp"
#include "steadyhand/report/figures/page_data.hpp"
#include "steadyhand/report/figures/session_story.hpp"
#include "support/temporary_folder.hpp"

/// What the page is made of; tests/python/test_report.py opens it in a browser.
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

TEST(Page, SaysWeightsInWordsWithTheirNamesToBeLookedUp) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  input.profiles[0].weights = {{"acceleration_step", {0.001, 0.001}}, {"lateral", {0.4}}, {"posture", {1, 1, 2e-3}}};
  EXPECT_NE(write_and_read(input).find(R"(<span title="acceleration_step">acceleration step</span> 0.001, )"
                                       R"(<span title="lateral">lateral</span> 0.4, )"
                                       R"(<span title="posture">posture</span> 1 1 0.002</p>)"),
            std::string::npos);
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
  EXPECT_NEAR(largest(data["position_error"]) / (1e3 * metrics.position_max), 1, kRounding);
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
    step.X_base_planned.q = Eigen::AngleAxisd(step.t_s, Vector3::UnitX());  // to 10.95 rad: past pi and 3 pi
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
    step.X_base_planned.q = Eigen::AngleAxisd(step.t_s, Vector3::UnitX());
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
    steps[i].engaged = false;
    steps[i].X_base_target.p.x() += 5.0;
  }
  const Json data = Json::parse(page_data(input, {}))["profiles"][0];
  for (const char* name : {"position_error", "orientation_error"}) {
    EXPECT_TRUE(data[name][99].is_number());
    EXPECT_TRUE(data[name][100].is_null());
  }
}

TEST(Page, SaysFirstWhetherTheGlassKeptItsLiquid) {
  ReportInput input = test::sample_input();
  EXPECT_EQ(write_and_read(input).find("class=\"verdict"), std::string::npos);  // nobody knows
  EXPECT_EQ(write_and_read(input).find("Spills"), std::string::npos);
  input.recording = "2026-11-25_15-20-10";
  input.profiles.resize(1);
  input.profiles[0].spills = 0;
  input.story.emplace();
  input.story->end_s = 11.0;
  input.story->knows_liquid = true;
  std::string page = write_and_read(input);
  EXPECT_NE(page.find("<h1 data-recording=\"2026-11-25_15-20-10\">25 November 2026, 15:20:10</h1>"), std::string::npos);
  EXPECT_NE(page.find("Nothing spilled."), std::string::npos);
  input.recorded = "2026-11-25_16-00-00 UTC";
  EXPECT_NE(write_and_read(input).find(">25 November 2026, 16:00:00</h1>"), std::string::npos);
  input.recorded.clear();
  input.title = "a <label>";
  input.profiles[0].spills = 1;
  input.profiles[0].spilled_share = 0.744;
  input.story->spills = {{2.1, 0.744, 12.6, "Tracking does not keep the liquid in"}};
  page = write_and_read(input);
  EXPECT_NE(page.find("a &lt;label&gt;, 25 November 2026, 15:20:10</h1>"), std::string::npos);
  EXPECT_NE(page.find("Spilled once."), std::string::npos);
  EXPECT_NE(page.find("<b>74.4 %</b> <a href=\"#t=2.100\">at 0:02.10</a>: Tracking does not keep"), std::string::npos);
  EXPECT_NE(page.find("<td>74.4</td>"), std::string::npos);
  EXPECT_NE(page.find("<dt>spilled</dt><dd><b>once, 74.4</b>"), std::string::npos);
  input.recording = "renamed";
  EXPECT_NE(write_and_read(input).find(">a &lt;label&gt;</h1>"), std::string::npos);
  input.recorded = "2026-11-26_01-02-03 UTC";
  input.scales = "0.5, 1";
  input.profiles[0].spills = 2;
  input.profiles[0].spilled_share = 1e-4;
  page = write_and_read(input);
  EXPECT_NE(page.find(">a &lt;label&gt;, 26 November 2026, 01:02:03 UTC</h1>"), std::string::npos);
  EXPECT_NE(page.find("<dt>scale of the hand</dt><dd>0.5, 1</dd>"), std::string::npos);
  EXPECT_NE(page.find("<dt>spilled</dt><dd><b>2 ×, each less than 0.1</b>"), std::string::npos);
  EXPECT_NE(page.find("<td>&lt; 0.1</td>"), std::string::npos);
}

TEST(Page, CallsAGripperNoGlass) {
  ReportInput input = test::sample_input();
  input.story.emplace();
  EXPECT_NE(write_and_read(input).find("Motion of the glass</h2>"), std::string::npos);
  EXPECT_NE(write_and_read(input).find("<dt>slosh, mean</dt>"), std::string::npos);
  input.story->has_glass = false;
  const std::string page = write_and_read(input);
  EXPECT_NE(page.find("Motion of the gripper</h2>"), std::string::npos);
  EXPECT_NE(page.find("<table data-group=\"Gripper\">"), std::string::npos);
  EXPECT_EQ(page.find("<dt>slosh"), std::string::npos);
  EXPECT_EQ(page.find("class=\"verdict"), std::string::npos);
}

TEST(Page, NamesTheWorstSpillsFirst) {
  ReportInput input = test::sample_input();
  input.story.emplace();
  input.story->knows_liquid = true;
  for (const double share : {0.002, 0.0001, 0.036, 1.0, 0.007, 0.006, 0.9996}) {
    input.story->spills.push_back({double(input.story->spills.size()), share, 0.0, "because"});
  }
  const std::string page = write_and_read(input), verdict = page.substr(page.find("<div class=\"verdict"));
  std::size_t before = 0;
  for (const char* told : {">Spilled 7 times.", "<b>100 %</b> <a href=\"#t=3.000\">",
                           "<b>100 %</b> <a href=\"#t=6.000\">", "<b>3.6 %</b>", "<b>0.7 %</b>", "<b>0.6 %</b>",
                           "<summary>2 more, of at most 0.2 %</summary>", "<b>0.2 %</b>", "<b>less than 0.1 %</b>"}) {
    const std::size_t at = verdict.find(told);
    ASSERT_NE(at, std::string::npos) << told;
    EXPECT_GT(at, before) << told;
    before = at;
  }
  input.story->spills = {{1.0, 0.036, 0.0, "because"}, {2.0, 0.0001, 0.0, "because"}};
  EXPECT_NE(write_and_read(input).find("<summary>1 more, of less than 0.1 %</summary><ul>\n<li><b>less than 0.1 %</b>"),
            std::string::npos);
  input.story->spills = {{2.0, 0.0001, 0.0, "because"}};
  EXPECT_NE(write_and_read(input).find("<b>less than 0.1 %</b>"), std::string::npos);
}

/// 6 in half a minute are more than 7 in three: who led longer did not do worse for it.
TEST(Page, CallsNoCountOfSpillsBestButThatPerMinute) {
  ReportInput input = test::sample_input();
  input.profiles.resize(2);
  input.profiles[0].spills = 7;
  input.profiles[0].led_s = 180.0;
  input.profiles[1].spills = 6;
  input.profiles[1].led_s = 30.0;
  input.story.emplace();
  const std::string page = write_and_read(input);
  EXPECT_NE(page.find("Spills</th><td>7</td><td>6</td>"), std::string::npos);
  EXPECT_NE(
      page.find(
          "Spills per minute led</th><td class=\"best\">2.33<span class=\"hidden\"> (best)</span></td><td>12.00</td>"),
      std::string::npos);
  EXPECT_NE(page.find("<dt>spills per minute led</dt><dd><b>12.00</b>"), std::string::npos);
}

/// Two steps are soon done well.
TEST(Page, CallsNothingBestThatLedForAMomentOnly) {
  ReportInput input = test::sample_input();
  input.profiles.resize(2);
  EXPECT_NE(write_and_read(input).find("class=\"best\""), std::string::npos);
  EXPECT_NE(write_and_read(input).find("Bold: the best"), std::string::npos);
  input.profiles[1].steps.resize(2);
  EXPECT_EQ(write_and_read(input).find("class=\"best\""), std::string::npos);
  EXPECT_EQ(write_and_read(input).find("Bold: the best"), std::string::npos);
}

TEST(PageData, TheCrestThatCameNearestToTheRimOutlivesThinning) {
  ReportInput input = test::sample_input();
  input.story.emplace();
  EXPECT_TRUE(Json::parse(page_data(input, {}))["story"]["wave"]["t"].empty());
  for (int i = 0; i < 30000; ++i)
    input.story->waves.push_back({0.01 * i, i == 5001 ? -1.5 : 30.0, i > 5001 ? 0.25 : 0.0});
  const Json wave = Json::parse(page_data(input, {}))["story"]["wave"];
  EXPECT_LE(wave["t"].size(), 12000u);
  EXPECT_EQ(*std::min_element(wave["freeboard_mm"].begin(), wave["freeboard_mm"].end()), -1.5);
  EXPECT_EQ(wave["spilled"].front(), 0.0);
  EXPECT_EQ(wave["spilled"].back(), 25.0);
}

TEST(PageData, TargetsOfTheirOwnAreShown) {
  ReportInput input = test::sample_input();
  input.profiles[2].steps.back().X_base_target.p.y() += 0.01;
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
  EXPECT_NE(page.find("{{data}}"), std::string::npos);  // as text, not filled in
  EXPECT_NE(page.find("&lt;script&gt;alert"), std::string::npos);
}

TEST(Page, WorksForOneProfileWithoutCommands) {
  ReportInput input = test::sample_input();
  input.profiles.resize(1);
  input.profiles[0].commands.clear();
  input.profiles[0].steps.resize(1);
  const std::string page = write_and_read(input);
  EXPECT_EQ(page.find("class=\"best\""), std::string::npos);
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

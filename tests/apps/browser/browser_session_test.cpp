#include "steadyhand/apps/browser/browser_session.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "steadyhand/apps/browser/closed_loop.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "support/temporary_folder.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

/// A hand that moves back and forth for ten seconds, and two profiles.
BrowserSetup some_setup() {
  BrowserSetup setup;
  setup.robot = ur5e();
  setup.profiles = {*load_profile("waiter"), *load_profile("carry")};
  NamedRecording& recording = setup.recordings.emplace_back();
  recording.name = recording.recording.name = "to and fro";
  for (int i = 0; i <= 1000; ++i) {
    OperatorSample sample;
    sample.stamp.hand = sample.stamp.made = from_seconds(0.01 * i);
    sample.X_operator_hand.p.y() = 0.2 * std::sin(0.02 * i);
    sample.clutch = true;
    recording.recording.samples.push_back(sample);
  }
  return setup;
}

/// The same with two arms, and with two hands in the recording.
BrowserSetup setup_of_two() {
  BrowserSetup setup = some_setup();
  const Result<RobotModel> model = open_robot("two_ur5e");
  EXPECT_TRUE(model) << model.error().message;
  setup.robot = *model;
  std::vector<OperatorSample> both;
  for (const OperatorSample& sample : setup.recordings[0].recording.samples) {
    both.insert(both.end(), 2, sample);
    both.back().tool = 1;
    both.back().X_operator_hand.p.z() = 1.0;
  }
  setup.recordings[0].recording.samples = both;
  return setup;
}

/// A page, as the session sees it.
class Page final : public Outbox {
 public:
  explicit Page(BrowserSession& session) : session_(&session), number_(session.join(*this, now())) {
    say(R"({"type":"hello","version":3})");
    say(R"({"type":"pair","code":"local"})");
    say(R"({"type":"take"})");
  }
  void send(std::shared_ptr<const std::string> message) override { heard.push_back(Json::parse(*message)); }
  bool send_state(std::shared_ptr<const std::string> message) override {
    state = Json::parse(*message);
    return false;
  }
  void close() override { closed = true; }
  bool of_this_user() override { return true; }

  Time now() const { return from_seconds(t); }
  void say(std::string_view text) { session_->receive(number_, text, now()); }
  void request(std::string_view kind) { say(fmt::format(R"({{"type":"request","kind":"{}"}})", kind)); }
  void record(bool on) { say(fmt::format(R"({{"type":"request","kind":"record","value":{}}})", on ? 1 : 0)); }
  /// Advances time in steps of 8 ms, together with the hands, which rise while their clutches are closed.
  void go_on(double seconds) {
    for (const double end = t + seconds; t < end; t += 0.008) {
      feed(0, grips, since_);
      if (two_hands) feed(1, second_grips, second_since_);
      session_->advance(now());
    }
  }
  bool is(const char* name) const { return state["state"] == name; }
  double fastest() const {
    double most = 0.0;
    for (const double dq : state["dq"]) most = std::max(most, std::abs(dq));
    return most;
  }

  double t = 5000.0;  ///< s, of the browser's clock
  bool grips = false, second_grips = false, two_hands = false, closed = false;
  std::vector<Json> heard;
  Json state;

 private:
  void feed(int tool, bool clutch, double& since) {
    if (!clutch) since = t;
    say(fmt::format(R"({{"type":"sample","sequence":{},"t_s":{},"p":[0,0,{}],"q":[0,0,0,1],"clutch":{},)"
                    R"("tracked":true,"emulated":false,"tool":{}}})",
                    ++sequence_, t, 0.1 * (t - since), clutch, tool));
  }

  BrowserSession* session_;
  double since_ = t, second_since_ = t;
  std::uint64_t sequence_ = 0;
  std::uint64_t number_;
};

std::unique_ptr<BrowserSession> make_session(BrowserSetup setup) {
  auto session = BrowserSession::make(std::move(setup), {}, 50.0);
  EXPECT_TRUE(session) << session.error().message;
  return *std::move(session);
}

TEST(SetupJson, IsReadBackToTheLastDigit) {
  const std::string text = setup_json(some_setup());
  const Result<BrowserSetup> read = read_setup_json(text);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(setup_json(*read), text);
  EXPECT_EQ(read->robot.link_names, ur5e().link_names);
  EXPECT_EQ(read->robot.position_max, ur5e().position_max);
  EXPECT_TRUE(read->profiles[1].ocp.liquid.has_value());
}

TEST(SetupJson, HasTheToolOfEachHand) {
  const Result<BrowserSetup> read = read_setup_json(setup_json(setup_of_two()));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->robot.tool_count(), 2);
  EXPECT_EQ(read->recordings[0].recording.samples[1].tool, 1);
}

TEST(SetupJson, RefusesWhatIsNone) {
  const std::string whole = setup_json(some_setup());
  const auto refusal = [](const std::string& text) {
    const Result<BrowserSetup> read = read_setup_json(text);
    return read ? std::string("accepted") : read.error().message;
  };
  EXPECT_NE(refusal(whole.substr(0, whole.size() / 2)).find("cut short"), std::string::npos);
  EXPECT_NE(refusal("").find("cut short"), std::string::npos);
  EXPECT_NE(refusal("[]").find("no JSON object"), std::string::npos);
  const auto changed = [&](const char* pointer, const Json& value) {
    Json json = Json::parse(whole);
    json[Json::json_pointer(pointer)] = value;
    return refusal(json.dump());
  };
  EXPECT_NE(changed("/robot/home", Json::array({1, 2})).find("home must be 6 finite numbers"), std::string::npos);
  EXPECT_NE(changed("/robot/joints/0/origin/0/0", 2.0).find("robot: 'joints[0]': 'origin' is no pose"),
            std::string::npos);
  EXPECT_NE(changed("/robot/pairs/0/1", 1e9).find("robot: 'pairs[0][1]' must be a whole number"), std::string::npos);
  EXPECT_NE(changed("/robot/velocity_max/0", -1.0).find("robot: "), std::string::npos);
  EXPECT_NE(changed("/profiles/0/prediction", "clairvoyant").find("clairvoyant"), std::string::npos);
  EXPECT_NE(changed("/profile", 7).find("there are 2 profiles"), std::string::npos);
  EXPECT_NE(changed("/recordings/0/samples", Json::array()).find("recordings[0].samples"), std::string::npos);
  EXPECT_NE(changed("/recordings/0/samples/0/9", 1e300).find("must be of tools 0 to 1"), std::string::npos);
}

TEST(BrowserSession, TwoHandsMoveTwoArms) {
  const auto session = make_session(setup_of_two());
  for (int i = 0; i <= 40; ++i) session->advance(from_seconds(4996.0 + 0.1 * i));
  for (const ToolSnapshot& tool : session->session().snapshot().tools) {
    EXPECT_EQ(tool.state, SupervisionState::kEngaged) << tool.reason;
    EXPECT_EQ(tool.target.leader, Leader::kRecording);
  }
  Page page(*session);
  page.two_hands = true;
  page.go_on(2.0);
  ASSERT_TRUE(page.is("ready")) << page.state["reason"];
  ASSERT_EQ(page.state["tools"].size(), 2u);
  EXPECT_EQ(page.heard.front()["robot"]["tools"][1]["name"], "right");
  const auto is = [&](int tool, const char* state) { return page.state["tools"][tool]["state"] == state; };
  const auto height = [&](int tool) { return page.state["tools"][tool]["pose"]["p"][2].get<double>(); };
  const double before[] = {height(0), height(1)};
  page.second_grips = true;
  page.go_on(2.0);
  EXPECT_TRUE(page.is("engaged") && is(0, "ready") && is(1, "engaged")) << page.state["tools"][1]["reason"];
  EXPECT_NEAR(height(0), before[0], 1e-6);
  EXPECT_GT(height(1), before[1] + 0.02);
  page.grips = true;
  page.go_on(2.0);
  EXPECT_TRUE(is(0, "engaged") && is(1, "engaged")) << page.state["tools"][0]["reason"];
  EXPECT_GT(height(0), before[0] + 0.02);
  page.second_grips = false;
  page.go_on(1.0);
  EXPECT_TRUE(page.is("engaged") && is(0, "engaged") && is(1, "ready")) << page.state["tools"][0]["reason"];
  page.request("stop");
  page.go_on(1.5);
  EXPECT_TRUE(page.is("stopping") && is(0, "stopping") && is(1, "stopping"));
  EXPECT_LT(page.fastest(), 1e-3);
}

TEST(BrowserSession, EitherToolTakesAnObject) {
  const auto session = make_session(setup_of_two());
  Page page(*session);
  page.go_on(2.0);
  for (const int tool : {0, 1}) {
    const Json at = page.state["tools"][tool]["pose"]["p"];
    page.say(fmt::format(R"({{"type":"request","kind":"object","text":"ball","object":)"
                         R"({{"shape":"sphere","radius":0.02,"p":{},"q":[0,0,0,1]}}}})",
                         at.dump()));
    page.say(fmt::format(R"({{"type":"request","kind":"attach","text":"ball","tool":{}}})", tool));
    page.go_on(0.1);
    ASSERT_EQ(page.heard.back()["type"], "cell") << page.heard.back();
    const Json& ball = page.heard.back()["cell"]["objects"].back();
    EXPECT_TRUE(ball["attached"].get<bool>()) << ball;
    EXPECT_EQ(ball.value("tool", 0), tool) << ball;
    for (int row = 0; row < 3; ++row) EXPECT_NEAR(ball["origin"][row][3].get<double>(), 0.0, 0.01) << ball;
    page.say(R"({"type":"request","kind":"detach","text":"ball"})");
  }
}

TEST(BrowserSession, IsLedStoppedAndResetByItsPage) {
  const auto session = make_session(some_setup());
  Page page(*session);
  page.go_on(0.5);
  ASSERT_EQ(page.heard.front()["type"], "welcome");
  EXPECT_EQ(page.heard.front()["robot"]["name"], "ur5e");
  EXPECT_EQ(page.state["controls"]["playback"], -1) << "who takes the lease ends the recording";
  const double height = page.state["tools"][0]["pose"]["p"][2];
  page.grips = true;
  page.go_on(2.0);
  EXPECT_TRUE(page.is("engaged")) << page.state["state"];
  EXPECT_GT(page.state["tools"][0]["pose"]["p"][2].get<double>(), height + 0.02);
  page.request("stop");
  page.go_on(1.5);
  EXPECT_TRUE(page.is("stopping"));
  EXPECT_LT(page.fastest(), 1e-3);
  page.grips = false;
  page.request("reset");
  page.go_on(0.3);
  EXPECT_TRUE(page.is("ready")) << page.state["state"];
  EXPECT_FALSE(page.closed);
}

TEST(BrowserSession, OfALongPauseTheRestDidNotHappen) {
  const auto session = make_session(some_setup());
  Page page(*session);
  page.go_on(0.5);
  page.grips = true;
  page.go_on(1.0);
  ASSERT_TRUE(page.is("engaged"));
  const double before = page.state["now_s"];
  page.t += 3600.0;  // the tab was frozen
  page.go_on(0.05);
  EXPECT_LT(page.state["now_s"].get<double>(), before + 0.4) << "the session's clock stood still";
  EXPECT_EQ(session->pauses(), 1u);
  EXPECT_NEAR(to_seconds(session->left_out()), 3599.8, 0.1);
  page.go_on(1.5);
  EXPECT_TRUE(page.is("ready")) << "the grip of before counts no longer: " << page.state["state"];
  EXPECT_LT(page.fastest(), 1e-3);
  page.grips = false;
  page.go_on(0.2);
  page.grips = true;
  page.go_on(0.5);
  EXPECT_TRUE(page.is("engaged")) << "a fresh grip leads on: " << page.state["reason"];
}

TEST(BrowserSession, WhatItRecordsIsAFileOnceItIsPutTogether) {
  std::map<std::string, std::string> kept;
  std::map<std::string, int> ends;
  auto made = BrowserSession::make(some_setup(), {}, 50.0, [&](std::string_view name, std::string_view bytes) {
    kept[std::string(name)] += bytes;
    ends[std::string(name)] += bytes.empty();
  });
  ASSERT_TRUE(made) << made.error().message;
  const std::unique_ptr<BrowserSession> session = *std::move(made);
  Page page(*session);
  page.go_on(0.5);
  EXPECT_TRUE(kept.empty()) << "nobody has asked for it";
  for (int i = 0; i < 2; ++i) {
    page.record(true);
    page.grips = true;
    page.go_on(2.0);
    EXPECT_EQ(page.state["recording"], true);
    page.record(false);
    page.grips = false;
    page.go_on(0.5);
    EXPECT_EQ(page.state["recording"], false);
  }
  ASSERT_EQ(kept.size(), 2u);
  for (const auto& [name, bytes] : kept) {
    EXPECT_EQ(ends[name], 1);
    const TemporaryFolder folder;
    SessionParts parts;
    parts.commands = parts.samples = parts.changes = parts.settings = parts.cells = true;
    const Result<SessionFile> file = load_session(folder.write(name + ".mcap", bytes), parts);
    ASSERT_TRUE(file) << file.error().message;
    EXPECT_TRUE(file->overview.complete);
    EXPECT_NEAR(file->commands.size(), 1000, 20);
    EXPECT_GT(file->samples.size(), 200u);
    EXPECT_EQ(file->overview.metadata.at("run").at("profile"), "waiter");
    EXPECT_EQ(file->overview.metadata.at("profiles").size(), 2u);
    EXPECT_GT(std::stod(file->overview.metadata.at("summary").at("engaged_s")), 1.5);
  }
}

TEST(BrowserSession, RecordsNothingWhereNobodyKeepsIt) {
  const auto session = make_session(some_setup());
  Page page(*session);
  page.record(true);
  page.go_on(0.2);
  EXPECT_EQ(page.state["recording"], false);
  EXPECT_EQ(page.heard.back()["type"], "error");
}

TEST(BrowserSession, ARecordedHandGoesOnAfterAHiccupOnly) {
  const auto session = make_session(some_setup());
  Page page(*session);
  page.say(R"({"type":"request","kind":"playback","text":"to and fro"})");
  page.go_on(1.5);
  ASSERT_TRUE(page.is("engaged")) << page.state["reason"];
  page.t += 0.6;
  page.go_on(0.3);
  EXPECT_EQ(page.state["controls"]["playback"], 0);
  EXPECT_TRUE(page.is("engaged")) << page.state["reason"];
  page.t += 1.0;
  page.go_on(1.5);
  EXPECT_EQ(page.state["controls"]["playback"], -1);
  EXPECT_LT(page.fastest(), 1e-3);
}

/// Timers of a hidden tab may fire only once a second.
TEST(BrowserSession, AThrottledTabLeavesTheArmAtRestAndGoesOn) {
  const auto session = make_session(some_setup());
  Page page(*session);
  page.go_on(0.5);
  page.grips = true;
  page.go_on(1.0);
  ASSERT_TRUE(page.is("engaged"));
  for (int i = 0; i < 10; ++i) {
    page.t += 1.0;
    session->advance(page.now());
  }
  EXPECT_FALSE(page.is("engaged"));
  EXPECT_LT(page.fastest(), 1e-3);
  page.grips = false;
  page.go_on(0.5);
  page.say(R"({"type":"take"})");
  page.grips = true;
  page.go_on(0.7);
  EXPECT_TRUE(page.is("engaged")) << page.state["reason"];
}

TEST(BrowserSession, ADeviceThatBecameSlowPlansMoreSeldomAndKeepsItsClock) {
  Time planning{0};
  auto session = BrowserSession::make(some_setup(), [&] { return planning += std::chrono::milliseconds(8); }, 50.0);
  ASSERT_TRUE(session) << session.error().message;
  Page page(**session);
  page.go_on(0.5);
  page.grips = true;
  page.go_on(0.5);
  const auto plans = [&] { return (*session)->session().snapshot().plans; };
  const std::uint64_t before = plans();
  planning = Time(0);
  page.go_on(2.0);
  ASSERT_GT(plans(), before);
  EXPECT_GT(to_seconds(planning) / static_cast<double>(plans() - before), 0.02) << "a plan takes more than a period";
  EXPECT_LT(to_seconds(planning), 1.5) << "of two seconds";
  EXPECT_TRUE(page.is("engaged")) << page.state["reason"];
}

TEST(BrowserSession, PlaysTheSameEachTime) {
  const Result<std::string> first = commands_of(some_setup(), 2.5), second = commands_of(some_setup(), 2.5);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(*first, *second);
  const Json commands = Json::parse(*first)["commands"];
  ASSERT_GT(commands.size(), 1000u);
  EXPECT_GT(std::abs(commands.back()[0].get<double>() - commands.front()[0].get<double>()) +
                std::abs(commands.back()[1].get<double>() - commands.front()[1].get<double>()),
            1e-3)
      << "the arm moved";
}

TEST(ClosedLoop, PlansAreFinite) {
  const Result<BrowserSetup> setup = read_setup_json(setup_json(some_setup()));  // as a page gets it
  ASSERT_TRUE(setup) << setup.error().message;
  const Result<std::string> text = closed_loop(*setup, 1, 40, [] { return Time(0); });
  ASSERT_TRUE(text) << text.error().message;
  const Json plans = Json::parse(*text)["plans"];
  ASSERT_EQ(plans.size(), 40u);
  for (const Json& plan : plans) {
    for (const Json& number : plan) ASSERT_TRUE(number.is_number());  // others are null
  }
  EXPECT_FALSE(closed_loop(some_setup(), 2, 1, [] { return Time(0); }));
}

}  // namespace
}  // namespace steadyhand

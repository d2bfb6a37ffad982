#include "steadyhand/operator/protocol/page_messages.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "steadyhand/operator/protocol/page_messages.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

std::string text_of(const std::string& name) {
  std::ifstream file(STEADYHAND_ROOT "/web/protocol/fixtures/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

Json fixtures(const std::string& name) { return Json::parse(text_of(name)); }

/// The snapshot that fixtures/server.json describes.
OperatorView fixture_view() {
  OperatorView s;
  s.now = from_seconds(81.5);
  s.state = SupervisionState::kHolding;
  s.reason = "hand not tracked";
  s.cause = {ReasonCode::kHandLost, Leader::kPerson};
  s.constraint = {ConstraintKind::kSelfCollision, 4, 27};
  s.measured.q.resize(6);
  s.measured.q << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
  s.measured.dq.setZero(6);
  s.measured.dq[5] = -1.0;
  s.measured.gripper = 0.25;
  s.command.gripper = 0.5;
  s.command.q = s.measured.q;
  s.command.q[5] = 0.5;
  s.X_base_tool.p = {0.4, 0.0, 0.5};
  s.target.X_base_tool = {{0.5, 0.0, 0.5}, Quaternion(0.8, 0.0, 0.0, 0.6)};
  s.target.engaged = true;
  s.local_acceleration = {0.25, 0.0, 9.81};
  s.tracking_error = 0.1;
  s.clearance = 0.0625;
  s.nearest = {4, 27};
  s.path_nodes = 2;
  s.path[0].p = s.X_base_tool.p;
  s.path[1].p = s.target.X_base_tool.p;
  s.prediction.nodes = 1;
  s.prediction.p[0] = {0.5, 0.25, 0.5};
  s.prediction.spread[0] = {0.03125, 0.015625};
  s.liquid = {0.125, -0.5, std::numeric_limits<double>::quiet_NaN(), true, 0.125, -0.25, 1.5};
  s.solve_us = {2000, 4000, 5000, 6000};
  s.latency_us = {12000, 21000, 22000, 23000};
  s.plans = 10;
  s.cycles = 100;
  s.missed_deadlines = 1;
  s.rejected_plans = 2;
  s.samples = 90;
  s.planner_rate_hz = 50;
  s.planner_rate_automatic = true;
  s.recording = true;
  s.task = {12.5, 0b01, 0.125, false};
  s.episode = {true, 3, 4.5, 1, 1, 2, std::nullopt};
  s.scene.things = 1;
  s.scene.thing[0].X_base_thing.p = {0.5, 0.0, 0.25};
  s.target.leader = Leader::kPolicy;
  s.controls = {1, {500.0, 3.0}, 2, 0.5, -1.5, 0.5, 0.0625, true, 0.25, -1, "cloned", true};
  return s;
}

TEST(Messages, ReadsEveryGoodFixture) {
  const Json good = fixtures("client.json")["good"];
  ASSERT_GT(good.size(), 10u);
  for (const Json& message : good) {
    const auto read = parse_client_message(message.dump());
    EXPECT_TRUE(read) << message << ": " << read.error().message;
  }
}

TEST(Messages, RefusesEveryBadFixtureAndSaysWhy) {
  const Json bad = fixtures("client.json")["bad"];
  ASSERT_GT(bad.size(), 10u);
  for (const Json& fixture : bad) {
    const auto read = parse_client_message(fixture["text"].get<std::string>());
    ASSERT_FALSE(read) << fixture;
    EXPECT_NE(read.error().message.find(fixture["says"].get<std::string>()), std::string::npos)
        << fixture << " was answered: " << read.error().message;
  }
}

TEST(Messages, KeepsWhatASampleSays) {
  const auto read = parse_client_message(
      R"({"type":"sample","sequence":7,"t_s":12.5,"p":[0.1,-0.2,1.3],"q":[0,0,0.6,0.8],"clutch":true,"tracked":false,"emulated":true})");
  ASSERT_TRUE(read);
  const auto& message = std::get<SampleMessage>(*read);
  EXPECT_EQ(message.sequence, 7u);
  EXPECT_EQ(message.t, 12.5);
  EXPECT_EQ(message.sample.X_operator_hand.p, Vector3(0.1, -0.2, 1.3));
  EXPECT_NEAR(message.sample.X_operator_hand.q.z(), 0.6, 1e-12);
  EXPECT_NEAR(message.sample.X_operator_hand.q.w(), 0.8, 1e-12);
  EXPECT_TRUE(message.sample.clutch);
  EXPECT_FALSE(message.sample.tracked);
  EXPECT_TRUE(message.sample.emulated);
  EXPECT_EQ(message.sample.look_ahead, Time(0));
}

TEST(Messages, KeepsByHowMuchADevicePredicted) {
  const auto sample = [](const std::string& more) {
    return parse_client_message(
        R"({"type":"sample","sequence":7,"t_s":12.5,"p":[0,0,0],"q":[0,0,0,1],"clutch":true,"tracked":true,"emulated":false,"lead_s":)" +
        more + "}");
  };
  ASSERT_TRUE(sample("0.025"));
  EXPECT_EQ(std::get<SampleMessage>(*sample("0.025")).sample.look_ahead, std::chrono::milliseconds(25));
  for (const char* wrong : {"-0.01", "0.2", "null"}) EXPECT_FALSE(sample(wrong)) << wrong;
}

TEST(Messages, RefusesWhatIsTooLongOrTooDeep) {
  EXPECT_FALSE(parse_client_message(std::string(kMaxClientMessage + 1, ' ')));
  EXPECT_FALSE(parse_client_message(std::string(kMaxClientMessage, '[')));
  EXPECT_FALSE(parse_client_message(std::string(1'000'000, '{')));
}

/// Notes are for people, who write as many lines as they like; they reach no terminal as they are.
TEST(Messages, NotesMayHaveLines) {
  EXPECT_TRUE(parse_client_message(R"({"type":"request","kind":"episode","text":"keep","notes":"a\nb"})"));
}

TEST(Messages, WritesTheServersFixturesByteByByte) {
  const std::string expected = text_of("server.json");
  const auto is = [&](const std::string& name, const std::string& message) {
    EXPECT_NE(expected.find(fmt::format("\"{}\": {}", name, message)), std::string::npos) << "now " << message;
  };
  ServerFacts facts;
  facts.version = "0.1.0";
  facts.cell = R"({"name":"table"})";
  facts.robot = R"({"name":"ur5e"})";
  facts.glass = {0.03125, 0.125, 0.0625};
  facts.terms = {{"near", "Near the hand", "1/(m^2 s)", 3, 1.0, 1e4, true, false},
                 {"calm", "Lateral specific force", "s^3/m^2", 1, 0.0, 20.0, false, true}};
  facts.profiles = {{"tracking", "Tracking (P1)", {500.0, 0.0}}, {"waiter", "Waiter (P3)", {500.0, 3.0}, 1}};
  facts.recordings = {"reach"};
  facts.cameras = {{"front", 320, 240, 15.0}};
  facts.task = {"carry", "Carry the glass to the mark.", 30.0, {"glass at mark"}, {"mark", "glass"}};
  is("welcome", to_json(WelcomeMessage{kProtocolVersion, 3, facts}));
  is("cell", to_json(CellMessage{{R"({"name":"table","objects":[]})"}}));
  is("cameras", to_json(CamerasMessage{{"", "film.mp4: the video ended"}}));
  is("study", to_json(StudyMessage{{R"({"text":"Reach each target."})"}}));
  is("reply", to_json(RepliedMessage{3, {R"({"key":"tlx_mental","value":12})"}}));
  is("stopped", to_json(StoppedMessage{3}));
  is("paired", to_json(PairedMessage{"k3jqz7wd5nrs9hc2vbx4mtgp6f"}));
  is("lease", to_json(LeaseMessage{3, true, false, 5, from_seconds(7.5)}));
  is("pong", to_json(PongMessage{3.25, from_seconds(81.5)}));
  is("error", to_json(ErrorMessage{Refusal::kTaken, "client 3 commands the arm now"}));
  is("state", to_json(fixture_view()));
  OperatorView idle;
  idle.local_acceleration = kGravity;
  idle.tracking_error = idle.clearance = std::numeric_limits<double>::quiet_NaN();
  is("state_idle", to_json(idle));
  ServerFacts bare;
  bare.glass = facts.glass;
  is("welcome_bare", to_json(WelcomeMessage{kProtocolVersion, 1, bare}));
  is("study_over", to_json(StudyMessage{{"null"}}));
  is("lease_free", to_json(LeaseMessage{0, false, true, 0, std::nullopt}));
}

}  // namespace
}  // namespace steadyhand

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "steadyhand/operator/protocol/page_messages.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

Json fixtures() {
  std::ifstream file(STEADYHAND_ROOT "/web/protocol/fixtures/client.json");
  return Json::parse(file);
}

TEST(Messages, ReadsEveryGoodFixture) {
  const Json all = fixtures();
  ASSERT_GT(all["good"].size(), 10u);
  for (const char* part : {"good", "beyond_schema"}) {
    for (const Json& message : all[part]) {
      const auto read = parse_client_message(message.dump());
      EXPECT_TRUE(read) << message << ": " << read.error().message;
    }
  }
}

TEST(Messages, RefusesEveryBadFixtureAndSaysWhy) {
  const Json bad = fixtures()["bad"];
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

/// Notes are for people and may have many lines; no terminal gets them unescaped.
TEST(Messages, NotesMayHaveLines) {
  EXPECT_TRUE(parse_client_message(R"({"type":"request","kind":"episode","text":"keep","notes":"a\nb"})"));
}

}  // namespace
}  // namespace steadyhand

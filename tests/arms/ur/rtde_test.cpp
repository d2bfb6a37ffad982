// The RTDE client: framing against garbage, the handshake against every answer a controller may give.
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ur/rtde_client.hpp"
#include "steadyhand/arms/ur/ur_modes.hpp"
#include "support/ur/fake_ur_controller.hpp"

namespace steadyhand {
namespace {

std::vector<std::uint8_t> bytes_of(RtdeWriter writer) {
  const auto packet = writer.packet();
  return {packet.begin(), packet.end()};
}

void feed(RtdeFramer& framer, std::span<const std::uint8_t> bytes) {
  const auto space = framer.space();
  ASSERT_GE(space.size(), bytes.size());
  std::copy(bytes.begin(), bytes.end(), space.begin());
  framer.filled(bytes.size());
}

TEST(RtdeFramer, PutsPacketsTogetherHoweverTheyArrive) {
  std::mt19937 random(1);
  std::vector<std::uint8_t> stream;
  std::vector<std::size_t> sizes;
  for (int i = 0; i < 2000; ++i) {
    RtdeWriter writer(RtdeType::kData);
    const int size = std::uniform_int_distribution(0, i % 100 == 0 ? 4000 : 80)(random);
    for (int k = 0; k < size; ++k) writer.put(static_cast<std::uint8_t>(k + i));
    const auto packet = bytes_of(writer);
    stream.insert(stream.end(), packet.begin(), packet.end());
    sizes.push_back(size);
  }
  RtdeFramer framer;
  std::size_t got = 0;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t n = std::min<std::size_t>(stream.size() - at, std::uniform_int_distribution(1, 700)(random));
    feed(framer, std::span(stream).subspan(at, n));
    at += n;
    for (RtdePacket packet; framer.next(packet); ++got) {
      ASSERT_EQ(packet.type, RtdeType::kData);
      ASSERT_EQ(packet.payload.size(), sizes[got]);
      for (std::size_t k = 0; k < sizes[got]; ++k) ASSERT_EQ(packet.payload[k], static_cast<std::uint8_t>(k + got));
    }
  }
  EXPECT_EQ(got, sizes.size());
}

TEST(RtdeFramer, TakesTheLargestPacketAndSeesASizeThatCannotBe) {
  RtdeFramer framer;
  std::vector<std::uint8_t> largest(kRtdeLargest, 7);
  largest[0] = largest[1] = 0xff;
  RtdePacket packet;
  for (int i = 0; i < 3; ++i) {
    feed(framer, largest);
    ASSERT_TRUE(framer.next(packet));
    EXPECT_EQ(packet.payload.size(), kRtdeLargest - kRtdeHeader);
  }
  const std::uint8_t impossible[] = {0, 2, 'U', 0, 3, 'U'};
  feed(framer, impossible);
  EXPECT_FALSE(framer.next(packet));
  EXPECT_TRUE(framer.broken());
  EXPECT_FALSE(framer.next(packet));
}

/// A controller in this process, whose sockets are served while a client shakes hands.
class Handshake : public testing::Test {
 protected:
  Handshake() : random(3), model(random_arm(6, random, false)) { model.home = random_joints(6, 1.0, random); }

  Result<std::unique_ptr<RtdeClient>> connect(const RtdeRecipes& wanted, FakeUrController::Settings settings = {}) {
    if (!controller) controller = std::make_unique<FakeUrController>(model, settings);
    auto ends = Socket::pair();
    EXPECT_TRUE(ends);
    controller->accept_rtde(std::move(ends->second));
    std::atomic<bool> connecting{true};
    std::thread pump([&] {
      while (connecting) {
        controller->serve();
        std::this_thread::yield();
      }
    });
    auto client = RtdeClient::start(std::move(ends->first), wanted, std::chrono::seconds(60));
    connecting = false;
    pump.join();
    return client;
  }

  std::mt19937 random;
  RobotModel model;
  std::unique_ptr<FakeUrController> controller;
  const RtdeRecipes recipes{{{"timestamp", "DOUBLE", {}}, {"input_int_register_47", "INT32", {}}},
                            {{"input_int_register_47", "INT32", {}}},
                            2};
};

TEST_F(Handshake, StreamsBothWaysInBothVersions) {
  for (const int version : {2, 1}) {
    controller.reset();
    FakeUrController::Settings settings;
    settings.newest_protocol = version;
    auto client = connect(recipes, settings);
    ASSERT_TRUE(client) << client.error().message;
    EXPECT_EQ((*client)->protocol(), version);
    EXPECT_EQ((*client)->controller().major, 5u);
    EXPECT_EQ((*client)->rate_hz(), version == 2 ? 500.0 : 125.0);
    int packages = 0;
    std::int32_t echo = 0;
    for (int cycle = 1; cycle <= 500; ++cycle) {
      controller->step();
      while ((*client)->fill() == Socket::Outcome::kDone) {
      }
      for (RtdeReader data({}); (*client)->next(data); ++packages) {
        EXPECT_NEAR(data.take<double>(), cycle * 0.002, 1e-9);
        echo = data.take<std::int32_t>();
        EXPECT_EQ(data.left(), 0u);
      }
      RtdeWriter input = (*client)->input();
      input.put(std::int32_t{cycle});
      EXPECT_TRUE((*client)->send(input));
    }
    EXPECT_NEAR(packages, version == 2 ? 500 : 125, 1);
    EXPECT_GT(echo, 490);
  }
}

TEST_F(Handshake, SaysWhatTheControllerDoesNotHave) {
  RtdeRecipes wrong = recipes;
  wrong.outputs.push_back({"actual_happiness", "DOUBLE", {}});
  const auto missing = connect(wrong);
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("actual_happiness"), std::string::npos) << missing.error().message;
  wrong = recipes;
  wrong.outputs[0].type = "INT32";
  const auto type = connect(wrong);
  ASSERT_FALSE(type);
  EXPECT_NE(type.error().message.find("DOUBLE"), std::string::npos) << type.error().message;
}

TEST_F(Handshake, TakesTheStandInOnOldSoftware) {
  RtdeRecipes old = recipes;
  old.outputs.push_back({"safety_status", "INT32", "safety_mode"});
  FakeUrController::Settings settings;
  settings.version = {3, 9, 0, 0};
  const auto client = connect(old, settings);
  ASSERT_TRUE(client) << client.error().message;
  EXPECT_EQ((*client)->rate_hz(), 125.0);
}

TEST_F(Handshake, NamesTheRegisterThatAnotherClientWrites) {
  const auto first = connect(recipes);
  ASSERT_TRUE(first) << first.error().message;
  const auto second = connect(recipes);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("input_int_register_47"), std::string::npos);
  EXPECT_NE(second.error().message.find("another client"), std::string::npos) << second.error().message;
}

/// For any answer, the client returns an error in time.
TEST_F(Handshake, EndsWithAnErrorWhateverAnswers) {
  for (int round = 0; round < 300; ++round) {
    auto ends = Socket::pair();
    ASSERT_TRUE(ends);
    std::vector<std::uint8_t> answer(std::uniform_int_distribution(0, 40)(random));
    for (auto& byte : answer) byte = static_cast<std::uint8_t>(random());
    if (round % 3 == 0) {  // looks like answers to the first two questions
      const std::uint8_t start[] = {0, 4, 'V', 1, 0, 19, 'v', 0, 0, 0, 5, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0, 0};
      answer.insert(answer.begin(), std::begin(start), std::end(start));
    }
    std::size_t sent = 0;
    (void)ends->second.send(answer, sent);
    if (round % 2 == 0) ends->second = Socket();
    const auto client = RtdeClient::start(std::move(ends->first), recipes, std::chrono::milliseconds(5));
    ASSERT_FALSE(client);
    EXPECT_FALSE(client.error().message.empty());
  }
}

TEST(UrModes, OnlyRunningAndNormalMayMove) {
  const std::string_view unknown = why_not(static_cast<UrSafety>(99));
  for (int mode = -3; mode < 30; ++mode) {
    EXPECT_EQ(why_not(static_cast<UrRobotMode>(mode)).empty(), mode == 7) << mode;
    EXPECT_EQ(why_not(static_cast<UrSafety>(mode)).empty(), mode == 1) << mode;
    // The name of 11 says "undefined"; 21 is not documented.
    const bool named = mode >= 1 && mode <= 22 && mode != 11 && mode != 21;
    EXPECT_EQ(why_not(static_cast<UrSafety>(mode)) != unknown, named) << mode;
  }
}

}  // namespace
}  // namespace steadyhand

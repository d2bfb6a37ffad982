#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "steadyhand/operator/protocol/hub.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

/// A client that takes pictures while it keeps up.
struct Viewer : Outbox {
  std::vector<Json> messages;
  std::vector<std::string> pictures;
  bool keeps_up = true;
  void send(std::shared_ptr<const std::string> message) override { messages.push_back(Json::parse(*message)); }
  bool send_state(std::shared_ptr<const std::string>) override { return false; }
  bool send_picture(std::shared_ptr<const std::string> message, int, bool) override {
    if (keeps_up) pictures.push_back(*message);
    return keeps_up;
  }
  void close() override {}
  bool of_this_user() override { return false; }

  const Json* last(const std::string& type) const {
    for (auto it = messages.rbegin(); it != messages.rend(); ++it) {
      if ((*it)["type"] == type) return &*it;
    }
    return nullptr;
  }
};

class HubPictures : public testing::Test {
 protected:
  HubPictures() {
    facts_.cameras = {{"front"}, {"wrist"}};
    callbacks_.on_lease = [](std::uint64_t) {};
    callbacks_.on_pairing = [](const auto&) {};
    EXPECT_TRUE(hub_.prepare());
  }
  std::uint64_t greet(Viewer& viewer) {
    const auto id = hub_.join(viewer, {"loopback", true}, now_);
    say(id, {{"type", "hello"}, {"version", kProtocolVersion}});
    return id;
  }
  std::uint64_t pair(Viewer& viewer) {
    const auto id = greet(viewer);
    say(id, {{"type", "pair"}, {"code", hub_.code()}});
    return id;
  }
  void say(std::uint64_t id, const Json& message) { hub_.receive(id, message.dump(), now_); }
  void watch(std::uint64_t id, const Json& names) { say(id, {{"type", "watch"}, {"cameras", names}}); }
  void film(int camera, bool is_key, const std::string& text) {
    hub_.broadcast_picture(camera, is_key, std::make_shared<const std::string>(text));
  }

  using Texts = std::vector<std::string>;
  Time now_ = std::chrono::seconds(100);
  ServerFacts facts_;
  ServerCallbacks callbacks_;
  Hub hub_{facts_, callbacks_, 250.0, 8};
};

TEST_F(HubPictures, GoToWhoAskedForTheCameraFromAKeyPictureOn) {
  Viewer viewer, other;
  const auto id = pair(viewer);
  pair(other);
  film(0, true, "f0");
  watch(id, {"front"});
  film(0, false, "f1");
  film(0, true, "f2");
  film(1, true, "w2");
  film(0, false, "f3");
  EXPECT_EQ(viewer.pictures, (Texts{"f2", "f3"}));
  watch(id, {"wrist", "front"});  // cameras that are watched already continue
  film(0, false, "f4");
  film(1, false, "w4");
  film(1, true, "w5");
  EXPECT_EQ(viewer.pictures, (Texts{"f2", "f3", "f4", "w5"}));
  watch(id, Json::array());
  film(0, true, "f6");
  EXPECT_EQ(viewer.pictures.size(), 4u);
  EXPECT_TRUE(other.pictures.empty());
}

TEST_F(HubPictures, WhoIsBehindGoesOnAtTheNextKeyPictureAndOthersSeeAll) {
  Viewer slow, quick;
  watch(pair(slow), {"front"});
  watch(pair(quick), {"front"});
  film(0, true, "0");
  slow.keeps_up = false;
  film(0, false, "1");
  slow.keeps_up = true;
  film(0, false, "2");  // of no use without the one before
  film(0, true, "3");
  film(0, false, "4");
  EXPECT_EQ(slow.pictures, (Texts{"0", "3", "4"}));
  EXPECT_EQ(quick.pictures, (Texts{"0", "1", "2", "3", "4"}));
  EXPECT_EQ(hub_.pictures_skipped, 1u);
}

TEST_F(HubPictures, ACameraThatIsNotThereAndAStrangerAreRefused) {
  Viewer viewer, stranger;
  const auto id = pair(viewer);
  watch(id, {"front"});
  film(0, true, "0");
  watch(id, {"wrist", "ceiling"});
  EXPECT_EQ((*viewer.last("error"))["code"], "unknown");
  EXPECT_NE((*viewer.last("error"))["message"].get<std::string>().find("there are front, wrist"), std::string::npos);
  film(0, false, "1");
  film(1, true, "w");
  EXPECT_EQ(viewer.pictures, (Texts{"0", "1"})) << "nothing else than before";
  watch(greet(stranger), {"front"});
  EXPECT_EQ((*stranger.last("error"))["code"], "unpaired");
  film(0, true, "2");
  EXPECT_TRUE(stranger.pictures.empty());
}

TEST_F(HubPictures, AllHearThatACameraEndedAlsoWhoComesLater) {
  Viewer viewer, late;
  pair(viewer);
  OperatorView view;
  hub_.broadcast_state(view);
  EXPECT_EQ(viewer.last("cameras"), nullptr);
  view.cameras_ended = std::make_shared<const std::vector<std::string>>(Texts{"", "film.mp4: the video ended"});
  hub_.broadcast_state(view);
  hub_.broadcast_state(view);
  EXPECT_EQ((*viewer.last("cameras"))["ended"][1], "film.mp4: the video ended");
  EXPECT_EQ(std::count_if(viewer.messages.begin(), viewer.messages.end(),
                          [](const Json& message) { return message["type"] == "cameras"; }),
            1);
  greet(late);
  EXPECT_NE(late.last("cameras"), nullptr);
}

TEST(PictureMessage, HasAHeadOfSixteenBytes) {
  const VideoPacket packet{258, {from_seconds(81.5), from_seconds(81.6)}, true, "H264"};
  const std::string message = picture_message(packet);
  ASSERT_EQ(message.size(), 20u);
  EXPECT_EQ(message.substr(0, 4), std::string("\x01\x01\x02\x01"));  // 258 = 2 + 1 * 256
  double exposed = 0.0;
  std::memcpy(&exposed, message.data() + 8, sizeof(exposed));
  EXPECT_EQ(exposed, 81.5);
  EXPECT_EQ(message.substr(16), "H264");
}

}  // namespace
}  // namespace steadyhand

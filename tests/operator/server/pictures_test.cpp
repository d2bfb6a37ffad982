#include <cstring>

#include "server_fixture.hpp"

namespace steadyhand {
namespace {

class Pictures : public ServerTest {
 protected:
  Pictures() { cameras_ = {{"front"}, {"wrist"}}; }

  void watch(SocketClient& client, const std::string& camera) {
    client.say({{"type", "watch"}, {"cameras", {camera}}});
    client.say({{"type", "ping"}, {"t_s", 1.0}});
    ASSERT_FALSE(client.hear("pong").is_null());  // by then it is heard
  }
  /// @param number the packet carries it
  static VideoPacket picture(int number, bool is_key, std::size_t bytes = 4000) {
    VideoPacket packet;
    packet.stamp.hand = from_seconds(number);
    packet.is_key = is_key;
    packet.data.assign(bytes, 'x');
    return packet;
  }
  /// Number of the next picture; states and all other messages are skipped.
  static int next(SocketClient& client, bool* is_key = nullptr) {
    const std::string message = client.hear_bytes();
    double exposed = -1.0;
    if (message.size() > 16) std::memcpy(&exposed, message.data() + 8, sizeof(exposed));
    if (is_key != nullptr) *is_key = message.size() > 16 && message[1] == 1;
    return static_cast<int>(exposed);
  }
};

TEST_F(Pictures, ReachWhoWatchesBesideStates) {
  start();
  const auto show = server_->pictures();
  SocketClient client(server_->port());
  join(client, false);
  watch(client, "front");
  OperatorView view;
  view.measured.q.setZero(6);
  for (int i = 1; i <= 30; ++i) {
    server_->publish(view);
    show(picture(i, i == 1));
    ASSERT_EQ(next(client), i);
  }
  EXPECT_EQ(server_->counters().pictures_skipped, 0u);
}

TEST_F(Pictures, ASlowClientLosesSomeUpToAKeyPictureAndAQuickOneNone) {
  start();
  const auto show = server_->pictures();
  SocketClient slow(server_->port(), 4096), quick(server_->port());
  join(slow, false);
  join(quick, false);
  watch(slow, "front");
  watch(quick, "front");
  constexpr int kPictures = 600;
  for (int i = 1; i <= kPictures; ++i) {
    show(picture(i, i % 15 == 1));
    ASSERT_EQ(next(quick), i);
  }
  server_->publish({});
  int received = 0, last = 0;
  for (bool is_key = false; last < kPictures; ++received) {
    const int number = next(slow, &is_key);
    ASSERT_GT(number, last);
    ASSERT_TRUE(number == last + 1 || is_key) << number << " cannot be decoded after " << last;
    last = number;
    if (last > kPictures - 15 && received > 0 && !is_key) break;  // the last second is complete as far as possible
  }
  EXPECT_LT(received, kPictures / 2);
  EXPECT_GT(server_->counters().pictures_skipped, 0u);
}

TEST_F(Pictures, LeadNowhereAfterTheServersEndAndWithoutCameras) {
  start();
  const auto show = server_->pictures();
  server_.reset();
  for (int i = 0; i < 100; ++i) show(picture(i, true));
  cameras_.clear();
  start();
  EXPECT_FALSE(server_->pictures());
  SocketClient client(server_->port());
  join(client, false);
  client.say({{"type", "watch"}, {"cameras", {"front"}}});
  EXPECT_EQ(client.hear("error")["message"], "this session has no cameras");
}

}  // namespace
}  // namespace steadyhand

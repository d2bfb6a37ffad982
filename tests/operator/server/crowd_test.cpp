// Many clients, and some that only want to be in the way.
#include "server_fixture.hpp"

namespace steadyhand {
namespace {

class CrowdTest : public ServerTest {
 protected:
  void start_with(int max_clients) {
    ServerSettings settings;
    settings.max_clients = max_clients;
    start(settings);
  }
  SocketClient& come() {
    crowd_.push_back(std::make_unique<SocketClient>(server_->port()));
    EXPECT_EQ(crowd_.back()->connect(), 101u);
    crowd_.back()->greet();
    EXPECT_FALSE(crowd_.back()->hear("lease").is_null());
    return *crowd_.back();
  }
  /// A frame of the WebSocket, as a client masks it, with zeros.
  static std::string frame(int head, const std::string& payload = "") {
    return std::string{static_cast<char>(head), static_cast<char>(0x80 | payload.size()), 0, 0, 0, 0} + payload;
  }
  /// Comes, and reads no states: until one cannot be written, and the next ones replace each other.
  bool reads_nothing(SocketClient& client) {
    if (client.connect() != 101u) return false;
    client.greet();
    OperatorView snapshot;
    snapshot.measured.q.setZero(6);
    return wait_until([&] {
      server_->publish(snapshot);
      return server_->counters().states_skipped > 20;
    });
  }
  std::vector<std::unique_ptr<SocketClient>> crowd_;
};

TEST_F(CrowdTest, StrangersThatOnlyPingKeepNobodyOut) {
  constexpr int kMany = 8;
  start_with(kMany);
  SocketClient paired(server_->port());
  join(paired, true);
  for (int i = 1; i < kMany; ++i) come();
  for (auto& stranger : crowd_) stranger->say({{"type", "ping"}, {"t_s", 1.0}});
  for (auto& stranger : crowd_) stranger->hear("pong");

  SocketClient newcomer(server_->port());
  ASSERT_EQ(newcomer.connect(), 101u);
  newcomer.say({{"type", "request"}, {"kind", "stop"}});
  EXPECT_TRUE(wait_for([&] { return requests_.size() == 1; }));
  const Json farewell = crowd_.front()->hear("error");
  ASSERT_FALSE(farewell.is_null());
  EXPECT_EQ(farewell["code"], "full");
  paired.say(sample(1));
  EXPECT_TRUE(wait_for([&] { return samples_.size() == 1; })) << "the operator's place is kept";
}

TEST_F(CrowdTest, ConnectionsThatAskForNothingKeepNobodyOut) {
  start_with(2);
  for (int i = 0; i < 40; ++i) {
    crowd_.push_back(std::make_unique<SocketClient>(server_->port()));
    ASSERT_TRUE(crowd_.back()->reach());
  }
  EXPECT_EQ(fetch(server_->port(), "/").status, 200u);
  SocketClient client(server_->port());
  EXPECT_EQ(client.connect(), 101u);
}

TEST_F(CrowdTest, WhoReadsARecordingKeepsItsConnection) {
  large_ = 4u << 20;
  start_with(2);
  SocketClient client(server_->port()), reader(server_->port(), 1 << 16);
  join(client, false);
  ASSERT_TRUE(reader.reach());
  reader.say_bytes("GET /sessions/large HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAuthorization: Bearer " +
                   token_ + "\r\n\r\n");
  std::uint64_t come = reader.hear_raw(1).size();
  for (int i = 0; i < 60; ++i) {
    crowd_.push_back(std::make_unique<SocketClient>(server_->port()));
    ASSERT_TRUE(crowd_.back()->reach());
  }
  EXPECT_EQ(fetch(server_->port(), "/").status, 200u);
  for (std::string piece; !(piece = reader.hear_raw(1u << 20)).empty();) come += piece.size();
  EXPECT_GT(come, large_);
}

class FloodTest : public CrowdTest, public testing::WithParamInterface<std::pair<const char*, std::string>> {
 public:
  static std::string of(int head, const std::string& payload = "") { return frame(head, payload); }
};

/// More frames than anybody may send, and then a pause: what ends the connection is the flood, within less time than
/// the server's patience with the silent.
TEST_P(FloodTest, IsCutOff) {
  start();
  SocketClient& flooder = come();
  const std::string begun = GetParam().second == of(0x00) ? of(0x01, "{") : "";
  std::string flood = begun;
  for (int i = 0; i < 4000; ++i) flood += GetParam().second;
  flooder.say_bytes(flood);
  EXPECT_TRUE(flooder.ends_within(10s));
  come();
}

INSTANTIATE_TEST_SUITE_P(Frames, FloodTest,
                         testing::Values(std::pair("ping", FloodTest::of(0x89)),
                                         std::pair("pong", FloodTest::of(0x8a, "x")),
                                         std::pair("empty_continuation", FloodTest::of(0x00)),
                                         std::pair("message", FloodTest::of(0x81, R"({"type":"ping","t_s":1})"))),
                         [](const auto& flood) { return flood.param.first; });

TEST_F(CrowdTest, AsManyFramesAsAreAllowedAreNoFlood) {
  start();
  SocketClient& client = come();
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 5; ++k) client.say_bytes(frame(k % 2 ? 0x89 : 0x8a));
    std::this_thread::sleep_for(25ms);
  }
  client.say({{"type", "ping"}, {"t_s", 7.0}});
  EXPECT_EQ(client.hear("pong")["t_s"], 7.0);
}

TEST_F(CrowdTest, AFlooderThatDoesNotReadIsCutOff) {
  start();
  SocketClient flooder(server_->port(), 4096);
  ASSERT_TRUE(reads_nothing(flooder));
  std::string flood;
  for (int i = 0; i < 4000; ++i) flood += frame(0x81, R"({"type":"release"})");
  flooder.say_bytes(flood);
  EXPECT_TRUE(wait_until([&] { return server_->counters().clients == 0; }));
}

/// The answers wait until the client is cut off; the server continues to read meanwhile.
TEST_F(CrowdTest, AFlooderThatDoesNotReadItsPongsIsCutOff) {
  start();
  SocketClient flooder(server_->port(), 4096);
  ASSERT_EQ(flooder.connect(), 101u);
  ASSERT_TRUE(wait_until([&] { return server_->counters().clients == 1; }));
  std::string flood;
  for (int i = 0; i < 10'000; ++i) flood += frame(0x89, std::string(125, 'x'));
  std::atomic<bool> hears{false};
  std::thread sender([&] {
    while (flooder.say_bytes(flood)) {
    }
    hears = true;
  });
  EXPECT_TRUE(wait_until([&] { return server_->counters().clients == 0; }));
  EXPECT_TRUE(wait_until([&] { return hears.load(); })) << "its connection is reset";
  server_.reset();
  sender.join();
}

TEST_F(CrowdTest, AStopBehindAPongThatNobodyReadsCounts) {
  start();
  SocketClient deaf(server_->port(), 4096);
  ASSERT_TRUE(reads_nothing(deaf));
  deaf.say_bytes(frame(0x89, "x"));
  deaf.say({{"type", "request"}, {"kind", "stop"}});
  EXPECT_TRUE(wait_for([&] { return requests_.size() == 1; }));
}

/// Also a stop that is on its way when the server says goodbye, or that arrives then.
TEST_F(CrowdTest, AStopCountsUntilTheSocketIsClosed) {
  start();
  SocketClient future(server_->port());
  ASSERT_EQ(future.connect(), 101u);
  future.say({{"type", "hello"}, {"version", 99}});
  EXPECT_EQ(future.hear("error")["code"], "version");
  std::size_t stops = 0;
  while (future.say_text(R"({"type":"request","kind":"stop"})")) {
    if (++stops > 3) std::this_thread::sleep_for(10ms);
  }
  const std::lock_guard lock(mutex_);
  EXPECT_GE(requests_.size() + 2, stops) << "the last may have met a closed socket";
  EXPECT_GE(requests_.size(), 3u) << "it is open for a while";
}

/// A server that waits for no client for longer than this.
class PatienceTest : public CrowdTest {
 protected:
  PatienceTest() {
    ServerSettings settings;
    settings.timeout = 1500ms;
    start(settings);
  }
};

TEST_F(PatienceTest, WhoSaysNothingIsPingedAndThenLetGo) {
  SocketClient& silent = come();
  SocketClient& reads = come();
  std::thread reader([&] { reads.hear("never said"); });  // answers pings
  EXPECT_TRUE(silent.ends_within(20s));
  std::this_thread::sleep_for(1s);
  EXPECT_EQ(server_->counters().clients, 1u);
  server_.reset();
  reader.join();
}

TEST_F(PatienceTest, WhoTakesNothingIsLetGo) {
  SocketClient full(server_->port(), 4096);
  ASSERT_EQ(full.connect(), 101u);
  full.greet();
  ASSERT_TRUE(wait_until([&] { return server_->counters().clients == 1; }));
  OperatorView snapshot;
  snapshot.measured.q.setZero(6);
  EXPECT_TRUE(wait_until([&] {
    server_->publish(snapshot);
    full.say({{"type", "release"}});  // it is there, but reads nothing
    std::this_thread::sleep_for(5ms);
    return server_->counters().clients == 0;
  }));
}

TEST_F(PatienceTest, AnAnswerMayTakeAsLongAsItsBytesAreTaken) {
  large_ = 8u << 20;
  SocketClient client(server_->port()), reader(server_->port(), 1 << 16), idle(server_->port(), 1 << 16);
  join(client, false);
  for (SocketClient* each : {&reader, &idle}) {
    ASSERT_TRUE(each->reach());
    each->say_bytes("GET /sessions/large HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAuthorization: Bearer " +
                    token_ + "\r\n\r\n");
  }
  std::uint64_t come = 0;
  for (std::string piece; !(piece = reader.hear_raw(1u << 16)).empty(); std::this_thread::sleep_for(25ms)) {
    come += piece.size();
  }
  EXPECT_GT(come, large_) << "with its headers, in more than twice the server's patience";
  std::uint64_t left = 0;
  for (std::string piece; !(piece = idle.hear_raw(1u << 20)).empty();) left += piece.size();
  EXPECT_LT(left, large_) << "a client that takes nothing is cut off";
}

TEST_F(PatienceTest, ARequestThatNeverEndsIsLetGo) {
  SocketClient slow(server_->port());
  ASSERT_TRUE(slow.reach());
  slow.say_bytes("GET / HTT");
  EXPECT_TRUE(slow.ends_within(20s));
}

TEST_F(CrowdTest, AnEndlessRequestIsRefusedAtOnce) {
  start();
  SocketClient endless(server_->port());
  ASSERT_TRUE(endless.reach());
  endless.say_bytes("GET / HTTP/1.1\r\nEndless: " + std::string(9000, 'x'));
  EXPECT_TRUE(endless.ends_within(10s));
}

TEST_F(CrowdTest, PingsAndFarewellsAreAnswered) {
  start();
  SocketClient& client = come();
  client.say_bytes(frame(0x89, "how are you"));
  client.say({{"type", "ping"}, {"t_s", 1.0}});
  client.hear("pong");
  client.say({{"type", "ping"}, {"t_s", 2.0}});
  client.hear("pong");
  EXPECT_EQ(client.pong(), "how are you");
  EXPECT_TRUE(client.part());
}

}  // namespace
}  // namespace steadyhand

#include "steadyhand/serve/server.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <fstream>
#include <random>

#include "server_fixture.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

TEST_F(ServerTest, ServesThePageWithItsPolicy) {
  start();
  const Page page = fetch(server_->port(), "/");
  EXPECT_EQ(page.status, 200u);
  EXPECT_EQ(page.type, "text/html; charset=utf-8");
  EXPECT_GT(page.body.size(), 20u);
  EXPECT_NE(page.policy.find("default-src 'self'"), std::string::npos);
  EXPECT_EQ(fetch(server_->port(), "/index.html?x").body, page.body);
  EXPECT_EQ(fetch(server_->port(), "/", "localhost", "HEAD").status, 200u);
  EXPECT_EQ(fetch(server_->port(), "/../server.cpp").status, 404u);
  EXPECT_EQ(fetch(server_->port(), "/", "localhost", "POST").status, 405u);
}

TEST_F(ServerTest, ServesAFolder) {
  const TemporaryFolder folder;
  ServerSettings settings;
  settings.page_folder = folder.path();
  auto empty = Server::start(settings, {}, {});
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().message.find("index.html"), std::string::npos);
  std::ofstream(folder.path() / "index.html") << "mine";
  start(settings);
  EXPECT_EQ(fetch(server_->port(), "/").body, "mine");
}

TEST_F(ServerTest, PagesThatAreMadeOnDemandHaveNoRightsHere) {
  start();
  const Page list = fetch(server_->port(), "/sessions?again");
  EXPECT_EQ(list.status, 200u);
  EXPECT_EQ(list.body, "/sessions");
  EXPECT_EQ(list.type, "application/json");
  EXPECT_NE(list.policy.find("default-src 'self'"), std::string::npos);
  const Page report = fetch(server_->port(), "/sessions/a/report.html");
  EXPECT_EQ(report.body, "/sessions/a/report.html");
  EXPECT_NE(report.policy.find("sandbox"), std::string::npos);
  EXPECT_EQ(report.policy.find("allow-same-origin"), std::string::npos);
  const Page none = fetch(server_->port(), "/sessions/none");
  EXPECT_EQ(none.status, 404u);
  EXPECT_EQ(none.body, "no such session\n");
  EXPECT_EQ(fetch(server_->port(), "/sessionsx").status, 404u);
}

TEST_F(ServerTest, WhatThrowsOnItsThreadIsToldAndItGoesOn) {
  start();
  SocketClient client(server_->port());
  join(client, true);
  throws_ = true;
  client.say({{"type", "request"}, {"kind", "stop"}});
  ASSERT_TRUE(wait_for([&] { return failures_.size() == 1; }));
  EXPECT_EQ(failures_[0], "std::bad_alloc");
  throws_ = false;
  SocketClient other(server_->port());
  ASSERT_EQ(other.connect(), 101u);
  other.greet();
  EXPECT_FALSE(other.hear("welcome").is_null());
  other.say({{"type", "request"}, {"kind", "stop"}});
  EXPECT_TRUE(wait_for([&] { return requests_.size() == 1; }));
  int ticks = 0;
  ASSERT_TRUE(wait_for([&] { return (ticks = ticks_) > 0; }));
  EXPECT_TRUE(wait_for([&] { return ticks_ > ticks + 2; }));
}

TEST_F(ServerTest, WhatThrowsWhileSomebodyComesLocksNobodyOut) {
  start();
  timeless_ = true;
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket visitor(io);
  visitor.connect({boost::asio::ip::address_v4::loopback(), server_->port()});
  char byte = 0;
  boost::system::error_code closed;
  EXPECT_EQ(visitor.read_some(boost::asio::buffer(&byte, 1), closed), 0u);  // until the server has given it up
  timeless_ = false;
  ASSERT_TRUE(wait_for([&] { return !failures_.empty(); }));
  SocketClient client(server_->port());
  EXPECT_EQ(client.connect(), 101u);
}

TEST_F(ServerTest, AnAnswerThatNeverComesNeitherBlocksNorOutlivesTheServer) {
  start();
  std::vector<std::thread> askers;
  for (int i = 0; i < ServerCallbacks::kMaxFetches; ++i) {
    askers.emplace_back([port = server_->port()] {
      try {
        fetch(port, "/sessions/never");
      } catch (const std::exception&) {  // the server ended before it was asked
      }
    });
  }
  ASSERT_TRUE(wait_for([&] { return unanswered_.size() == ServerCallbacks::kMaxFetches; }));
  EXPECT_EQ(fetch(server_->port(), "/sessions").status, 503u);
  EXPECT_EQ(fetch(server_->port(), "/").status, 200u);
  server_.reset();
  for (std::thread& asker : askers) asker.join();
  for (const Answer& answer : unanswered_) answer(FreshPage{"late", "text/plain"});
}

TEST_F(ServerTest, SaysWhenThePortIsTaken) {
  start();
  ServerSettings settings;
  settings.port = server_->port();
  const auto second = Server::start(settings, {}, {});
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find(std::to_string(settings.port)), std::string::npos) << second.error().message;
}

TEST_F(ServerTest, RefusesStrangersNamesAndOrigins) {
  start();
  const std::string own = "http://127.0.0.1:" + std::to_string(server_->port());
  EXPECT_EQ(SocketClient(server_->port()).connect(own), 101u);
  EXPECT_EQ(SocketClient(server_->port()).connect("http://evil.example"), 403u);
  EXPECT_EQ(SocketClient(server_->port()).connect("null"), 403u);
  EXPECT_EQ(SocketClient(server_->port()).connect("http://evil.example", "evil.example"), 421u);
  EXPECT_EQ(SocketClient(server_->port()).connect("", "", "/other"), 404u);
  EXPECT_EQ(fetch(server_->port(), "/", "evil.example").status, 421u);
  ServerSettings strict;
  strict.accept_non_browser_clients = false;
  start(strict);
  EXPECT_EQ(SocketClient(server_->port()).connect(), 403u);
}

TEST_F(ServerTest, HandsOverSamplesStampedByTheSessionsClock) {
  start();
  SocketClient client(server_->port());
  join(client, true);
  for (int i = 1; i <= 20; ++i) client.say(sample(i));
  ASSERT_TRUE(wait_for([&] { return samples_.size() == 20; }));
  for (const OperatorSample& s : samples_) {
    EXPECT_LE(s.stamp.hand, s.stamp.made);
    EXPECT_LE(s.stamp.made, clock_now());
    EXPECT_TRUE(s.clutch);
  }
  EXPECT_EQ(leases_.size(), 1u);
}

TEST_F(ServerTest, TheLeaseEndsWithItsConnection) {
  start();
  {
    SocketClient client(server_->port());
    join(client, true);
  }
  ASSERT_TRUE(wait_for([&] { return leases_.size() == 2; }));
  EXPECT_EQ(leases_.back(), 0u);
}

TEST_F(ServerTest, GarbageClosesItsConnectionOnly) {
  start();
  SocketClient good(server_->port()), bad(server_->port()), big(server_->port());
  join(good, true);
  ASSERT_EQ(bad.connect(), 101u);
  std::mt19937 random(5);
  for (int i = 0; i < 100; ++i) {
    std::string noise(random() % 200, '\0');
    for (char& c : noise) c = static_cast<char>(random() % 128);
    if (!bad.say_text(noise)) break;
  }
  while (!bad.hear().is_null()) {
  }
  ASSERT_EQ(big.connect(), 101u);
  big.say_text(std::string(kMaxClientMessage + 1, ' '));
  EXPECT_TRUE(big.hear().is_null());
  good.say(sample(1));
  EXPECT_TRUE(wait_for([&] { return samples_.size() == 1; }));
}

TEST_F(ServerTest, SurvivesRandomBytesInsteadOfHttp) {
  start();
  std::mt19937 random(6);
  for (int i = 0; i < 200; ++i) {
    std::string noise(random() % 20'000, '\0');
    for (char& c : noise) c = static_cast<char>(random());
    SocketClient client(server_->port());
    ASSERT_TRUE(client.reach());
    client.say_bytes(noise);
  }
  EXPECT_EQ(fetch(server_->port(), "/").status, 200u);
}

TEST_F(ServerTest, StatesReach64ClientsAndTheLeaseHoldersSamplesArrive) {
  start();
  std::vector<std::unique_ptr<SocketClient>> clients;
  for (int i = 0; i < 64; ++i) {
    clients.push_back(std::make_unique<SocketClient>(server_->port()));
    ASSERT_EQ(clients.back()->connect(), 101u);
    clients.back()->greet();
    ASSERT_FALSE(clients.back()->hear("lease").is_null());
  }
  SocketClient driver(server_->port());
  join(driver, true);
  OperatorView snapshot;
  for (int i = 1; i <= 30; ++i) {
    snapshot.now = from_seconds(i);
    snapshot.samples = static_cast<std::uint64_t>(i);
    server_->publish(snapshot);
    // An open hand counts however late it is heard, as it is where a sanitizer serves so many.
    Json open = sample(i);
    open["clutch"] = false;
    driver.say(open);
    for (auto& client : clients) client->say(sample(i));  // without the lease: nothing may come of it
    std::this_thread::sleep_for(5ms);
  }
  ASSERT_TRUE(wait_for([&] { return samples_.size() == 30; }));
  for (auto& client : clients) {
    std::uint64_t last = 0;
    while (last < 30) {
      const Json state = client->hear("state");
      ASSERT_FALSE(state.is_null());
      EXPECT_GT(state["samples"].get<std::uint64_t>(), last);
      last = state["samples"].get<std::uint64_t>();
    }
  }
  EXPECT_EQ(samples_.size(), 30u);
}

TEST_F(ServerTest, RefusesWhereEveryPlaceIsPaired) {
  ServerSettings settings;
  settings.max_clients = 3;
  start(settings);
  std::vector<std::unique_ptr<SocketClient>> clients;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(std::make_unique<SocketClient>(server_->port()));
    join(*clients.back(), false);
  }
  EXPECT_EQ(SocketClient(server_->port()).connect(), 503u);
}

TEST_F(ServerTest, ASlowClientGetsTheNewestStateNotAQueue) {
  start();
  SocketClient slow(server_->port(), 4096), other(server_->port());
  join(slow, false);
  ASSERT_EQ(other.connect(), 101u);
  other.greet();
  other.hear("lease");
  OperatorView snapshot;
  snapshot.measured.q.setZero(6);
  constexpr std::uint64_t kStates = 3000;
  for (std::uint64_t i = 1; i <= kStates; ++i) {
    snapshot.samples = i;
    server_->publish(snapshot);
    // The other client takes each before the next is made, so that all of them are sent.
    while (other.hear("state")["samples"].get<std::uint64_t>() < i) {
    }
  }
  std::uint64_t received = 0, last = 0;
  while (last < kStates) {
    last = slow.hear("state")["samples"].get<std::uint64_t>();
    ++received;
  }
  EXPECT_LT(received, 300u) << "what lay in buffers; the rest was skipped";
  EXPECT_GT(server_->counters().states_skipped, kStates / 2);
}

TEST_F(ServerTest, StopsWithClientsConnected) {
  start();
  SocketClient a(server_->port()), b(server_->port());
  join(a, true);
  ASSERT_EQ(b.connect(), 101u);
  server_.reset();
  EXPECT_TRUE(a.hear("state").is_null());
  EXPECT_EQ(a.farewell(), 1001u) << "going away";
}

}  // namespace
}  // namespace steadyhand

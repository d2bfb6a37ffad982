#include "steadyhand/operator/server/server.hpp"

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
  SocketClient client(server_->port());
  join(client, false);
  const Page list = fetch_with(server_->port(), "/sessions?again", token_);
  EXPECT_EQ(list.status, 200u);
  EXPECT_EQ(list.body, "/sessions");
  EXPECT_EQ(list.type, "application/json");
  EXPECT_NE(list.policy.find("default-src 'self'"), std::string::npos);
  const Page report = fetch_with(server_->port(), "/sessions/a/report.html", token_);
  EXPECT_EQ(report.body, "/sessions/a/report.html");
  EXPECT_NE(report.policy.find("sandbox"), std::string::npos);
  EXPECT_EQ(report.policy.find("allow-same-origin"), std::string::npos);
  const Page none = fetch_with(server_->port(), "/sessions/none", token_);
  EXPECT_EQ(none.status, 404u);
  EXPECT_EQ(none.body, "no such session\n");
  EXPECT_EQ(fetch(server_->port(), "/sessionsx").status, 404u);
}

TEST_F(ServerTest, RecordingsAreForPairedClientsAlone) {
  start();
  const std::uint16_t port = server_->port();
  SocketClient client(port);
  join(client, false);
  for (const char* path : {"/sessions", "/sessions/a/motion", "/sessions/a/report.html", "/sessions/a/session.mcap"}) {
    const Page stranger = fetch(port, path);
    EXPECT_EQ(stranger.status, 401u) << path;
    EXPECT_NE(stranger.body.find("paired"), std::string::npos) << stranger.body;
    EXPECT_EQ(stranger.cookie, "");
    EXPECT_EQ(fetch_with(port, path, "bcdfghjkmnpqbcdfghjkmnpqbc").status, 401u) << path;
    EXPECT_EQ(fetch(port, path + ("?token=" + token_)).status, 401u) << "a token in an address is seen by others";
    EXPECT_EQ(fetch_with(port, path, token_).status, 200u) << path;
  }
  const std::string cookie = fetch_with(port, "/sessions", token_).cookie;
  EXPECT_NE(cookie.find("; Path=/sessions; HttpOnly; SameSite=Strict"), std::string::npos) << cookie;
  const std::string shown = cookie.substr(0, cookie.find(';')), key = shown.substr(shown.find('=') + 1);
  EXPECT_EQ(fetch_with(port, "/sessions/a/report.html", "a=b; " + shown, "Cookie").status, 200u);
  EXPECT_EQ(fetch_with(port, "/sessions", "a" + shown, "Cookie").status, 401u);
  SocketClient thief(port);
  ASSERT_EQ(thief.connect(), 101u);
  thief.say({{"type", "hello"}, {"version", kProtocolVersion}, {"token", key}});
  thief.say({{"type", "take"}});
  EXPECT_EQ(thief.hear("error")["code"], "unpaired") << "what reads recordings moves no arm";
}

std::size_t resident() {
  std::ifstream file("/proc/self/statm");
  std::size_t size = 0, pages = 0;
  file >> size >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

TEST_F(ServerTest, AFileIsSentWhateverItsSizeAndNeverHeldWhole) {
  large_ = (256u << 20) + 1;
  start();
  SocketClient client(server_->port());
  join(client, false);
  const std::size_t before = resident();
  SocketClient reader(server_->port());
  ASSERT_TRUE(reader.reach());
  reader.say_bytes("GET /sessions/large HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nAuthorization: Bearer " +
                   token_ + "\r\n\r\n");
  std::string head;
  while (head.find("\r\n\r\n") == std::string::npos) head += reader.hear_raw(512);
  EXPECT_NE(head.find(" 200 OK"), std::string::npos) << head;
  EXPECT_NE(head.find("Content-Length: " + std::to_string(large_)), std::string::npos) << head;
  std::uint64_t come = head.size() - (head.find("\r\n\r\n") + 4);
  std::size_t most = 0;
  for (std::string piece; !(piece = reader.hear_raw(1u << 20)).empty();) {
    come += piece.size();
    most = std::max(most, resident());
  }
  EXPECT_EQ(come, large_);
#ifndef __SANITIZE_ADDRESS__  // which keeps memory that was freed
  EXPECT_LT(most, before + (32u << 20));
#endif
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
  SocketClient other(server_->port()), driver(server_->port());
  join(other, false);
  const std::string token = token_;
  join(driver, true);
  std::vector<std::thread> askers;
  const auto ask = [&](int count, const std::string& as) {
    for (int i = 0; i < count; ++i) {
      askers.emplace_back([port = server_->port(), as] {
        try {
          fetch_with(port, "/sessions/never", as);
        } catch (const std::exception&) {  // the server ended before it was asked
        }
      });
    }
  };
  using Most = ServerCallbacks;
  ask(Most::kMaxFetchesEach, token);
  ASSERT_TRUE(wait_for([&] { return unanswered_.size() == Most::kMaxFetchesEach; }));
  EXPECT_EQ(fetch_with(server_->port(), "/sessions", token).status, 503u) << "too many of one address";
  EXPECT_EQ(fetch(server_->port(), "/").status, 200u);
  for (int i = 0; i < 40; ++i) EXPECT_EQ(fetch(server_->port(), "/sessions").status, 401u);
  EXPECT_EQ(fetch_with(server_->port(), "/sessions", token_).status, 200u) << "who drives has a place";
  const std::size_t all = Most::kMaxFetches + Most::kReservedFetches;
  ask(static_cast<int>(all) - Most::kMaxFetchesEach, token_);
  ASSERT_TRUE(wait_for([&] { return unanswered_.size() == all; }));
  EXPECT_EQ(fetch_with(server_->port(), "/sessions", token_).status, 503u);
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
    // An open hand counts however late it arrives, as it may with a sanitizer and this many clients.
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

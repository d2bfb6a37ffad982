// Whose a connection over loopback is.
#include "steadyhand/operator/server/peer_user.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace steadyhand {
namespace {

using boost::asio::ip::tcp;

class PeerUser : public testing::Test {
 protected:
  /// Both ends of a new connection: the client's and the server's.
  std::pair<tcp::socket, tcp::socket> connect() {
    tcp::socket visitor(io);
    visitor.connect(door.local_endpoint());
    return {std::move(visitor), door.accept()};
  }
  boost::asio::io_context io;
  tcp::acceptor door{io, {boost::asio::ip::address_v4::loopback(), 0}};
};

TEST_F(PeerUser, IsWhoConnected) {
  const auto ours = connect();
  EXPECT_EQ(peer_user(ours.second), geteuid());
  if (geteuid() != 0) GTEST_SKIP() << "not tested: another user; run as root";
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(seteuid(kNobody), 0);
  const auto theirs = connect();
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(peer_user(theirs.second), kNobody);
}

TEST_F(PeerUser, OfOneThatHasGoneIsNobody) {
  auto ends = connect();
  ends.first.close();
  EXPECT_EQ(peer_user(ends.second), std::nullopt);
  ends.second.close();
  EXPECT_EQ(peer_user(ends.second), std::nullopt);
}

/// Anybody on this machine may make many connections; the server's thread, which hears stops, must not read through
/// them all.
TEST_F(PeerUser, IsFoundWithoutReadingOfOthers) {
  std::vector<std::pair<tcp::socket, tcp::socket>> crowd;
  for (int i = 0; i < 400; ++i) crowd.push_back(connect());
  const auto bytes_read = [] {
    std::ifstream counters("/proc/thread-self/io");
    std::string name;
    std::uint64_t bytes = 0;
    counters >> name >> bytes;
    return name == "rchar:" ? bytes : 0;
  };
  const std::uint64_t before = bytes_read();
  ASSERT_GT(before, 0u) << "the kernel does not count";
  for (const auto& [visitor, host] : crowd) EXPECT_EQ(peer_user(host), geteuid());
  EXPECT_LT(bytes_read() - before, 400u * 400u);
}

}  // namespace
}  // namespace steadyhand

// Codes, the lease and who gets it next, over real sockets; hub_test.cpp has the cases.
#include <sys/wait.h>
#include <unistd.h>

#include "server_fixture.hpp"

namespace steadyhand {
namespace {

class HandoverTest : public ServerTest {
 protected:
  /// The server's answer to a code.
  Json try_code(SocketClient& client, const std::string& code) {
    client.say({{"type", "pair"}, {"code", code}});
    for (;;) {
      Json answer = client.hear();
      if (answer.is_null() || answer["type"] == "paired" || answer["type"] == "error") return answer;
    }
  }
  void watch(SocketClient& client) {
    ASSERT_EQ(client.connect(), 101u);
    client.greet();
    ASSERT_FALSE(client.hear("lease").is_null());
  }
  static Json hear_lease(SocketClient& client, std::uint64_t holder) {
    for (;;) {
      Json lease = client.hear("lease");
      if (lease.is_null() || lease["holder"] == holder) return lease;
    }
  }
};

TEST_F(HandoverTest, LookingAtTheLinkDoesNotUseItUp) {
  start();
  SocketClient phone(server_->port()), headset(server_->port()), late(server_->port());
  const std::string code = this->code();
  for (SocketClient* each : {&phone, &headset, &late}) watch(*each);
  EXPECT_EQ(try_code(phone, code)["type"], "paired");
  EXPECT_EQ(try_code(headset, code)["type"], "paired");
  headset.say({{"type", "take"}});
  ASSERT_TRUE(wait_for([&] { return !urls_.empty(); })) << "the next code is shown";
  EXPECT_NE(this->code(), code);
  const Json refusal = try_code(late, code);
  EXPECT_EQ(refusal["code"], "code");
  EXPECT_NE(refusal["message"].get<std::string>().find("used up"), std::string::npos) << refusal;
}

TEST_F(HandoverTest, TheAddressThatTheBrowserIsOpenedWithHoldsNoCode) {
  start();
  EXPECT_EQ(server_->local_url().find(code()), std::string::npos);
  SocketClient own(server_->port());
  watch(own);
  EXPECT_EQ(try_code(own, "local")["type"], "paired");
}

/// Only root can switch to another user for a while; without root this is not tested.
TEST_F(HandoverTest, AnotherUserOfThisMachineNeedsTheCode) {
  if (geteuid() != 0) GTEST_SKIP() << "not tested: another user; run as root";
  start();
  const pid_t child = fork();
  if (child == 0) {  // not a test itself: its exit code says what it heard
    if (setresuid(65534, 65534, 65534) != 0) _exit(3);
    SocketClient stranger(server_->port());
    if (stranger.connect() != 101u) _exit(4);
    stranger.greet();
    stranger.hear("lease");
    _exit(try_code(stranger, "local")["code"] == "code" ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(HandoverTest, WrongCodesOfAnotherOnThisMachineLockNobodyOut) {
  start();
  SocketClient guesser(server_->port()), person(server_->port());
  watch(guesser);
  watch(person);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(try_code(guesser, "bcdfghjkmnpq")["code"], "code");
  std::string typed = code();
  typed.insert(8, "-").insert(4, " ");
  EXPECT_EQ(try_code(person, typed)["type"], "paired");
  const Time before = clock_now();
  EXPECT_EQ(try_code(guesser, code())["type"], "paired") << "late, not never";
  EXPECT_GE(clock_now() - before, 900ms);
}

}  // namespace
}  // namespace steadyhand

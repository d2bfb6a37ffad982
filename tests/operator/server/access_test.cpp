#include "steadyhand/operator/protocol/access.hpp"

#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <fstream>
#include <set>

#include "steadyhand/operator/server/certificate.hpp"
#include "steadyhand/operator/server/terminal_qr.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

TEST(Access, KnowsItsOwnNamesOnly) {
  const std::vector<std::string> names = {"127.0.0.1", "localhost", "robot.local"};
  for (const char* host : {"127.0.0.1", "localhost:8642", "LOCALHOST", "Robot.Local:1"}) {
    EXPECT_TRUE(host_allowed(host, names)) << host;
  }
  for (const char* host :
       {"", ":8642", "evil.example", "localhost.evil.example:8642", "127.0.0.1.evil.example", "[::1]",
        "localhost:", "127.0.0.1:x", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:+1", "127.0.0.1:1:2", "127.0.0.1:1 ",
        "127.0.0.1:8642; script-src *", "localhost:8642@evil.example"}) {
    EXPECT_FALSE(host_allowed(host, names)) << host;
  }
}

TEST(Access, AcceptsPagesOfThisServerOnly) {
  EXPECT_TRUE(origin_allowed("http://localhost:8642", "localhost:8642", false));
  EXPECT_TRUE(origin_allowed("https://Robot.local", "robot.local", true));
  EXPECT_FALSE(origin_allowed("http://localhost:8642", "localhost:8642", true));
  EXPECT_FALSE(origin_allowed("http://localhost:3000", "localhost:8642", false));
  EXPECT_FALSE(origin_allowed("http://evil.example", "localhost:8642", false));
  EXPECT_FALSE(origin_allowed("null", "localhost:8642", false));
  EXPECT_FALSE(origin_allowed("", "localhost:8642", false));
}

TEST(Access, RandomTextDoesNotRepeat) {
  std::set<std::string> seen;
  for (int i = 0; i < 10'000; ++i) EXPECT_TRUE(seen.insert(random_text(Pairing::kCodeLength)).second);
}

TEST(Access, RemembersABoundedNumberOfTokens) {
  Pairing pairing;
  ASSERT_TRUE(pairing.renew());
  const std::string first = *pairing.redeem(pairing.code());
  EXPECT_TRUE(pairing.known(first));
  for (int i = 0; i < Pairing::kMaxTokens; ++i) ASSERT_TRUE(pairing.redeem(pairing.code()));
  EXPECT_FALSE(pairing.known(first));
  EXPECT_FALSE(pairing.known(""));
}

TEST(Certificate, IsMadeOnceForThisHostAndForItsOwnerOnly) {
  const TemporaryFolder folder;
  const std::vector<std::string> names = {"127.0.0.1", "robot.local"};
  const auto made = load_or_make_certificate(folder.path() / "state", names);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->fingerprint.size(), 32 * 3 - 1u);
  struct stat about {};
  ASSERT_EQ(stat((folder.path() / "state" / "server.pem").c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777, 0600u);
  const auto again = load_or_make_certificate(folder.path() / "state", names);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->fingerprint, made->fingerprint);
  EXPECT_EQ(again->key_pem, made->key_pem);
  // A name that it does not have (the machine moved to another network) needs a new one.
  const auto moved = load_or_make_certificate(folder.path() / "state", {"192.0.2.7"});
  ASSERT_TRUE(moved);
  EXPECT_NE(moved->fingerprint, made->fingerprint);
  const auto other = load_or_make_certificate(folder.path() / "other", names);
  ASSERT_TRUE(other);
  EXPECT_NE(other->key_pem, made->key_pem) << "every host has its own key";
}

TEST(Certificate, RefusesAKeyThatOthersMayReadAndGarbage) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "server.pem";
  ASSERT_TRUE(load_or_make_certificate(folder.path(), {"localhost"}));
  chmod(path.c_str(), 0644);
  const auto open_to_all = load_or_make_certificate(folder.path(), {"localhost"});
  ASSERT_FALSE(open_to_all);
  EXPECT_NE(open_to_all.error().message.find("0644"), std::string::npos) << open_to_all.error().message;
  std::ofstream(path) << "garbage";
  chmod(path.c_str(), 0600);
  const auto garbage = load_or_make_certificate(folder.path(), {"localhost"});
  ASSERT_FALSE(garbage);
  EXPECT_NE(garbage.error().message.find("server.pem"), std::string::npos);
}

TEST(TerminalQr, DrawsASquareAndRefusesWhatNoCodeHolds) {
  const std::string picture = terminal_qr("https://192.0.2.7:8643/#code=hdkmxcrtbnpq");
  EXPECT_GT(std::count(picture.begin(), picture.end(), '\n'), 10);
  EXPECT_TRUE(terminal_qr(std::string(10'000, 'x')).empty());
}

}  // namespace
}  // namespace steadyhand

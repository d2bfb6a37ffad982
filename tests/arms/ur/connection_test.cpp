// Connections to a UR controller that end, hang or come too late, at any moment.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <limits>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ur/ur_dashboard.hpp"
#include "support/manual_clock.hpp"
#include "support/ur/lockstep.hpp"

namespace steadyhand {
namespace {

class UrConnection : public testing::Test {
 protected:
  UrConnection() : random(3), model(random_arm(6, random, false)) { model.home = random_joints(6, 1.0, random); }

  /// Cycles of the arm, without commands. Its last state.
  ArmState run(UrLockstep& arm, int cycles) {
    ArmState state;
    for (int i = 0; i < cycles; ++i) state = arm.receive();
    return state;
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
};

constexpr std::size_t kUntilConnected = std::numeric_limits<std::size_t>::max();

/// An arm whose controller's RTDE ends after a number of bytes.
Result<std::unique_ptr<UniversalRobotsArm>> connect_cut_after(std::size_t left, const RobotModel& model, Clock& clock) {
  FakeUrController controller(model, {});
  auto ours = Socket::pair(), theirs = Socket::pair();
  EXPECT_TRUE(ours && theirs);
  controller.accept_rtde(std::move(theirs->second));
  std::atomic<bool> connecting{true};
  std::thread relay([&] {
    std::vector<std::uint8_t> bytes(1 << 16);
    std::size_t n = 0, sent = 0, said = 0;
    while (connecting) {
      if (said < 50000) controller.step();  // more would not fit into the socket
      if (ours->second.receive(bytes, n) == Socket::Outcome::kDone) {
        (void)theirs->first.send(std::span(bytes).first(n), sent);
      }
      const auto room = std::span(bytes).first(std::min(left, bytes.size()));
      if (theirs->first.receive(room, n) == Socket::Outcome::kDone) {
        (void)ours->second.send(room.first(n), sent);
        left -= n;
        said += n;
      }
      if (left == 0) ours->second = Socket();
      std::this_thread::yield();
    }
  });
  const auto rtde = [&]() -> Result<Socket> { return std::move(ours->first); };
  const auto script = []() -> Result<Socket> { return Error{"none"}; };
  UrSettings settings;
  settings.connect_timeout = 20.0;
  settings.state_timeout = 0.001;
  auto arm = UniversalRobotsArm::over(rtde, script, model, settings, clock);
  connecting = false;
  relay.join();
  return arm;
}

TEST_F(UrConnection, ThatEndsAfterAnyByteIsAnErrorOrAStop) {
  bool connected = false;
  std::vector<std::size_t> ends = {kUntilConnected};
  for (std::size_t bytes = 0; bytes < 1200; bytes += 1 + random() % 5) ends.push_back(bytes);
  for (const std::size_t bytes : ends) {
    auto arm = connect_cut_after(bytes, model, clock);
    if (!arm) {
      EXPECT_NE(arm.error().message.find("closed the RTDE connection"), std::string::npos) << arm.error().message;
      continue;
    }
    connected = true;
    ArmState state;
    for (int i = 0; i < 100 && state.status != ArmStatus::kStopped; ++i) state = (*arm)->receive();
    EXPECT_EQ(state.status, ArmStatus::kStopped) << bytes;
    EXPECT_EQ(state.reason, "the connection to the controller was lost") << bytes;
  }
  EXPECT_TRUE(connected);
}

/// The exception is on the thread that makes connections, where no caller could catch it.
TEST_F(UrConnection, ThatThrowsWhenItIsMadeIsOneThatFails) {
  UrLockstep arm(model, {}, clock);
  arm.before_dialling = [] { throw std::bad_alloc(); };
  ArmState state = run(arm, 20);
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_NE(state.reason.find("primary interface"), std::string_view::npos) << state.reason;
  arm.before_dialling = {};
  arm.restart();
  state = run(arm, 300);
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
}

/// A stop in between: by then it may be of a time when the controller took no programs.
TEST_F(UrConnection, ForProgramsIsMadeAnewForEachStart) {
  FakeUrController::Settings settings;
  settings.remote_control = false;
  UrLockstep arm(model, settings, clock);
  int dialled = 0;
  arm.before_dialling = [&] { ++dialled; };
  arm.keeper_sleeps = true;  // a connection takes longer than a cycle
  (void)run(arm, 10);
  arm.controller.protective_stop();
  arm.keeper_sleeps = false;
  ArmState state = run(arm, 2);
  ASSERT_EQ(state.status, ArmStatus::kStopped);
  ASSERT_NE(state.reason.find("protective stop"), std::string_view::npos) << state.reason;
  ASSERT_EQ(dialled, 1);
  arm.controller.set_remote(true);
  arm.controller.unlock();
  arm.keeper_sleeps = true;
  arm.restart();
  (void)run(arm, 5);
  arm.keeper_sleeps = false;
  state = run(arm, 300);
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  EXPECT_EQ(dialled, 2);
}

/// An answer that comes too late is not that to the next question.
TEST(UrDashboardAnswers, ThatComeLateAreNobodysAnswer) {
  Socket door(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  ASSERT_EQ(::bind(door.descriptor(), generic, size), 0);
  ASSERT_EQ(::listen(door.descriptor(), 1), 0);
  ASSERT_EQ(::getsockname(door.descriptor(), generic, &size), 0);
  std::atomic<bool> late{false};
  std::thread server([&] {
    Socket peer(::accept(door.descriptor(), nullptr, nullptr));
    const std::string greeting = "Connected: Universal Robots Dashboard Server\n", answer = "Robotmode: RUNNING\n";
    (void)::send(peer.descriptor(), greeting.data(), greeting.size(), MSG_NOSIGNAL);
    while (!late) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    (void)::send(peer.descriptor(), answer.data(), answer.size(), MSG_NOSIGNAL);
    char bytes[64];
    while (::recv(peer.descriptor(), bytes, sizeof(bytes), 0) > 0) {
    }
  });
  {
    auto dashboard = UrDashboard::connect("127.0.0.1", ntohs(address.sin_port), std::chrono::milliseconds(300));
    late = !dashboard;
    if (dashboard) {
      EXPECT_FALSE(dashboard->ask("robotmode"));
      late = true;
      const auto answer = dashboard->ask("is in remote control");
      EXPECT_FALSE(answer) << *answer;
    }
    EXPECT_TRUE(dashboard);
  }
  server.join();
}

}  // namespace
}  // namespace steadyhand

#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "socket_client.hpp"
#include "steadyhand/operator/protocol/page_messages.hpp"
#include "steadyhand/operator/server/server.hpp"

namespace steadyhand {

using namespace std::chrono_literals;

inline Time clock_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

using Answer = std::function<void(Result<FreshPage>)>;

/// A server on a free port, and what it reported to the session.
class ServerTest : public testing::Test {
 protected:
  void start(ServerSettings settings = {}) {
    settings.port = 0;
    settings.lan_port = 0;
    ServerFacts facts;
    facts.robot = R"({"name":"arm"})";
    facts.profiles = {{"tracking", "Tracking", {0.0}}};
    facts.cameras = cameras_;
    ServerCallbacks callbacks;
    callbacks.now = [this] {
      if (timeless_) throw std::bad_alloc();
      return clock_now();
    };
    callbacks.on_thread = [this] { tell([&] { thread_ = std::this_thread::get_id(); }); };
    callbacks.on_tick = [this] { tell([&] { ++ticks_; }); };
    callbacks.on_failure = [this](const std::string& what) { tell([&] { failures_.push_back(what); }); };
    callbacks.on_sample = [this](const OperatorSample& s) { tell([&] { samples_.push_back(s); }); };
    callbacks.on_request = [this](const OperatorRequest& r) {
      if (throws_) throw std::bad_alloc();
      tell([&] { requests_.push_back(r); });
      return Status(Done{});
    };
    callbacks.on_lease = [this](std::uint64_t c) {
      tell([&] {
        EXPECT_EQ(thread_, std::this_thread::get_id());
        leases_.push_back(c);
      });
    };
    callbacks.on_pairing = [this](const auto& urls) { tell([&] { urls_ = urls; }); };
    callbacks.on_fetch = [this](const std::string& path, Answer answer) {
      if (path == "/sessions/never") return tell([&] { unanswered_.push_back(std::move(answer)); });
      if (path == "/sessions/none") return answer(Error{"no such session"});
      if (path == "/sessions/large") return answer(large());
      answer(FreshPage{path, path == "/sessions" ? "application/json" : "text/html", path != "/sessions"});
    };
    auto started = Server::start(settings, facts, callbacks);
    ASSERT_TRUE(started) << started.error().message;
    server_ = std::move(*started);
  }

  template <typename Act>
  void tell(Act&& act) {
    const std::lock_guard lock(mutex_);
    act();
    told_.notify_all();
  }
  /// Waits until the condition holds; the limit is far above what it takes, and only there for the test to end.
  template <typename Condition>
  bool wait_for(Condition&& condition) {
    std::unique_lock lock(mutex_);
    return told_.wait_for(lock, 20s, condition);
  }

  /// The same for conditions without a notification.
  template <typename Condition>
  static bool wait_until(Condition&& condition) {
    for (int i = 0; i < 20'000; ++i) {
      if (condition()) return true;
      std::this_thread::sleep_for(1ms);
    }
    return false;
  }

  std::string code() const {
    const std::string url = server_->urls().front();
    return url.substr(url.find("#code=") + 6);
  }
  /// Connects and pairs; takes the lease too if wanted.
  void join(SocketClient& client, bool take) {
    ASSERT_EQ(client.connect(), 101u);
    client.greet();
    ASSERT_FALSE(client.hear("welcome").is_null());
    client.say({{"type", "pair"}, {"code", code()}});
    const Json paired = client.hear("paired");
    ASSERT_FALSE(paired.is_null());
    token_ = paired["token"];
    if (!take) return;
    client.say({{"type", "take"}});
    while (true) {
      const Json lease = client.hear("lease");
      ASSERT_FALSE(lease.is_null());
      if (lease["yours"]) break;
    }
  }
  static Json sample(int sequence) {
    return {{"type", "sample"}, {"sequence", sequence}, {"t_s", to_seconds(clock_now())},
            {"p", {0, 0, 1}},   {"q", {0, 0, 0, 1}},    {"clutch", true},
            {"tracked", true},  {"emulated", false}};
  }

  /// A file of `large_` bytes that takes no room.
  Result<FreshPage> large() const {
    const std::shared_ptr<std::FILE> file(std::tmpfile(), [](std::FILE* open) { std::fclose(open); });
    if (ftruncate(fileno(file.get()), static_cast<off_t>(large_)) != 0) return Error{"no temporary file"};
    return FreshPage{{}, "application/octet-stream", false, file, large_};
  }

  std::uint64_t large_ = 0;
  std::string token_;  ///< of who joined last
  std::vector<CameraInfo> cameras_;
  std::vector<Answer> unanswered_;
  std::mutex mutex_;
  std::condition_variable told_;
  std::vector<OperatorSample> samples_;
  std::vector<OperatorRequest> requests_;
  std::atomic<bool> throws_{false};    ///< where it is asked for something
  std::atomic<bool> timeless_{false};  ///< it throws where it is asked for the time
  std::vector<std::string> failures_;
  int ticks_ = 0;
  std::vector<std::uint64_t> leases_;
  std::vector<std::string> urls_;  ///< with the newest code
  std::thread::id thread_;         ///< set by on_thread
  std::unique_ptr<Server> server_;
};

}  // namespace steadyhand

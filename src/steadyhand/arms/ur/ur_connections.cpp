#include "steadyhand/arms/ur/ur_connections.hpp"

#include <utility>

#include "steadyhand/arms/ur/ur_modes.hpp"

namespace steadyhand {

UrConnections::~UrConnections() {
  running_ = false;
  wake();
  if (keeper_.joinable()) keeper_.join();
}

Result<std::unique_ptr<RtdeClient>> UrConnections::open(const Dial& rtde, double timeout) {
  auto socket = rtde();
  if (!socket) return socket.error();
  return RtdeClient::start(*std::move(socket), UrReport::recipes(), from_seconds(timeout));
}

void UrConnections::start_thread() {
  static constexpr Time kRetry = std::chrono::milliseconds(500);
  keeper_ = std::thread([this] {
    for (int seen = 0; running_;) {
      work_.wait(seen);
      seen = work_;
      keep();
      // Tries failed connections again.
      for (Time slept{0}; rtde_wanted_ && slept < kRetry && running_; slept += kRetry / 10) {
        std::this_thread::sleep_for(kRetry / 10);
      }
      if (rtde_wanted_) --seen;
    }
  });
}

void UrConnections::keep() {
  rtde_.give_back(nullptr);
  script_.give_back(nullptr);
  if (rtde_wanted_ && running_) {
    try {
      if (auto fresh = open(dial_rtde_, timeout_)) {
        rtde_wanted_ = false;
        rtde_.give(*std::move(fresh));
      }
    } catch (const std::exception&) {  // no memory: it is tried again
    }
  }
  if (const int wish = script_wish_; wish != std::exchange(script_served_, wish) && running_) {
    try {
      if (auto fresh = dial_script_()) return script_.give(std::make_unique<Script>(*std::move(fresh), wish));
    } catch (const std::exception&) {  // as one that could not be made
    }
    script_failed_ = wish;
  }
}

void UrConnections::wake() {
  ++work_;
  work_.notify_one();
}

void UrConnections::replace(std::unique_ptr<RtdeClient> lost) {
  rtde_.give_back(std::move(lost));
  rtde_wanted_ = true;
  wake();
}

void UrConnections::replace(std::unique_ptr<Script> used) {
  ++script_wish_;
  end(std::move(used));
}

void UrConnections::end(std::unique_ptr<Script> used) {
  if (used) script_.give_back(std::move(used));
  wake();
}

std::unique_ptr<UrConnections::Script> UrConnections::take_script() {
  std::unique_ptr<Script> fresh = script_.take();
  // One that was wanted before a stop was perhaps opened when the controller took no programs.
  if (fresh && fresh->wish != script_wish_) script_.give_back(std::move(fresh));
  return fresh;
}

}  // namespace steadyhand

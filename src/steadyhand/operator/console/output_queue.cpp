#include "steadyhand/operator/console/output_queue.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "steadyhand/core/text.hpp"
#include "steadyhand/session/live/realtime_threads.hpp"

namespace steadyhand {

struct OutputQueue::Shared {
  explicit Shared(int descriptor_) : descriptor(descriptor_) {}

  const int descriptor;
  std::mutex mutex;  ///< guards the following members; never held while writing
  std::condition_variable changed;
  std::string waiting;
  std::size_t taken = 0;                  ///< bytes written
  std::uint64_t dropped = 0, untold = 0;  ///< texts, and those of them not reported yet
  bool ending = false, done = false, failed = false;
};

OutputQueue::OutputQueue(int descriptor)
    : shared_(std::make_shared<Shared>(descriptor)), thread_([shared = shared_] { work(shared); }) {}

OutputQueue::~OutputQueue() {
  if (thread_.joinable()) (void)finish(std::chrono::seconds(1));
}

void OutputQueue::say(std::string_view text) { draw(printable(text)); }

void OutputQueue::draw(std::string text) {
  {
    const std::lock_guard lock(shared_->mutex);
    if (shared_->failed) return;
    if (shared_->waiting.size() + text.size() > kMost) {
      ++shared_->dropped;
      ++shared_->untold;
      return;
    }
    if (shared_->untold > 0) {
      shared_->waiting +=
          fmt::format("({} lines are missing here: the terminal did not read them in time)\n", shared_->untold);
      shared_->untold = 0;
    }
    shared_->waiting += text;
  }
  shared_->changed.notify_all();
}

bool OutputQueue::finish(Time timeout) {
  std::unique_lock lock(shared_->mutex);
  shared_->ending = true;
  shared_->changed.notify_all();
  for (std::size_t before = shared_->taken; !shared_->done; before = shared_->taken) {
    const auto goes_on = [&] { return shared_->done || shared_->taken != before; };
    if (shared_->changed.wait_for(lock, timeout, goes_on)) continue;
    thread_.detach();  // it is stuck in write(), and ends with the program
    return false;
  }
  lock.unlock();
  thread_.join();
  return !shared_->failed && shared_->dropped == 0;
}

namespace {

/// Number of bytes written; 0 if no more can be.
std::size_t write_some(int descriptor, const char* text, std::size_t size) {
  constexpr std::size_t kPiece = 4096;  // small, to detect progress
  for (;;) {
    const ssize_t written = ::write(descriptor, text, std::min(size, kPiece));
    if (written > 0) return static_cast<std::size_t>(written);
    if (errno == EAGAIN) {  // another program has set O_NONBLOCK
      pollfd writable{descriptor, POLLOUT, 0};
      (void)poll(&writable, 1, -1);
    } else if (errno != EINTR) {
      return 0;
    }
  }
}

}  // namespace

void OutputQueue::work(const std::shared_ptr<Shared>& shared) {
  name_thread("output");
  std::unique_lock lock(shared->mutex);
  while (!shared->failed) {
    shared->changed.wait(lock, [&] { return shared->ending || !shared->waiting.empty(); });
    if (shared->waiting.empty()) break;
    const std::string text = std::exchange(shared->waiting, {});
    for (std::size_t begin = 0; begin < text.size() && !shared->failed;) {
      lock.unlock();
      const std::size_t written = write_some(shared->descriptor, text.data() + begin, text.size() - begin);
      lock.lock();
      shared->failed = written == 0;
      shared->taken += written;
      begin += written;
      shared->changed.notify_all();
    }
  }
  shared->done = true;
  shared->changed.notify_all();
}

}  // namespace steadyhand

#include "steadyhand/session/live/realtime_threads.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace steadyhand {

namespace {

/// Argument of sched_setattr(2); only recent C libraries declare it.
struct SchedulingAttributes {
  std::uint32_t size = sizeof(SchedulingAttributes), policy = SCHED_OTHER;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime = 0, deadline = 0, period = 0;  // ns
};

/// Without permission for a real-time priority: shorter time slices (Linux 6.12 and newer), so that a thread that wakes
/// up does not wait for a long slice of another, and the highest priority that this user may set.
void ask_for_short_turns() {
  constexpr std::uint64_t kShortest = 100'000;  // ns, smallest that Linux accepts
  constexpr int kMost = -15;
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  (void)setpriority(PRIO_PROCESS, thread, kMost);
  SchedulingAttributes wanted;
  wanted.runtime = kShortest;
  wanted.nice = getpriority(PRIO_PROCESS, thread);
  (void)syscall(SYS_sched_setattr, thread, &wanted, 0);
}

}  // namespace

std::string lock_memory() {
  // MCL_ONFAULT: lock only pages in use, so that the unused stacks of threads cost nothing.
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0) return {};
  return fmt::format("memory is not locked ({}); raise `memlock` in /etc/security/limits.conf", std::strerror(errno));
}

std::string make_realtime(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int failed = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (failed == 0) return {};
  ask_for_short_turns();
  return fmt::format("no real-time priority ({}); raise `rtprio` in /etc/security/limits.conf", std::strerror(failed));
}

AwakeProcessors::AwakeProcessors() : latency_(open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC)) {
  constexpr std::int32_t kMicroseconds = 0;
  if (latency_ >= 0 && write(latency_, &kMicroseconds, sizeof(kMicroseconds)) == sizeof(kMicroseconds)) return;
  refused_ = fmt::format("processors may sleep and wake late ({}); let this user write /dev/cpu_dma_latency",
                         std::strerror(errno));
}

AwakeProcessors::~AwakeProcessors() {
  if (latency_ >= 0) close(latency_);
}

void name_thread(const char* name) { pthread_setname_np(pthread_self(), name); }

}  // namespace steadyhand

#include "steadyhand/live/realtime.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace steadyhand {

std::string lock_memory() {
  // MCL_ONFAULT: only what is touched, so that the unused stacks of threads cost nothing.
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0) return {};
  return fmt::format("memory is not locked ({}); raise `memlock` in /etc/security/limits.conf", std::strerror(errno));
}

std::string make_realtime(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int failed = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  if (failed == 0) return {};
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

#include "session/realtime.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
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

void name_thread(const char* name) { pthread_setname_np(pthread_self(), name); }

}  // namespace steadyhand

#include "steadyhand/core/time.hpp"

#include <time.h>

#include <cerrno>

namespace steadyhand {

Time MonotonicClock::now() const {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::chrono::seconds(t.tv_sec) + Time(t.tv_nsec);
}

void MonotonicClock::sleep_until(Time deadline) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(deadline);
  const timespec t{static_cast<time_t>(seconds.count()), static_cast<long>((deadline - seconds).count())};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace steadyhand

#include "session/stop_signals.hpp"

#include <pthread.h>

namespace steadyhand {

StopSignals::StopSignals() {
  sigemptyset(&set_);
  sigaddset(&set_, SIGINT);
  sigaddset(&set_, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &set_, nullptr);
}

bool StopSignals::arrived_within(Time time) const {
  const timespec wait{0, static_cast<long>(time.count())};
  return sigtimedwait(&set_, nullptr, &wait) > 0;
}

}  // namespace steadyhand

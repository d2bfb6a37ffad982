#include "steadyhand/operator/console/stop_signals.hpp"

#include <pthread.h>

namespace steadyhand {

StopSignals::StopSignals() {
  sigemptyset(&set_);
  sigaddset(&set_, SIGINT);
  sigaddset(&set_, SIGTERM);
  sigaddset(&set_, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  // A reader of stdout that goes away and a file that reaches its largest size are errors of writing, no reason to end.
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  // Nor is a terminal that stops who writes from the background (stty tostop).
  signal(SIGTTOU, SIG_IGN);
}

bool StopSignals::arrived_within(Time time) const {
  const timespec wait{0, static_cast<long>(time.count())};
  return sigtimedwait(&set_, nullptr, &wait) > 0;
}

}  // namespace steadyhand

#include "steadyhand/operator/console/stop_signals.hpp"

#include <pthread.h>

namespace steadyhand {

StopSignals::StopSignals() {
  sigemptyset(&set_);
  sigaddset(&set_, SIGINT);
  sigaddset(&set_, SIGTERM);
  sigaddset(&set_, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &set_, nullptr);
  // A closed reader of stdout and a file at its size limit are write errors; they must not end the program.
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  // Background writes to a terminal (stty tostop) must not stop it either.
  signal(SIGTTOU, SIG_IGN);
}

bool StopSignals::arrived_within(Time time) const {
  const timespec wait{0, static_cast<long>(time.count())};
  return sigtimedwait(&set_, nullptr, &wait) > 0;
}

}  // namespace steadyhand

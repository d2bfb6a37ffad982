#pragma once

#include <signal.h>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// SIGINT and SIGTERM for one thread to ask about, instead of ending the program. Make it before any thread is started.
class StopSignals {
 public:
  StopSignals();
  /// Waits for one of them, less than a second.
  bool arrived_within(Time time) const;

 private:
  sigset_t set_;
};

}  // namespace steadyhand

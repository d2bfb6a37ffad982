#pragma once

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// Where the threads of a live session take their time from; tests have one that they move themselves.
class Clock {
 public:
  virtual ~Clock() = default;
  /// Never goes backwards. Any thread.
  virtual Time now() const = 0;
  /// Returns at `deadline`, or at once if that has passed. Any thread.
  virtual void sleep_until(Time deadline) = 0;

 protected:
  Clock() = default;
};

/// The computer's monotonic clock: nobody can set it, so a change of the time of day does not reach a session.
class MonotonicClock final : public Clock {
 public:
  Time now() const override;
  void sleep_until(Time deadline) override;  ///< to the absolute deadline, so that periods do not drift
};

}  // namespace steadyhand

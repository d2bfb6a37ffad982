#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace steadyhand {

/// Time since the epoch of its source (the recording's start in a replay, the monotonic clock in a live session).
using Time = std::chrono::nanoseconds;

/// s
inline double to_seconds(Time t) { return static_cast<double>(t.count()) * 1e-9; }
/// Nearest nanosecond. @pre |s| < 9e9
inline Time from_seconds(double s) { return Time(static_cast<std::int64_t>(std::llround(s * 1e9))); }

/// Goes with every message: hand-to-command latency is `made - hand` of the JointCommand.
struct Stamp {
  Time hand{0};  ///< when the hand was where the message says
  Time made{0};  ///< when this message was made
};

/// Percentiles of durations.
struct TimingSummary {
  double p50 = 0.0;   ///< us, that half of all do not exceed
  double p99 = 0.0;   ///< us, that 99 % do not exceed
  double p999 = 0.0;  ///< us, that 99.9 % do not exceed
  double max = 0.0;   ///< us
};

/// The clock of all threads in a live session; tests use their own.
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

/// The computer's monotonic clock: it cannot be set, so a change of the time of day does not affect a session.
class MonotonicClock final : public Clock {
 public:
  Time now() const override;
  void sleep_until(Time deadline) override;  ///< to the absolute deadline, so that periods do not drift
};

}  // namespace steadyhand

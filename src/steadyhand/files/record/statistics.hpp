#pragma once

#include <cstdint>

#include "steadyhand/core/histogram.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// What a live session counts.
struct SessionStatistics {
  Time now{0};
  TimingSummary latency_us, solve_us, wake_us;  ///< hand to command; planner's solve; how late control cycles began
  std::uint64_t samples = 0, plans = 0, rejected_plans = 0, cycles = 0, missed_deadlines = 0;
  double planner_rate_hz = 0.0;
};

}  // namespace steadyhand

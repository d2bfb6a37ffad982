#pragma once

#include <array>

#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/session/live/planning_stage.hpp"

namespace steadyhand {

/// The times of twenty planning steps, us, and what nine of ten of them stay below. Allocates nothing.
class PlanningBlock {
 public:
  /// @returns whether it is full: `nine_of_ten` then says what it came to, and the next begins
  bool add(double us);
  double nine_of_ten() const { return nine_of_ten_; }

 private:
  std::array<double, 20> times_{};
  std::size_t count_ = 0;
  double nine_of_ten_ = 0.0;
};

/// How long a planning step takes on this machine, us: the time that nine of ten steps along a made-up motion stay
/// below, in the quietest of five blocks, so that what else happens to run in these moments does not decide the rate of
/// a whole session. Takes some 30 ms, with FATROP some 300 ms. Fails as Planner::make.
Result<double> measure_planning_us(const RobotModel& model, const PlanningSettings& settings, const Clock& clock);

/// The fastest planning rate, Hz, of which a period holds such a step 2.5 times: the arm's rate (Hz) or a whole
/// fraction of it, at least 4.
double sustained_rate(double arm_rate_hz, double planning_us);

/// Keeps the planning rate to what the machine sustains while it runs: problems differ by a factor of ten along one
/// motion, and processors slow down. Slower as soon as two of twenty steps ask for it, well before supervision holds
/// the arm for want of plans; faster once nothing has asked for the present rate for some seconds.
class RateKeeper {
 public:
  /// All in Hz; the rate is from slowest to the arm's.
  RateKeeper(double rate_hz, double slowest_hz, double arm_rate_hz)
      : rate_hz_(rate_hz), slowest_hz_(slowest_hz), arm_rate_hz_(arm_rate_hz) {}
  /// @param took us, of a step that planned @param now of the same clock each time. @returns whether the rate changed
  bool take(double took, Time now);
  double rate_hz() const { return rate_hz_; }

 private:
  double rate_hz_, slowest_hz_, arm_rate_hz_;
  PlanningBlock block_;
  double calm_us_ = 0.0;  ///< the slowest block since `calm_since_`
  Time calm_since_{0};
};

}  // namespace steadyhand

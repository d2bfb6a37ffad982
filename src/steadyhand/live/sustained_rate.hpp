#pragma once

#include "steadyhand/core/clock.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/live/planning_stage.hpp"
#include "steadyhand/robot/model.hpp"

namespace steadyhand {

/// How long a planning step takes on this machine, us: the time that nine of ten steps along a made-up motion stay
/// below, in the quietest of five blocks, so that what else happens to run in these moments does not decide the rate of
/// a whole session. Takes some 30 ms, with FATROP some 300 ms. Fails as Planner::make.
Result<double> measure_planning_us(const RobotModel& model, const PlanningSettings& settings, const Clock& clock);

/// The fastest planning rate, Hz, of which a period holds such a step 2.5 times: the arm's rate (Hz) or a whole
/// fraction of it, at least 4.
double sustained_rate(double arm_rate_hz, double planning_us);

}  // namespace steadyhand

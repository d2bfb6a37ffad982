#include "steadyhand/session/live/sustained_rate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace steadyhand {

bool PlanningBlock::add(double us) {
  times_[count_++] = us;
  if (count_ < times_.size()) return false;
  count_ = 0;
  std::sort(times_.begin(), times_.end());
  nine_of_ten_ = times_[times_.size() * 9 / 10 - 1];
  return true;
}

Result<double> measure_planning_us(const RobotModel& model, const PlanningSettings& settings, const Clock& clock) {
  constexpr int kSteps = 100;
  constexpr double kStep = 0.02, kReach = 0.1, kRate = 3.0;  // s, m, rad/s of the made-up hand
  auto planner = Planner::make(model, settings.ocp, settings.planner);
  if (!planner) return planner.error();
  Kinematics arm(model);
  arm.set_position(model.home);
  Reference reference;
  reference.dt = settings.ocp.dt;
  reference.nodes = settings.ocp.horizon;
  PlanningBlock block;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kSteps; ++i) {
    const double t = kStep * i;
    reference.start = from_seconds(t);
    for (int k = 0; k < reference.nodes; ++k) {
      const double phase = kRate * (t + (k + 1) * reference.dt);
      reference.tools[0].p[k] = arm.p() + kReach * Vector3(0.0, std::sin(phase), 0.5 * std::sin(0.7 * phase));
      reference.tools[0].R[k] = arm.R();
    }
    const Time before = clock.now();
    (void)(*planner)->update(reference);
    if (block.add(1e6 * to_seconds(clock.now() - before))) least = std::min(least, block.nine_of_ten());
  }
  return least;
}

double sustained_rate(double arm_rate_hz, double planning_us) {
  constexpr double kSpare = 2.5;
  const double cycle_us = 1e6 / arm_rate_hz;
  const double cycles = std::max(1.0, std::ceil(kSpare * planning_us / cycle_us));
  for (const double share : {1.0, 2.0, 4.0, 5.0, 10.0, 20.0, 25.0, 50.0}) {
    if (share >= cycles && arm_rate_hz / share >= 4.0) return arm_rate_hz / share;
  }
  return std::max(4.0, arm_rate_hz / 50.0);
}

bool RateKeeper::take(double took, Time now) {
  constexpr Time kCalm = std::chrono::seconds(5);
  if (!block_.add(took)) return false;
  const auto rate_for = [&](double us) { return std::max(slowest_hz_, sustained_rate(arm_rate_hz_, us)); };
  const double before = rate_hz_, sustained = rate_for(block_.nine_of_ten());
  calm_us_ = std::max(calm_us_, block_.nine_of_ten());
  if (sustained < rate_hz_) rate_hz_ = sustained;
  if (sustained > rate_hz_ && now - calm_since_ > kCalm) rate_hz_ = rate_for(calm_us_);
  if (sustained <= before || rate_hz_ != before) {
    calm_since_ = now;
    calm_us_ = 0.0;
  }
  return rate_hz_ != before;
}

}  // namespace steadyhand

#include "steadyhand/live/sustained_rate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace steadyhand {

Result<double> measure_planning_us(const RobotModel& model, const PlanningSettings& settings, const Clock& clock) {
  constexpr int kBlock = 20, kBlocks = 5, kSlow = 18;        // steps, blocks, how many of a block are no slower
  constexpr double kStep = 0.02, kReach = 0.1, kRate = 3.0;  // s, m, rad/s of the made-up hand
  auto planner = Planner::make(model, settings.ocp, settings.planner);
  if (!planner) return planner.error();
  Kinematics arm(model);
  arm.set_position(model.home);
  Reference reference;
  reference.dt = settings.ocp.dt;
  reference.nodes = settings.ocp.horizon;
  std::vector<double> times;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kBlock * kBlocks; ++i) {
    const double t = kStep * i;
    reference.start = from_seconds(t);
    for (int k = 0; k < reference.nodes; ++k) {
      const double phase = kRate * (t + (k + 1) * reference.dt);
      reference.p[k] = arm.p() + kReach * Vector3(0.0, std::sin(phase), 0.5 * std::sin(0.7 * phase));
      reference.R[k] = arm.R();
    }
    const Time before = clock.now();
    (void)(*planner)->update(reference);
    times.push_back(1e6 * to_seconds(clock.now() - before));
    if (times.size() < kBlock) continue;
    std::sort(times.begin(), times.end());
    least = std::min(least, times[kSlow - 1]);
    times.clear();
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

}  // namespace steadyhand

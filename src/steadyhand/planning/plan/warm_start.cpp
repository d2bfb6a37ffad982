#include "steadyhand/planning/plan/warm_start.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/planning/plan/straight_stop.hpp"

namespace steadyhand {

WarmStart::WarmStart(const Ocp& ocp) : ocp_(ocp), last_(ocp.dof(), ocp.horizon()), guess_(last_) {
  last_multipliers_.prepare(ocp);
  multipliers_.prepare(ocp);
}

void WarmStart::reset(Time now) {
  last_start_ = now;
  known_ = false;
}

void WarmStart::keep(const Solution& solution, Time start) {
  last_ = solution.trajectory;
  last_multipliers_ = solution.multipliers;
  last_start_ = start;
  known_ = true;
}

namespace {

/// Joint velocities of a trajectory at time t after its start; those of the last node after its end.
JointVector velocity_at(const Trajectory& trajectory, double dt, double t) {
  const int n = static_cast<int>(trajectory.u[0].size()), N = static_cast<int>(trajectory.u.size());
  const int k = static_cast<int>(std::clamp(t / dt, 0.0, static_cast<double>(N)));
  if (k == N) return trajectory.x[N].tail(n);
  return trajectory.x[k].tail(n) + (t - k * dt) * trajectory.u[k];
}

}  // namespace

/// If the arm is faster or slower at the start than the solution, it takes the solution's velocities in the first
/// interval. After the end of the last solution the velocity is constant.
void WarmStart::shift(const StateVector& x0, Time start) {
  const double dt = ocp_.dt(), shift = to_seconds(start - last_start_);
  const int n = ocp_.dof();
  guess_.x[0] = x0;
  for (int k = 0; k < ocp_.horizon(); ++k) {
    const JointVector velocity = known_ ? velocity_at(last_, dt, shift + (k + 1) * dt) : x0.tail(n);
    guess_.u[k] = (velocity - guess_.x[k].tail(n)) / dt;
    guess_.x[k + 1] = ocp_.next(guess_.x[k], guess_.u[k]);
  }
  if (known_) shift_multipliers(shift / dt);
}

void WarmStart::stop(JointSet joints) {
  const RobotModel& model = ocp_.model();
  const int n = ocp_.dof();
  const double dt = ocp_.dt();
  for (int j = 0; j < n; ++j) {
    if (!joints[j]) continue;
    const double speed = guess_.x[0][n + j], shortest = std::abs(speed) / model.acceleration_max[j];
    const int intervals = std::max(1, static_cast<int>(std::ceil(shortest / dt - 1e-9)));
    const double step = braking_step(model, j, guess_.x[0][j], speed, intervals, dt);
    double left = speed;
    for (JointVector& u : guess_.u) {
      u[j] = std::abs(left) < kStill ? 0.0 : -std::clamp(left, -step, step) / dt;
      left += dt * u[j];
    }
  }
  if (joints.none()) return;
  for (int k = 0; k < ocp_.horizon(); ++k) guess_.x[k + 1] = ocp_.next(guess_.x[k], guess_.u[k]);
}

/// Interpolates the multipliers linearly between nodes; after the last node its multipliers are used.
void WarmStart::shift_multipliers(double intervals) {
  const int N = ocp_.horizon();
  multipliers_.clear();
  for (const int r : last_multipliers_.stored()) {
    const bool of_state = ocp_.constraints()[last_multipliers_.row(r).constraint]->nodes() == Nodes::kStates;
    const int first = of_state ? 1 : 0, last = of_state ? N : N - 1;
    const double* from = last_multipliers_.find(r);
    double* to = multipliers_.store(r);
    for (int k = first; k <= last; ++k) {
      const double at = std::clamp(k + intervals, static_cast<double>(first), static_cast<double>(last));
      const int before = static_cast<int>(at), after = std::min(before + 1, last);
      to[k] = from[before] + (at - before) * (from[after] - from[before]);
    }
  }
}

void WarmStart::forget(int constraint, int row) { multipliers_.clear({constraint, row}); }

}  // namespace steadyhand

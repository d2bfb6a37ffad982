#include "closed_loop.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand::bench {
namespace {

constexpr double kSampleRate = 90.0;  // Hz, of the hand

PredictorSettings predictor_settings(const Ocp& ocp, const Reach& reach) {
  PredictorSettings settings;
  settings.horizon = ocp.horizon();
  settings.dt = ocp.dt();
  settings.reach_center = reach.center;
  settings.reach = reach.radius;
  return settings;
}

}  // namespace

ClosedLoop::ClosedLoop(const Ocp& ocp, const std::vector<JointVector>& weights, const Sequence& sequence,
                       const Reach& reach, const Obstacles& obstacles, unsigned seed)
    : ocp_(ocp),
      sequence_(sequence),
      random_(seed),
      obstacles_(obstacles),
      obstacle_rows_(ocp),
      arm_(ocp.model()),
      predictor_(predictor_settings(ocp, reach)),
      warm_start_(ocp),
      followed_(ocp.dof(), ocp.horizon()) {
  instance_.weights = weights;
  instance_.near.resize(ocp.obstacle_rows());
  instance_.x0 = StateVector::Zero(2 * ocp.dof());
  instance_.x0.head(ocp.dof()) = ocp.model().home;
  for (StateVector& x : followed_.x) x = instance_.x0;
  solution_.prepare(ocp);
  warm_start_.reset(Time(0));
}

void ClosedLoop::pose() {
  const int n = ocp_.dof();
  const Time now = from_seconds(static_cast<double>(step_) / sequence_.rate_hz);
  for (;; ++sample_) {
    const double t = static_cast<double>(sample_) / kSampleRate;
    if (from_seconds(t) > now) break;
    predictor_.update({{from_seconds(t), from_seconds(t)}, sequence_.target(std::fmod(t, sequence_.period)), true});
  }
  instance_.reference = predictor_.predict(now);

  const double t = std::min(to_seconds(now - followed_start_) / ocp_.dt(), static_cast<double>(ocp_.horizon()));
  const int k = std::min(static_cast<int>(t), ocp_.horizon() - 1);
  const double s = (t - k) * ocp_.dt();
  const auto q = followed_.x[k].head(n), dq = followed_.x[k].tail(n);
  instance_.x0.head(n) = q + s * dq + 0.5 * s * s * followed_.u[k];
  instance_.x0.tail(n) = dq + s * followed_.u[k];
  if (sequence_.noise > 0.0) {
    std::normal_distribution<double> normal(0.0, sequence_.noise);
    for (int i = 0; i < n; ++i) {
      instance_.x0[i] =
          std::clamp(instance_.x0[i] + normal(random_), ocp_.model().position_min[i], ocp_.model().position_max[i]);
      instance_.x0[n + i] = std::clamp(instance_.x0[n + i] + 10.0 * normal(random_), -ocp_.model().velocity_max[i],
                                       ocp_.model().velocity_max[i]);
    }
  }
  warm_start_.shift(instance_.x0, now);
  const auto before = std::chrono::steady_clock::now();
  obstacle_rows_.choose(obstacles_, now, arm_, warm_start_, instance_);
  choosing_us_ = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - before).count();
}

void ClosedLoop::advance() {
  const Time now = from_seconds(static_cast<double>(step_++) / sequence_.rate_hz);
  followed_start_ = now;
  if (solution_.status == SolveStatus::kSolved || solution_.status == SolveStatus::kFeasible) {
    followed_ = solution_.trajectory;
    warm_start_.keep(solution_, now);
    lost_ = 0;
    return;
  }
  const int n = ocp_.dof();
  followed_.x[0] = instance_.x0;
  if (static_cast<double>(++lost_) > sequence_.rate_hz) followed_.x[0] << ocp_.model().home, JointVector::Zero(n);
  for (int k = 0; k < ocp_.horizon(); ++k) {
    const JointVector limit = ocp_.model().acceleration_max;
    followed_.u[k] = (-followed_.x[k].tail(n) / ocp_.dt()).cwiseMax(-limit).cwiseMin(limit);
    followed_.x[k + 1] = ocp_.next(followed_.x[k], followed_.u[k]);
  }
  warm_start_.reset(now);
}

}  // namespace steadyhand::bench

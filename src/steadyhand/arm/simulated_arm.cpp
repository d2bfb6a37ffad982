#include "steadyhand/arm/simulated_arm.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/arm/arm_kinds.hpp"

namespace steadyhand {

SimulatedArm::SimulatedArm(const RobotModel& model, const JointVector& q, const SimulatedArmSettings& settings,
                           Clock& clock)
    : model_(&model),
      settings_(settings),
      clock_(&clock),
      info_{model.name + " (simulated)", model.dof(), settings.rate_hz, settings.latency + settings.servo_lag,
            kSimulated.hardware},
      period_(from_seconds(1.0 / settings.rate_hz)),
      now_(clock.now()),
      check_(model),
      carry_on_{settings.bridged, model.acceleration_max},
      q_(q),
      dq_(JointVector::Zero(model.dof())),
      random_(settings.seed) {
  restart();
}

void SimulatedArm::restart() {
  stored_ = 0;
  check_.restart();
  status_ = ArmStatus::kStarting;
  reason_ = {};
  following_since_ = now_ + from_seconds(settings_.start_time);
}

ArmState SimulatedArm::receive() {
  if (cycle_ == 0) {  // nobody can have sent commands before
    now_ = clock_->now();
    restart();
  }
  const Time target = now_ + period_;
  const auto late = std::max(Time(0), clock_->now() - target) / period_;  // whole cycles slept through
  clock_->sleep_until(target + late * period_);
  for (int i = 0; i <= late; ++i) advance(now_ + period_);

  ArmState state;
  state.joints = {{now_, now_}, q_, dq_};
  state.cycle = cycle_;
  state.status = status_;
  state.reason = reason_;
  if (status_ == ArmStatus::kFollowing && stored_ > 0 && set_point(0).stamp.made > last_.stamp.made) {
    state.carried_on = set_point(0);
  }
  if (settings_.noise > 0.0) {
    std::normal_distribution<double> normal(0.0, settings_.noise);
    for (int i = 0; i < q_.size(); ++i) {
      state.joints.q[i] += normal(random_);
      state.joints.dq[i] += 100.0 * normal(random_);
    }
  }
  if (settings_.quantisation > 0.0) {
    for (double& q : state.joints.q) q = settings_.quantisation * std::round(q / settings_.quantisation);
  }
  return state;
}

/// From the cycle that began at now_ to the next, at `now`.
void SimulatedArm::advance(Time now) {
  if (status_ == ArmStatus::kFollowing && stored_ > 0 && set_point(0).stamp.made < now_) {  // without a command
    const JointCommand own = carried_on(last_, to_seconds(now_ - last_.stamp.made), carry_on_);
    check_.take(own);
    store(own);
  }
  now_ = now;
  ++cycle_;
  const double dt = to_seconds(period_);
  if (status_ == ArmStatus::kStarting && now >= following_since_) status_ = ArmStatus::kFollowing;
  if (status_ == ArmStatus::kFollowing &&
      to_seconds(now - std::max(last_.stamp.made, following_since_)) > settings_.command_timeout) {
    stop("no command came in time");
  }
  if (status_ == ArmStatus::kFollowing && stored_ > 0) {
    const double share = settings_.servo_lag > 0.0 ? -std::expm1(-dt / settings_.servo_lag) : 1.0;
    const JointVector next = q_ + share * (effective(now - from_seconds(settings_.latency)) - q_);
    dq_ = (next - q_) / dt;
    q_ = next;
  } else {  // brakes
    const JointVector change = (dt * model_->acceleration_max).cwiseMin(dq_.cwiseAbs());
    dq_ -= dq_.cwiseSign().cwiseProduct(change);
    q_ += dt * dq_;
  }
}

/// The set-point that took effect last at time t, carried on at its speed for at most two cycles.
JointVector SimulatedArm::effective(Time t) const {
  int age = 0;
  while (age + 1 < stored_ && set_point(age).stamp.made > t) ++age;
  const JointCommand& c = set_point(age);
  const double ahead = std::clamp(to_seconds(t - c.stamp.made), 0.0, 2.0 * to_seconds(period_));
  return c.q + ahead * c.dq;
}

void SimulatedArm::store(const JointCommand& set_point) {
  newest_ = (newest_ + 1) % kHistory;
  set_points_[newest_] = set_point;
  stored_ = std::min(stored_ + 1, kHistory);
}

void SimulatedArm::stop(std::string_view reason) {
  status_ = ArmStatus::kStopped;
  reason_ = reason;
}

void SimulatedArm::send(const JointCommand& c) {
  if (status_ != ArmStatus::kFollowing) return;
  if (const std::string_view why = check_.refusal(c, q_); !why.empty()) return stop(why);
  last_ = c;
  store(c);
}

}  // namespace steadyhand

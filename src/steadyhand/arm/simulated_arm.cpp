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
      interface_(model, {settings.bridged, settings.command_timeout, settings.start_time}, period_, now_),
      q_(q),
      dq_(JointVector::Zero(model.dof())),
      random_(settings.seed) {}

void SimulatedArm::restart() { interface_.restart(now_); }

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
  state.status = interface_.status();
  state.reason = interface_.reason();
  state.carried_on = interface_.carried_on();
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
  interface_.advance(now);
  now_ = now;
  ++cycle_;
  const double dt = to_seconds(period_);
  if (interface_.moves()) {
    const double share = settings_.servo_lag > 0.0 ? -std::expm1(-dt / settings_.servo_lag) : 1.0;
    const JointVector next = q_ + share * (interface_.at(now - from_seconds(settings_.latency)).q - q_);
    dq_ = (next - q_) / dt;
    q_ = next;
  } else {  // brakes
    const JointVector change = (dt * model_->acceleration_max).cwiseMin(dq_.cwiseAbs());
    dq_ -= dq_.cwiseSign().cwiseProduct(change);
    q_ += dt * dq_;
  }
}

void SimulatedArm::send(const JointCommand& command) { interface_.send(command, q_); }

}  // namespace steadyhand

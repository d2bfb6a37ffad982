#pragma once

#include <functional>

#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "support/manual_clock.hpp"

namespace steadyhand {

/// A simulated arm that shows where it is in every cycle, also in those that the control loop misses.
class WatchedArm final : public Arm {
 public:
  WatchedArm(const RobotModel& model, const SimulatedArmSettings& settings, Clock& clock,
             std::function<void(const JointState&)> watch)
      : clock_(&clock), own_(clock.now()), arm_(model, model.home, settings, own_), watch_(std::move(watch)) {}

  const ArmInfo& info() const override { return arm_.info(); }
  ArmState receive() override {
    const Time period = from_seconds(1.0 / info().rate_hz), next = own_.now() + period;
    const auto missed = std::max(Time(0), clock_->now() - next) / period;
    clock_->sleep_until(next + missed * period);
    ArmState state;
    for (int i = 0; i <= missed; ++i) {
      state = arm_.receive();
      watch_(state.joints);
    }
    return state;
  }
  void send(const JointCommand& command) override { arm_.send(command); }
  void restart() override { arm_.restart(); }

 private:
  Clock* clock_;
  ManualClock own_;
  SimulatedArm arm_;
  std::function<void(const JointState&)> watch_;
};

}  // namespace steadyhand

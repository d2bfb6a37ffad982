#pragma once

#include <random>

#include "steadyhand/arms/driver/clocked_arm.hpp"

namespace steadyhand {

struct SimulatedArmSettings {
  double rate_hz = 500.0;    ///< of control cycles, > 0
  double latency = 0.004;    ///< s from a command to its effect, >= 0
  double servo_lag = 0.010;  ///< s, time constant of the first-order servo, >= 0
  /// rad (m): steps of the measured position, that of a 19-bit encoder; 0: none.
  double quantisation = 1.2e-5;
  double bridged = 0.004;  ///< s without a command that it carries its motion on, before it brakes
  double noise = 0.0;      ///< standard deviation of measured position, rad (m), and a hundred times that of speed
  unsigned seed = 1;       ///< of the noise
  double command_timeout = 0.1;  ///< s without a command after which the arm stops by itself, > 0
  double start_time = 0.05;      ///< s from restart() to following
};

/// An arm of the model's limits whose commands take effect after a latency, through a first-order servo.
class SimulatedArm final : public ClockedArm {
 public:
  /// Stands at `q`; its time begins with the first receive(). Model and clock must outlive it.
  SimulatedArm(const RobotModel& model, const JointVector& q, const SimulatedArmSettings& settings, Clock& clock);

  ArmState receive() override;

  /// Where it really is, without the measurement's errors.
  const JointVector& q() const { return q_; }
  const JointVector& dq() const { return dq_; }
  /// Breaks it, as a hardware fault or the button would: it stops by itself. For tests. @param reason static text
  void trip(std::string_view reason) { interface_.stop(reason); }
  /// Moves it by force, as a collision would. For tests.
  void push(const JointVector& offset) { q_ += offset; }

 private:
  void advance(Time end) override;

  SimulatedArmSettings settings_;
  std::mt19937 random_;
};

}  // namespace steadyhand

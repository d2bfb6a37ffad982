#pragma once

#include <memory>
#include <string_view>

#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// How well a simulated arm follows, and when it gives up.
struct SimulatedArmSettings {
  double rate_hz = 500.0;    ///< of control cycles, > 0
  double latency = 0.004;    ///< s from a command to its effect, >= 0
  double servo_lag = 0.010;  ///< s, time constant of the first-order servo, >= 0
  /// rad (m): steps of the measured position, that of a 19-bit encoder; 0: none.
  double quantisation = 1.2e-5;
  double bridged = 0.004;  ///< s without a command that it carries its motion on, before it brakes
  double noise = 0.0;      ///< standard deviation of measured position, rad (m), and a hundred times that of speed
  unsigned seed = 1;       ///< seed of the noise
  double command_timeout = 0.1;  ///< s without a command after which the arm stops by itself, > 0
  double start_time = 0.05;      ///< s from restart() to following
};

/// An arm of the model's limits whose commands take effect after a latency, through a first-order servo. Where commands
/// are missing, or beyond the limits, it brakes and stops by itself as a real one does.
class SimulatedArm final : public Arm {
 public:
  /// Stationary at `q`; its time starts with the first receive(). Model and clock must outlive it.
  SimulatedArm(const RobotModel& model, const JointVector& q, const SimulatedArmSettings& settings, Clock& clock);
  ~SimulatedArm() override;

  const ArmInfo& info() const override;  ///< no hardware
  ArmState receive() override;
  void send(const JointCommand& command) override;
  void restart() override;

  const JointVector& q() const;   ///< rad (m): where it really is, without the measurement's errors
  const JointVector& dq() const;  ///< rad/s (m/s), likewise
  /// Breaks it, as a hardware fault or the button would: it stops by itself. For tests. @param reason static text
  void trip(std::string_view reason);
  /// Moves it by force, as a collision would. For tests. @param offset rad (m)
  void push(const JointVector& offset);

 private:
  class Servo;
  std::unique_ptr<Servo> servo_;
};

}  // namespace steadyhand

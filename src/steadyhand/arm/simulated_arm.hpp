#pragma once

#include <array>
#include <random>

#include "steadyhand/arm/arm.hpp"
#include "steadyhand/arm/carry_on.hpp"
#include "steadyhand/arm/command_check.hpp"
#include "steadyhand/core/clock.hpp"
#include "steadyhand/robot/model.hpp"

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

/// An arm of the model's limits that exists in the program only. Commands take effect after a latency, through a
/// first-order servo. In a cycle without a command it carries its motion on, and soon brakes. As a UR does, it stops by
/// itself and stays so until restart() when a command is not finite, is out of the position, velocity or acceleration
/// limits (by differences of positions, from cycle to cycle, its own set-points too), or steps, and when none came for
/// a while.
class SimulatedArm final : public Arm {
 public:
  /// Stands at `q`; its time begins with the first receive(). Model and clock must outlive it.
  SimulatedArm(const RobotModel& model, const JointVector& q, const SimulatedArmSettings& settings, Clock& clock);

  const ArmInfo& info() const override { return info_; }
  ArmState receive() override;
  void send(const JointCommand& command) override;
  void restart() override;

  /// Where it really is, without the measurement's errors.
  const JointVector& q() const { return q_; }
  const JointVector& dq() const { return dq_; }
  /// Breaks it, as a hardware fault or the button would: it stops by itself. For tests. @param reason static text
  void trip(std::string_view reason) { stop(reason); }
  /// Moves it by force, as a collision would. For tests.
  void push(const JointVector& offset) { q_ += offset; }

 private:
  void advance(Time now);
  void stop(std::string_view reason);
  void store(const JointCommand& set_point);
  JointVector effective(Time t) const;
  const JointCommand& set_point(int age) const { return set_points_[(newest_ - age + kHistory) % kHistory]; }

  static constexpr int kHistory = 64;
  const RobotModel* model_;
  SimulatedArmSettings settings_;
  Clock* clock_;
  ArmInfo info_;
  Time period_, now_;
  CommandCheck check_;
  std::uint64_t cycle_ = 0;
  ArmStatus status_ = ArmStatus::kStarting;
  std::string_view reason_;
  Time following_since_;
  CarryOn carry_on_;
  JointCommand last_;                              ///< command
  std::array<JointCommand, kHistory> set_points_;  ///< ring: one a cycle, sent or its own
  int newest_ = 0, stored_ = 0;                    ///< stored since the first command, up to kHistory
  JointVector q_, dq_;
  std::mt19937 random_;
};

}  // namespace steadyhand

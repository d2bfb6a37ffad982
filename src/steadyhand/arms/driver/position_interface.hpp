#pragma once

#include <array>

#include "steadyhand/arms/driver/carry_on.hpp"
#include "steadyhand/arms/driver/command_check.hpp"
#include "steadyhand/core/arm.hpp"

namespace steadyhand {

struct PositionInterfaceSettings {
  double bridged = 0.004;        ///< s without a command that it carries its motion on, before it brakes
  double command_timeout = 0.1;  ///< s without a command after which the arm stops by itself, > 0
  double start_time = 0.05;      ///< s from restart() to following
};

/// How a simulated arm takes set-points. In a cycle without a command it continues its motion, and soon brakes. Like a
/// UR, it stops by itself until restart() if a command is not finite, steps, or exceeds a position, velocity or
/// acceleration limit, or if no command comes for a while. Speeds and accelerations are differences of positions from
/// cycle to cycle, its own set-points included. Allocates nothing.
class PositionInterface {
 public:
  /// The model must outlive it.
  PositionInterface(const RobotModel& model, const PositionInterfaceSettings& settings, Time period, Time now);

  void restart(Time now);
  void stop(std::string_view reason);
  /// From the cycle that began a period before `now` to the next, at `now`.
  void advance(Time now);
  /// @param q the arm's position
  void send(const JointCommand& command, const JointVector& q);

  ArmStatus status() const { return status_; }
  std::string_view reason() const { return reason_; }
  /// Whether it follows a set-point, sent or its own.
  bool moves() const { return status_ == ArmStatus::kFollowing && stored_ > 0; }
  /// Of moves(): the set-point that was the newest at time t, carried on at its speed for at most two cycles.
  JointCommand at(Time t) const;
  /// See ArmState.
  std::optional<JointCommand> carried_on() const;

 private:
  void store(const JointCommand& set_point);
  const JointCommand& set_point(int age) const { return set_points_[(newest_ - age + kHistory) % kHistory]; }

  static constexpr int kHistory = 64;
  PositionInterfaceSettings settings_;
  Time period_, now_, following_since_{0};
  CommandCheck check_;
  ArmStatus status_ = ArmStatus::kStarting;
  std::string_view reason_;
  CarryOn carry_on_;
  JointCommand last_;                              ///< command
  std::array<JointCommand, kHistory> set_points_;  ///< ring: one a cycle, sent or its own
  int newest_ = 0, stored_ = 0;                    ///< stored since the first command, up to kHistory
};

}  // namespace steadyhand

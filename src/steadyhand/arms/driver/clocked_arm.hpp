#pragma once

#include "steadyhand/arms/driver/position_interface.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Which tools of a robot are grippers.
PerTool<bool> grippers_of(const RobotModel& model);

/// A simulated arm: a clock paces its cycles, and it takes commands as PositionInterface does. Subclasses move it.
class ClockedArm : public Arm {
 public:
  const ArmInfo& info() const override { return info_; }
  ArmState receive() override;
  void send(const JointCommand& command) override;
  void restart() override { interface_.restart(now_); }

 protected:
  /// The arm starts at `q`; its time begins with the first receive(). Model and clock must outlive it.
  ClockedArm(const RobotModel& model, const JointVector& q, ArmInfo info, const PositionInterfaceSettings& settings,
             Clock& clock);
  /// Moves q_ and dq_ over the cycle that began at now_ to its end, a period later.
  virtual void advance(Time end) = 0;

  const RobotModel* model_;
  Time period_, now_;  ///< now_: the end of the last cycle
  PositionInterface interface_;
  std::uint64_t cycle_ = 0;  ///< that have ended
  JointVector q_, dq_;
  PerTool<std::optional<double>> gripper_, gripper_command_;  ///< 0 open to 1 closed; absent: the tool is none

 private:
  Clock* clock_;
  ArmInfo info_;
};

}  // namespace steadyhand

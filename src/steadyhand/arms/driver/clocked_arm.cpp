#include "steadyhand/arms/driver/clocked_arm.hpp"

#include <algorithm>
#include <utility>

namespace steadyhand {

PerTool<bool> grippers_of(const RobotModel& model) {
  PerTool<bool> grippers{};
  for (int i = 0; i < model.tool_count(); ++i) grippers[i] = model.tools[i].gripper_time.has_value();
  return grippers;
}

ClockedArm::ClockedArm(const RobotModel& model, const JointVector& q, ArmInfo info,
                       const PositionInterfaceSettings& settings, Clock& clock)
    : model_(&model),
      period_(from_seconds(1.0 / info.rate_hz)),
      now_(clock.now()),
      interface_(model, settings, period_, now_),
      q_(q),
      dq_(JointVector::Zero(model.dof())),
      clock_(&clock),
      info_(std::move(info)) {
  for (int i = 0; i < kMaxTools; ++i) {
    if (info_.gripper[i]) gripper_[i] = gripper_command_[i] = 0.0;
  }
}

void ClockedArm::send(const JointCommand& command) {
  interface_.send(command, q_);
  for (int i = 0; i < kMaxTools; ++i) {
    if (gripper_[i] && command.gripper[i] && interface_.moves())
      gripper_command_[i] = std::clamp(*command.gripper[i], 0.0, 1.0);
  }
}

ArmState ClockedArm::receive() {
  if (cycle_ == 0) {  // no command can have arrived before
    now_ = clock_->now();
    restart();
  }
  const Time target = now_ + period_;
  const auto late = std::max(Time(0), clock_->now() - target) / period_;  // whole cycles missed
  clock_->sleep_until(target + late * period_);
  for (int i = 0; i <= late; ++i) {
    interface_.advance(now_ + period_);
    advance(now_ + period_);
    now_ += period_;
    ++cycle_;
  }
  ArmState state;
  state.joints = {{now_, now_}, q_, dq_, gripper_};
  state.cycle = cycle_;
  state.status = interface_.status();
  state.reason = interface_.reason();
  state.carried_on = interface_.carried_on();
  return state;
}

}  // namespace steadyhand

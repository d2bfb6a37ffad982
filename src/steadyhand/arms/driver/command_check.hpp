#pragma once

#include <string_view>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Whether commands, one after the other, are finite, inside the model's position, velocity and acceleration limits (by
/// differences of positions) and begin where the arm stands. What every arm asks before it moves. Allocates nothing.
class CommandCheck {
 public:
  /// The model must outlive it.
  explicit CommandCheck(const RobotModel& model) : model_(&model) {}

  /// The next command is the first.
  void restart() { received_ = 0; }
  /// Why a command is refused; empty, and then it is remembered, if it is not. @param q where the arm stands
  std::string_view refusal(const JointCommand& command, const JointVector& q);
  /// The arm's own set-point, where none came: what comes next is to continue that.
  void take(const JointCommand& command);

 private:
  std::string_view judge(const JointCommand& command, const JointVector& q) const;

  const RobotModel* model_;
  JointCommand last_, before_;
  int received_ = 0;
};

}  // namespace steadyhand

#pragma once

#include <string_view>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Whether commands, one after the other, are finite, inside the model's position, velocity and acceleration limits (by
/// differences of positions) and begin at the arm's position. Every arm checks this before it moves. Allocates nothing.
class CommandCheck {
 public:
  /// The model must outlive it.
  explicit CommandCheck(const RobotModel& model) : model_(&model) {}

  /// The next command is the first.
  void restart() { received_ = 0; }
  /// Why a command is refused; empty if it is accepted, which also stores it. @param q the arm's position
  std::string_view refusal(const JointCommand& command, const JointVector& q);
  /// Stores the arm's own set-point of a cycle without a command: the next command must continue it.
  void take(const JointCommand& command);

 private:
  std::string_view judge(const JointCommand& command, const JointVector& q) const;

  const RobotModel* model_;
  JointCommand last_, before_;
  int received_ = 0;
};

}  // namespace steadyhand

#pragma once

#include <cstddef>
#include <iterator>
#include <optional>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// A simulated hand that sees the things of a scene and does the task by its moves, one after another. Each move
/// follows a line with minimum jerk, as hands move, and is over once the tool has stopped there. The hand grips all the
/// time; the tool moves as the hand does: scale 1, yaw 0. One thread.
class ScriptedOperator {
 public:
  /// The task must outlive it.
  explicit ScriptedOperator(const Task& task) : task_(&task) {}
  /// An operator that takes over in the middle of a task. If something is grasped, it continues after the first move
  /// that closes the gripper. Otherwise it opens the gripper and starts from the beginning.
  static ScriptedOperator taking_over(const Task& task, const SceneState& scene);

  /// Where the hand is now; times must increase. The first poses are before the grip.
  /// @param X_base_tool where the tool is, and `gripper`, 0 open to 1 closed; NaN: there is none
  OperatorSample update(Time now, const SceneState& scene, const Pose& X_base_tool, double gripper);
  /// All moves are over.
  bool is_done() const { return move_ == std::ssize(task_->moves); }

 private:
  void begin_move(Time now, const SceneState& scene, const Pose& X_base_tool);
  Pose goal(const Move& move, const SceneState& scene, const Pose& X_base_tool) const;
  bool is_over(Time now, const Pose& X_base_tool, double gripper);

  const Task* task_;
  std::ptrdiff_t move_ = -1;
  bool begun_ = false, gripped_ = false;
  Time start_{0}, move_start_{0}, rest_since_{0};
  double duration_ = 0.0;  ///< s, of the move
  Pose from_, to_, hand_;  ///< poses of the tool
  Pose last_tool_;
  double last_gripper_ = 0.0;
  std::optional<double> gripper_;
  std::ptrdiff_t first_ = 0;  ///< index of the first move
};

}  // namespace steadyhand

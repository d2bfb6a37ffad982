#pragma once

#include <cstddef>
#include <iterator>
#include <optional>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// A hand that sees where a scene's things are and does the task by its moves, one after another. Each leads along a
/// line as hands move (minimum jerk), and is over once the tool has come to rest there. It grips all the while; the
/// tool moves as the hand does: scale 1, yaw 0. One thread.
class ScriptedOperator {
 public:
  /// The task must outlive it.
  explicit ScriptedOperator(const Task& task) : task_(&task) {}
  /// One that takes over in the middle of a task: where something is grasped it goes on behind the first move that
  /// closes the gripper, elsewhere it opens that and begins anew.
  static ScriptedOperator taking_over(const Task& task, const SceneState& scene);

  /// Where the hand is now, at times that grow; the first ones are before the grip.
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
  Pose from_, to_, hand_;  ///< of the tool
  Pose last_tool_;
  double last_gripper_ = 0.0;
  std::optional<double> gripper_;
  std::ptrdiff_t first_ = 0;  ///< of the moves
};

}  // namespace steadyhand

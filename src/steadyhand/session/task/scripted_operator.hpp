#pragma once

#include <cstddef>
#include <iterator>
#include <optional>
#include <span>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/session/task/task.hpp"

namespace steadyhand {

/// A tool as a scripted operator sees it.
struct SeenTool {
  Pose X_base_tool;
  double gripper = 0.0;  ///< 0 open to 1 closed; NaN: it is none
};

/// A simulated person with a hand for each tool that the moves of a task name, who sees the things of a scene and does
/// the moves, one after another. Each move follows a line with minimum jerk, as hands move, and is over once the tool
/// has stopped there; the other hand does not move. Hands that only open and close a gripper do not engage, the others
/// do all the time; tools move as they do: scale 1, yaw 0. One thread.
class ScriptedOperator {
 public:
  /// The task must outlive it.
  explicit ScriptedOperator(const Task& task);
  /// An operator that takes over in the middle of a task. If something is grasped, it continues after the first move
  /// that closes the gripper. Otherwise it opens the gripper and starts from the beginning.
  static ScriptedOperator taking_over(const Task& task, const SceneState& scene);

  /// Where the hands are now; times must increase. The first poses are before the grip. Valid until the next call.
  std::span<const OperatorSample> update(Time now, const SceneState& scene, const PerTool<SeenTool>& tools);
  /// All moves are over.
  bool is_done() const { return move_ == std::ssize(task_->moves); }

 private:
  void begin_move(Time now, const SceneState& scene, const PerTool<SeenTool>& tools);
  Pose goal(const Move& move, const SceneState& scene, const Pose& X_base_tool) const;
  bool is_over(Time now, const SeenTool& tool);

  const Task* task_;
  std::ptrdiff_t move_ = -1;
  bool begun_ = false;
  Time start_{0}, move_start_{0}, rest_since_{0};
  double duration_ = 0.0;  ///< s, of the move
  Pose from_, to_;         ///< poses of the tool
  SeenTool last_tool_;
  std::size_t hands_ = 1;
  PerTool<OperatorSample> samples_;  ///< of the hands, newest
  std::ptrdiff_t first_ = 0;         ///< index of the first move
};

}  // namespace steadyhand

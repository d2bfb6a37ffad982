#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "steadyhand/arms/driver/ros2_settings.hpp"
#include "steadyhand/arms/ros2/goal_id.hpp"
#include "steadyhand/arms/ros2/gripper_services.hpp"
#include "steadyhand/arms/ros2/node.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// State of the newest goal that this client sent.
struct GripperGoal {
  GoalId id{};
  Time sent{0};
  bool answered = false;               ///< to any client's request: the server is running
  std::optional<Time> refused{};       ///< when a refusal came that may be for our goal
  std::optional<Time> accepted_at{};   ///< on the server's clock, by its status
  int status = 0;                      ///< of action_msgs/GoalStatus
  std::optional<Time> asked_result{};  ///< when
  bool over = false;
};

/// A gripper behind an action server of ROS 2, GripperCommand or ParallelGripperCommand of control_msgs. Each wanted
/// position is a goal that replaces the one before; the newest is sent, at most ten times a second. The action's status
/// counts as its answer, since it names goals: so other clients' answers are not taken for ours. A goal without an
/// answer is cancelled, so that a server that starts late does not execute an old goal. See docs/how-to/ros2.md.
class Ros2Gripper {
 public:
  /// @param node must outlive it, except its callbacks, which end with the node @param clock must outlive both
  static Result<std::unique_ptr<Ros2Gripper>> join(Ros2Node& node, const Ros2GripperSettings& settings,
                                                   const Clock& clock);

  /// Sets the wanted position, 0 open to 1 closed; clamps values beyond, ignores NaN. Any thread.
  void move_to(double closed);
  /// Its newest reported position; none: not reported yet. Any thread.
  std::optional<double> position() const;
  /// Takes its position in the unit of the action, from the joint states. Any thread.
  void measured(double position);
  /// Why the arm should stop; text that lives as long as this; empty: nothing is wrong. Any thread.
  std::string_view why_not() const;
  /// Clears the error: the next wanted position is sent as if it were the first one. Any thread.
  void restart();
  /// Does what is due: every 10 ms or so, on one thread.
  void talk();

 private:
  enum class Health { kFine, kNobody, kSeveral, kSilent, kRejected, kGaveUp, kTakenOver };

  Ros2Gripper(Ros2Node& node, const Ros2GripperSettings& settings, const Clock& clock);
  void hear(const GoalStatusArrayMessage& message);
  void hear_answer(bool accepted);
  void hear_result(double position, bool stalled);
  Health presence();
  void begin_anew();
  void look_after_goal(Time now);
  void want(double closed, Time now);

  Ros2GripperSettings settings_;
  const Clock* clock_;
  std::string nobody_, several_, silent_, rejected_, gave_up_, taken_over_;  ///< reasons, which name the action
  GripperServices services_;
  Ros2Subscription status_, parallel_;  ///< parallel_: feedback as ParallelGripperCommand has it

  std::atomic<double> position_, wanted_;  ///< shares; NaN: none
  std::atomic<Health> there_{Health::kNobody}, health_{Health::kFine};
  std::atomic<bool> restart_{false};

  // ---- thread that sends
  std::optional<double> told_;  ///< position in the newest goal
  Time last_sent_ = -std::chrono::hours(1);
  GoalIds ids_;

  std::mutex mutex_;  ///< guards data that thread and those of DDS share; not held during a send
  std::optional<GripperGoal> goal_;
  bool others_ = false;  ///< another client's goal was accepted after ours
};

}  // namespace steadyhand

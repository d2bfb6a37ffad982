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

/// What a client knows of the newest goal that it sent.
struct GripperGoal {
  GoalId id{};
  Time sent{0};
  bool answered = false;               ///< by anybody: the server is awake
  std::optional<Time> refused{};       ///< when an answer was heard that may have been ours
  std::optional<Time> accepted_at{};   ///< of the server's clock; by its status
  int status = 0;                      ///< of action_msgs/GoalStatus
  std::optional<Time> asked_result{};  ///< when
  bool over = false;
};

/// A gripper behind an action server of ROS 2, GripperCommand or ParallelGripperCommand of control_msgs: each place
/// that is wanted is a goal, which takes the place of the one before; at most ten a second, the newest. An action's
/// answers are its status, which names goals, so that other clients' answers are not taken for ours. A goal that nobody
/// answers is cancelled, so that a server that wakes up does not do late what was wanted long ago. docs/how-to/ros2.md
/// has the whole story.
class Ros2Gripper {
 public:
  /// @param node must outlive it, but for callbacks, which end with the node @param clock must outlive both
  static Result<std::unique_ptr<Ros2Gripper>> join(Ros2Node& node, const Ros2GripperSettings& settings,
                                                   const Clock& clock);

  /// Where it is to be from now on, 0 open to 1 closed; what is beyond is cut off, what is no number ignored. Any
  /// thread.
  void move_to(double closed);
  /// Where it is, at the newest word; none: nobody has told. Any thread.
  std::optional<double> position() const;
  /// Its place in the unit of the action, from the joint states. Any thread.
  void measured(double position);
  /// Why the arm should stop; text that lives as long as this; empty: nothing is wrong. Any thread.
  std::string_view why_not() const;
  /// What went wrong is over: what is wanted from now on is told, as if for the first time. Any thread.
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

  // ---- of the thread that talks
  std::optional<double> told_;  ///< the newest goal's place
  Time last_sent_ = -std::chrono::hours(1);
  GoalIds ids_;

  std::mutex mutex_;  ///< of what that thread and those of DDS share; not held while something is sent
  std::optional<GripperGoal> goal_;
  bool others_ = false;  ///< another client's goal was accepted after ours
};

}  // namespace steadyhand

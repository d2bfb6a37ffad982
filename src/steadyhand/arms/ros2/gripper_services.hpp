#pragma once

#include <functional>
#include <memory>
#include <string>

#include "steadyhand/arms/ros2/goal_id.hpp"
#include "steadyhand/arms/ros2/node.hpp"

namespace steadyhand {

/// The three services of an action GripperCommand, or of its successor ParallelGripperCommand. Middlewares of ROS
/// differ in how an answer names its request: Cyclone DDS's puts that into the message, the others next to it, where
/// DDS's interface does not show it. With those, an answer may belong to another client's request; the callbacks must
/// allow for that.
class GripperServices {
 public:
  using OnAnswer = std::function<void(bool accepted)>;
  using OnResult = std::function<void(double position, bool stalled)>;

  /// Callbacks run on a thread of DDS. @param joint that goals of ParallelGripperCommand name
  GripperServices(Ros2Node& node, std::string action, std::string joint, OnAnswer on_answer, OnResult on_result);
  ~GripperServices();

  /// Makes what this server needs, once. @param vendor of its DDS @param parallel its action is ParallelGripperCommand
  Status speak_to(int vendor, bool parallel);
  /// Whether requests would arrive, and answers come back.
  bool are_there() const;

  void send_goal(const GoalId& id, double position, double max_effort);
  void ask_result(const GoalId& id);
  void cancel(const GoalId& id);

 private:
  struct Way;
  template <typename Messages>
  struct WayOf;
  Ros2Node* node_;
  std::string action_, joint_;
  OnAnswer on_answer_;
  OnResult on_result_;
  std::unique_ptr<Way> ways_[2][2];  ///< index: is parallel, is numbered
  Way* way_ = nullptr;               ///< way of the newest server; null: no server was seen
};

}  // namespace steadyhand

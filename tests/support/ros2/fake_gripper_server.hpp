#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/ros2/goal_id.hpp"
#include "steadyhand/ros2/node.hpp"

namespace steadyhand {

/// An action server of control_msgs/action/GripperCommand, as one on Cyclone DDS's middleware answers. Goals are
/// accepted at once, the newest takes the place of the one before, and ends when the test says so. Within a process DDS
/// delivers before it returns, so all of it happens in who sends.
class FakeGripperServer {
 public:
  struct Goal {
    GoalId id{};
    double position = 0.0, max_effort = 0.0;
    int status = 2;  ///< of action_msgs/GoalStatus: executing
    double result = 0.0;
    bool stalled = false;
    std::int32_t stamp = 0;
  };

  FakeGripperServer(int domain, const std::string& action) {
    using Kind = Ros2Topic::Kind;
    const auto fit = [](auto made) {
      if (!made) throw std::runtime_error(made.error().message);  // ends the test
      return *std::move(made);
    };
    const std::string base = action + "/_action/";
    node_ = fit(Ros2Node::open(domain));
    answers_ = fit(node_->publish<NumberedSendGoalResponse>({base + "send_goal", Kind::kReply, true}));
    results_ = fit(node_->publish<NumberedGetResultResponse>({base + "get_result", Kind::kReply, true}));
    status_ = fit(node_->publish<GoalStatusArrayMessage>({base + "status", Kind::kTopic, true}));
    feedback_ = fit(node_->publish<GripperFeedbackMessage>({base + "feedback", Kind::kTopic, true}));
    fit(node_->subscribe<NumberedSendGoalRequest>(
        {base + "send_goal", Kind::kRequest, true},
        [this](const NumberedSendGoalRequest& request, Ros2PublisherId) { take(request); }));
    fit(node_->subscribe<NumberedGetResultRequest>(
        {base + "get_result", Kind::kRequest, true},
        [this](const NumberedGetResultRequest& request, Ros2PublisherId) { tell(request); }));
    fit(node_->subscribe<NumberedCancelGoalRequest>({base + "cancel_goal", Kind::kRequest, true},
                                                    [this](const NumberedCancelGoalRequest& r, Ros2PublisherId) {
                                                      cancelled.push_back(goal_id_of(r.body.goal_info.goal_id));
                                                    }));
  }

  void tell_status() {
    std::vector<action_msgs_msg_dds__GoalStatus_> list;
    for (const Goal& goal : goals) {
      list.push_back({{message_of(goal.id), {goal.stamp, 0}}, static_cast<std::uint8_t>(goal.status)});
    }
    GoalStatusArrayMessage message{};
    message.status_list = sequence_of<decltype(message.status_list)>(list);
    (void)status_.send(message);
  }
  /// The newest goal ends so.
  void end(int status, double position, bool stalled = false) {
    goals.back().status = status;
    goals.back().result = position;
    goals.back().stalled = stalled;
    tell_status();
  }
  /// As if another client had sent a goal.
  void take_other() {
    Goal goal;
    goal.id.fill(0xab);
    accept(goal);
  }
  void feed_back(double position) {
    (void)feedback_.send({message_of(goals.back().id), {position, 0.0, false, false}});
  }

  bool silent = false, rejects = false;
  std::vector<Goal> goals;  ///< accepted
  std::vector<GoalId> cancelled;
  int requests = 0;

 private:
  void take(const NumberedSendGoalRequest& request) {
    ++requests;
    if (silent) return;
    if (rejects) return (void)answers_.send({request.id, {false, {0, 0}}});
    const auto& [position, max_effort] = request.body.goal.command;
    Goal goal;
    goal.id = goal_id_of(request.body.goal_id);
    goal.position = position;
    goal.max_effort = max_effort;
    accept(goal);
    (void)answers_.send({request.id, {true, {0, 0}}});
  }
  void accept(Goal goal) {
    for (Goal& before : goals) {
      if (before.status < 4) before.status = 5;  // cancelled
    }
    goal.stamp = static_cast<std::int32_t>(goals.size()) + 1;
    goals.push_back(goal);
    tell_status();
  }
  void tell(const NumberedGetResultRequest& request) {
    if (silent) return;
    for (const Goal& goal : goals) {
      if (goal.id != goal_id_of(request.body.goal_id)) continue;
      (void)results_.send(
          {request.id, {static_cast<std::uint8_t>(goal.status), {goal.result, 0.0, goal.stalled, !goal.stalled}}});
    }
  }

  Ros2Publisher<NumberedSendGoalResponse> answers_;
  Ros2Publisher<NumberedGetResultResponse> results_;
  Ros2Publisher<GoalStatusArrayMessage> status_;
  Ros2Publisher<GripperFeedbackMessage> feedback_;
  std::unique_ptr<Ros2Node> node_;  ///< last: goes first
};

}  // namespace steadyhand

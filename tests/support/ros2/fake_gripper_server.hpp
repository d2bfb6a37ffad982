#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "steadyhand/arms/ros2/goal_id.hpp"
#include "steadyhand/arms/ros2/node.hpp"

namespace steadyhand {

/// The messages of an action server on Cyclone DDS's middleware.
struct FakeGripperMessages {
  using SendGoal = NumberedSendGoalRequest;
  using GoalAnswer = NumberedSendGoalResponse;
  using AskResult = NumberedGetResultRequest;
  using ResultAnswer = NumberedGetResultResponse;
  using Feedback = GripperFeedbackMessage;
  static double position(const SendGoal& goal) { return goal.body.goal.command.position; }
  static double effort(const SendGoal& goal) { return goal.body.goal.command.max_effort; }
  static void place(control_msgs_action_dds__GripperCommand_Result_& at, double& position) { at.position = position; }
};
struct FakeParallelGripperMessages {
  using SendGoal = NumberedParallelSendGoalRequest;
  using GoalAnswer = NumberedParallelSendGoalResponse;
  using AskResult = NumberedParallelGetResultRequest;
  using ResultAnswer = NumberedParallelGetResultResponse;
  using Feedback = ParallelFeedbackMessage;
  static double position(const SendGoal& goal) { return goal.body.goal.command.position._buffer[0]; }
  static double effort(const SendGoal& goal) { return goal.body.goal.command.effort._buffer[0]; }
  template <typename State>
  static void place(State& at, double& position) {
    static char nothing[] = "";
    at.state.header.frame_id = nothing;
    at.state.position = {1, 1, &position, false};
  }
};

/// An action server of control_msgs/action/GripperCommand, or its successor, as one on Cyclone DDS's middleware
/// answers. Goals are accepted at once. The newest replaces the one before, and ends when the test says so. Within a
/// process DDS delivers before it returns, so everything happens on the sender's thread.
template <typename Messages>
class FakeGripperServerOf {
 public:
  struct Goal {
    GoalId id{};
    double position = 0.0, max_effort = 0.0;
    int status = 2;  ///< of action_msgs/GoalStatus: executing
    double result = 0.0;
    bool stalled = false;
    std::int32_t stamp = 0;
  };

  FakeGripperServerOf(int domain, const std::string& action) {
    using Kind = Ros2Topic::Kind;
    const auto fit = [](auto made) {
      if (!made) throw std::runtime_error(made.error().message);  // ends the test
      return *std::move(made);
    };
    const std::string base = action + "/_action/";
    node_ = fit(Ros2Node::open(domain));
    answers_ = fit(node_->template publish<typename Messages::GoalAnswer>({base + "send_goal", Kind::kReply, true}));
    results_ = fit(node_->template publish<typename Messages::ResultAnswer>({base + "get_result", Kind::kReply, true}));
    status_ = fit(node_->publish<GoalStatusArrayMessage>({base + "status", Kind::kTopic, true}));
    feedback_ = fit(node_->template publish<typename Messages::Feedback>({base + "feedback", Kind::kTopic, true}));
    fit(node_->template subscribe<typename Messages::SendGoal>(
        {base + "send_goal", Kind::kRequest, true},
        [this](const typename Messages::SendGoal& request, Ros2PublisherId) { take(request); }));
    fit(node_->template subscribe<typename Messages::AskResult>(
        {base + "get_result", Kind::kRequest, true},
        [this](const typename Messages::AskResult& request, Ros2PublisherId) { tell(request); }));
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
    typename Messages::Feedback message{};
    message.goal_id = message_of(goals.back().id);
    Messages::place(message.feedback, position);
    (void)feedback_.send(message);
  }

  bool silent = false, rejects = false;
  std::vector<Goal> goals;  ///< accepted
  std::vector<GoalId> cancelled;
  int requests = 0;

 private:
  void take(const typename Messages::SendGoal& request) {
    ++requests;
    if (silent) return;
    if (rejects) return (void)answers_.send({request.id, {false, {0, 0}}});
    Goal goal;
    goal.id = goal_id_of(request.body.goal_id);
    goal.position = Messages::position(request);
    goal.max_effort = Messages::effort(request);
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
  void tell(const typename Messages::AskResult& request) {
    if (silent) return;
    for (const Goal& goal : goals) {
      if (goal.id != goal_id_of(request.body.goal_id)) continue;
      typename Messages::ResultAnswer message{};
      message.id = request.id;
      message.body.status = static_cast<std::uint8_t>(goal.status);
      message.body.result.stalled = goal.stalled;
      double position = goal.result;
      Messages::place(message.body.result, position);
      (void)results_.send(message);
    }
  }

  Ros2Publisher<typename Messages::GoalAnswer> answers_;
  Ros2Publisher<typename Messages::ResultAnswer> results_;
  Ros2Publisher<GoalStatusArrayMessage> status_;
  Ros2Publisher<typename Messages::Feedback> feedback_;
  std::unique_ptr<Ros2Node> node_;  ///< last: goes first
};

using FakeGripperServer = FakeGripperServerOf<FakeGripperMessages>;
using FakeParallelGripperServer = FakeGripperServerOf<FakeParallelGripperMessages>;

}  // namespace steadyhand

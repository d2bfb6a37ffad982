#include "steadyhand/arms/ros2/gripper_services.hpp"

#include <atomic>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace steadyhand {

namespace {

constexpr int kCycloneDds = 0x0110;

/// The messages of an action's services; if numbered, the client's id and the request's number come first.
template <bool kIsNumbered, typename Goal, typename Answer, typename Question, typename Result, typename Cancel>
struct ServiceMessages {
  static constexpr bool kNumbered = kIsNumbered;
  using SendGoal = Goal;
  using GoalAnswer = Answer;
  using AskResult = Question;
  using ResultAnswer = Result;
  using CancelGoal = Cancel;
};
using Plain =
    ServiceMessages<false, SendGoalRequest, SendGoalResponse, GetResultRequest, GetResultResponse, CancelGoalRequest>;
using Numbered = ServiceMessages<true, NumberedSendGoalRequest, NumberedSendGoalResponse, NumberedGetResultRequest,
                                 NumberedGetResultResponse, NumberedCancelGoalRequest>;
using PlainParallel = ServiceMessages<false, ParallelSendGoalRequest, ParallelSendGoalResponse,
                                      ParallelGetResultRequest, ParallelGetResultResponse, CancelGoalRequest>;
using NumberedParallel =
    ServiceMessages<true, NumberedParallelSendGoalRequest, NumberedParallelSendGoalResponse,
                    NumberedParallelGetResultRequest, NumberedParallelGetResultResponse, NumberedCancelGoalRequest>;

template <bool kNumbered, typename Message>
auto& body_of(Message& message) {
  if constexpr (kNumbered) {
    return message.body;
  } else {
    return message;
  }
}

/// Memory that a goal with a joint's state points to.
struct JointGoal {
  std::string name, frame;
  std::vector<char*> names;
  std::vector<double> position, effort;
};

void fill(control_msgs_action_dds__GripperCommand_Goal_& goal, JointGoal&, double position, double max_effort) {
  goal.command = {position, max_effort};
}

void fill(control_msgs_action_dds__ParallelGripperCommand_Goal_& goal, JointGoal& joint, double position,
          double max_effort) {
  joint.names = {joint.name.data()};
  joint.position = {position};
  joint.effort = {max_effort};
  goal.command.header.frame_id = joint.frame.data();
  goal.command.name = sequence_of<decltype(goal.command.name)>(joint.names);
  goal.command.position = sequence_of<decltype(goal.command.position)>(joint.position);
  goal.command.effort = sequence_of<decltype(goal.command.effort)>(joint.effort);
}

double position_of(const control_msgs_action_dds__GripperCommand_Result_& result) { return result.position; }

double position_of(const control_msgs_action_dds__ParallelGripperCommand_Result_& result) {
  const auto& positions = result.state.position;
  return positions._length > 0 ? positions._buffer[0] : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

/// How requests are sent and answers read.
struct GripperServices::Way {
  virtual ~Way() = default;
  virtual Status open(GripperServices& all) = 0;
  virtual void send_goal(const GoalId& id, double position, double max_effort) = 0;
  virtual void ask_result(const GoalId& id) = 0;
  virtual void cancel(const GoalId& id) = 0;
  virtual bool is_there() const = 0;
};

template <typename Messages>
struct GripperServices::WayOf final : Way {
  Status open(GripperServices& all) override {
    std::random_device random;
    client_ = static_cast<std::uint64_t>(random()) << 32 | random();
    joint_.name = all.joint_;
    const std::string base = all.action_ + "/_action/";
    if (Status s = keep(all.node_->publish<SendGoal>({base + "send_goal", Kind::kRequest, true}), goals_); !s) return s;
    if (Status s = keep(all.node_->publish<AskResult>({base + "get_result", Kind::kRequest, true}), questions_); !s) {
      return s;
    }
    if (Status s = keep(all.node_->publish<CancelGoal>({base + "cancel_goal", Kind::kRequest, true}), cancels_); !s) {
      return s;
    }
    auto answers = all.node_->subscribe<GoalAnswer>({base + "send_goal", Kind::kReply, true},
                                                    [this, &all](const GoalAnswer& answer, Ros2PublisherId) {
                                                      if (!belongs(answer, goal_)) return;
                                                      all.on_answer_(body_of<kNumbered>(answer).accepted);
                                                    });
    if (Status s = keep(std::move(answers), answers_); !s) return s;
    auto results = all.node_->subscribe<ResultAnswer>({base + "get_result", Kind::kReply, true},
                                                      [this, &all](const ResultAnswer& answer, Ros2PublisherId) {
                                                        if (!belongs(answer, question_)) return;
                                                        const auto& result = body_of<kNumbered>(answer).result;
                                                        all.on_result_(position_of(result), result.stalled);
                                                      });
    return keep(std::move(results), results_);
  }
  void send_goal(const GoalId& id, double position, double max_effort) override {
    SendGoal request{};
    body_of<kNumbered>(request).goal_id = message_of(id);
    fill(body_of<kNumbered>(request).goal, joint_, position, max_effort);
    send(goals_, request, goal_);
  }
  void ask_result(const GoalId& id) override {
    AskResult request{};
    body_of<kNumbered>(request).goal_id = message_of(id);
    send(questions_, request, question_);
  }
  void cancel(const GoalId& id) override {
    CancelGoal request{};
    body_of<kNumbered>(request).goal_info.goal_id = message_of(id);
    send(cancels_, request, cancel_);
  }
  bool is_there() const override {
    return goals_.subscribers() > 0 && questions_.subscribers() > 0 && cancels_.subscribers() > 0 &&
           !answers_.publishers().empty() && !results_.publishers().empty();
  }

 private:
  static constexpr bool kNumbered = Messages::kNumbered;
  using Kind = Ros2Topic::Kind;
  using SendGoal = typename Messages::SendGoal;
  using GoalAnswer = typename Messages::GoalAnswer;
  using AskResult = typename Messages::AskResult;
  using ResultAnswer = typename Messages::ResultAnswer;
  using CancelGoal = typename Messages::CancelGoal;

  template <typename Made>
  static Status keep(Result<Made> made, Made& kept) {
    if (!made) return made.error();
    kept = *std::move(made);
    return Done{};
  }
  template <typename Request>
  void send(Ros2Publisher<Request>& publisher, Request& request, std::atomic<std::int64_t>& number) {
    ++number;
    if constexpr (kNumbered) request.id = {client_, number};
    (void)publisher.send(request);
  }
  /// Whether it answers our newest request of this kind, as far as the message shows.
  template <typename Message>
  bool belongs(const Message& answer, const std::atomic<std::int64_t>& newest) const {
    if constexpr (kNumbered) {
      return answer.id.client == client_ && answer.id.number == newest;
    } else {
      return true;
    }
  }

  std::uint64_t client_ = 0;
  JointGoal joint_;
  std::atomic<std::int64_t> goal_{0}, question_{0}, cancel_{0};
  Ros2Publisher<SendGoal> goals_;
  Ros2Publisher<AskResult> questions_;
  Ros2Publisher<CancelGoal> cancels_;
  Ros2Subscription answers_, results_;
};

GripperServices::GripperServices(Ros2Node& node, std::string action, std::string joint, OnAnswer on_answer,
                                 OnResult on_result)
    : node_(&node),
      action_(std::move(action)),
      joint_(std::move(joint)),
      on_answer_(std::move(on_answer)),
      on_result_(std::move(on_result)) {}

GripperServices::~GripperServices() = default;

Status GripperServices::speak_to(int vendor, bool parallel) {
  const bool numbered = vendor == kCycloneDds;
  std::unique_ptr<Way>& way = ways_[parallel ? 1 : 0][numbered ? 1 : 0];
  if (!way) {
    std::unique_ptr<Way> made;
    if (parallel && numbered) {
      made = std::make_unique<WayOf<NumberedParallel>>();
    } else if (parallel) {
      made = std::make_unique<WayOf<PlainParallel>>();
    } else if (numbered) {
      made = std::make_unique<WayOf<Numbered>>();
    } else {
      made = std::make_unique<WayOf<Plain>>();
    }
    if (Status s = made->open(*this); !s) return s;
    way = std::move(made);
  }
  way_ = way.get();
  return Done{};
}

bool GripperServices::are_there() const { return way_ != nullptr && way_->is_there(); }

void GripperServices::send_goal(const GoalId& id, double position, double max_effort) {
  if (way_ != nullptr) way_->send_goal(id, position, max_effort);
}

void GripperServices::ask_result(const GoalId& id) {
  if (way_ != nullptr) way_->ask_result(id);
}

void GripperServices::cancel(const GoalId& id) {
  if (way_ != nullptr) way_->cancel(id);
}

}  // namespace steadyhand

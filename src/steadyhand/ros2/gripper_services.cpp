#include "steadyhand/ros2/gripper_services.hpp"

#include <atomic>
#include <random>
#include <utility>

namespace steadyhand {

namespace {

constexpr int kCycloneDds = 0x0110;

}  // namespace

/// How requests are sent and answers read.
struct GripperServices::Way {
  virtual ~Way() = default;
  virtual Status open(GripperServices& all) = 0;
  virtual void send(const SendGoalRequest& request) = 0;
  virtual void send(const GetResultRequest& request) = 0;
  virtual void send(const CancelGoalRequest& request) = 0;
  virtual bool is_there() const = 0;

 protected:
  template <typename Request>
  Status make(GripperServices& all, const char* service, Ros2Publisher<Request>& requests) {
    auto made = all.node_->publish<Request>({all.action_ + "/_action/" + service, Ros2Topic::Kind::kRequest, true});
    if (!made) return made.error();
    requests = *made;
    return Done{};
  }
  template <typename Answer, typename Hear>
  Status hear(GripperServices& all, const char* service, Ros2Subscription& answers, Hear hear) {
    auto made = all.node_->subscribe<Answer>({all.action_ + "/_action/" + service, Ros2Topic::Kind::kReply, true},
                                             [hear](const Answer& answer, Ros2PublisherId) { hear(answer); });
    if (!made) return made.error();
    answers = *made;
    return Done{};
  }
  Ros2Subscription answers_, results_;
};

/// Of Fast DDS and others: the writer of a request, and its number, stand beside the message.
struct GripperServices::PlainWay final : Way {
  Status open(GripperServices& all) override {
    if (Status s = make(all, "send_goal", goals_); !s) return s;
    if (Status s = make(all, "get_result", questions_); !s) return s;
    if (Status s = make(all, "cancel_goal", cancels_); !s) return s;
    if (Status s = hear<SendGoalResponse>(all, "send_goal", answers_,
                                          [&all](const SendGoalResponse& r) { all.on_answer_(r.accepted); });
        !s) {
      return s;
    }
    return hear<GetResultResponse>(all, "get_result", results_,
                                   [&all](const GetResultResponse& r) { all.on_result_(r.result); });
  }
  void send(const SendGoalRequest& request) override { (void)goals_.send(request); }
  void send(const GetResultRequest& request) override { (void)questions_.send(request); }
  void send(const CancelGoalRequest& request) override { (void)cancels_.send(request); }
  bool is_there() const override {
    return goals_.subscribers() > 0 && questions_.subscribers() > 0 && cancels_.subscribers() > 0 &&
           !answers_.publishers().empty() && !results_.publishers().empty();
  }

  Ros2Publisher<SendGoalRequest> goals_;
  Ros2Publisher<GetResultRequest> questions_;
  Ros2Publisher<CancelGoalRequest> cancels_;
};

/// Of Cyclone DDS.
struct GripperServices::NumberedWay final : Way {
  Status open(GripperServices& all) override {
    std::random_device random;
    client_ = static_cast<std::uint64_t>(random()) << 32 | random();
    if (Status s = make(all, "send_goal", goals_); !s) return s;
    if (Status s = make(all, "get_result", questions_); !s) return s;
    if (Status s = make(all, "cancel_goal", cancels_); !s) return s;
    if (Status s = hear<NumberedSendGoalResponse>(all, "send_goal", answers_,
                                                  [this, &all](const NumberedSendGoalResponse& r) {
                                                    if (belongs(r.id, goal_)) all.on_answer_(r.body.accepted);
                                                  });
        !s) {
      return s;
    }
    return hear<NumberedGetResultResponse>(all, "get_result", results_,
                                           [this, &all](const NumberedGetResultResponse& r) {
                                             if (belongs(r.id, question_)) all.on_result_(r.body.result);
                                           });
  }
  void send(const SendGoalRequest& request) override { (void)goals_.send({{client_, ++goal_}, request}); }
  void send(const GetResultRequest& request) override { (void)questions_.send({{client_, ++question_}, request}); }
  void send(const CancelGoalRequest& request) override { (void)cancels_.send({{client_, ++cancel_}, request}); }
  bool is_there() const override {
    return goals_.subscribers() > 0 && questions_.subscribers() > 0 && cancels_.subscribers() > 0 &&
           !answers_.publishers().empty() && !results_.publishers().empty();
  }
  /// To the newest request of this kind.
  bool belongs(const numbered_dds__RequestId_& id, const std::atomic<std::int64_t>& newest) const {
    return id.client == client_ && id.number == newest;
  }

  std::uint64_t client_ = 0;
  std::atomic<std::int64_t> goal_{0}, question_{0}, cancel_{0};
  Ros2Publisher<NumberedSendGoalRequest> goals_;
  Ros2Publisher<NumberedGetResultRequest> questions_;
  Ros2Publisher<NumberedCancelGoalRequest> cancels_;
};

GripperServices::GripperServices(Ros2Node& node, std::string action, OnAnswer on_answer, OnResult on_result)
    : node_(&node), action_(std::move(action)), on_answer_(std::move(on_answer)), on_result_(std::move(on_result)) {}

GripperServices::~GripperServices() = default;

Status GripperServices::speak_to(int vendor) {
  std::unique_ptr<Way>& way = vendor == kCycloneDds ? numbered_ : plain_;
  if (!way) {
    std::unique_ptr<Way> made;
    if (vendor == kCycloneDds) {
      made = std::make_unique<NumberedWay>();
    } else {
      made = std::make_unique<PlainWay>();
    }
    if (Status s = made->open(*this); !s) return s;
    way = std::move(made);
  }
  way_ = way.get();
  return Done{};
}

bool GripperServices::are_there() const { return way_ != nullptr && way_->is_there(); }

void GripperServices::send_goal(const GoalId& id, double position, double max_effort) {
  if (way_ != nullptr) way_->send(SendGoalRequest{message_of(id), {{position, max_effort}}});
}

void GripperServices::ask_result(const GoalId& id) {
  if (way_ != nullptr) way_->send(GetResultRequest{message_of(id)});
}

void GripperServices::cancel(const GoalId& id) {
  if (way_ != nullptr) way_->send(CancelGoalRequest{{message_of(id), {}}});
}

}  // namespace steadyhand

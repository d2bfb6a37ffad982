#include "steadyhand/arms/ros2/ros2_gripper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "steadyhand/arms/ros2/stamps.hpp"

namespace steadyhand {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr Time kBetweenGoals = std::chrono::milliseconds(100);
/// Time after a refusal, perhaps of another client's goal, in which a status may still report that ours is accepted.
constexpr Time kSecondWord = std::chrono::milliseconds(300);
constexpr double kSmallestMove = 0.01;  ///< share; less is the noise of a trigger
constexpr double kIsThere = 0.02;       ///< share, by which the first wanted position may differ from the gripper's
/// Values of action_msgs/GoalStatus.
constexpr int kAccepted = 1, kExecuting = 2, kSucceeded = 4, kCanceled = 5, kAborted = 6;

}  // namespace

Result<std::unique_ptr<Ros2Gripper>> Ros2Gripper::join(Ros2Node& node, const Ros2GripperSettings& settings,
                                                       const Clock& clock) {
  if (settings.open == settings.closed) {
    return Error{fmt::format("ros2.gripper_closed is {}, as ros2.gripper_open; the two must differ", settings.closed)};
  }
  std::unique_ptr<Ros2Gripper> gripper(new Ros2Gripper(node, settings, clock));
  const Ros2Topic::Kind topic = Ros2Topic::Kind::kTopic;
  auto status = node.subscribe<GoalStatusArrayMessage>(
      {settings.action + "/_action/status", topic, true},
      [g = gripper.get()](const GoalStatusArrayMessage& message, Ros2PublisherId) { g->hear(message); });
  if (!status) return status.error();
  gripper->status_ = *status;
  const Ros2Topic feedback(settings.action + "/_action/feedback", topic, true);
  Status listens = node.listen<GripperFeedbackMessage>(
      feedback,
      [g = gripper.get()](const GripperFeedbackMessage& m, Ros2PublisherId) { g->measured(m.feedback.position); });
  if (!listens) return listens.error();
  auto parallel = node.subscribe<ParallelFeedbackMessage>(
      feedback, [g = gripper.get()](const ParallelFeedbackMessage& m, Ros2PublisherId) {
        const auto& positions = m.feedback.state.position;
        if (positions._length > 0) g->measured(positions._buffer[0]);
      });
  if (!parallel) return parallel.error();
  gripper->parallel_ = *parallel;
  return gripper;
}

Ros2Gripper::Ros2Gripper(Ros2Node& node, const Ros2GripperSettings& settings, const Clock& clock)
    : settings_(settings),
      clock_(&clock),
      nobody_(fmt::format("no action server answers for the gripper at {}", settings.action)),
      several_(fmt::format("more than one action server answers for the gripper at {}", settings.action)),
      silent_(fmt::format("the gripper's action server at {} does not answer", settings.action)),
      rejected_(fmt::format("the gripper's action server at {} rejected a goal", settings.action)),
      gave_up_(fmt::format("the gripper's action server at {} gave up a goal", settings.action)),
      taken_over_(fmt::format("another program sends goals to the gripper at {}", settings.action)),
      services_(
          node, settings.action, settings.joint, [this](bool accepted) { hear_answer(accepted); },
          [this](double position, bool stalled) { hear_result(position, stalled); }),
      position_(kNone),
      wanted_(kNone) {}

void Ros2Gripper::move_to(double closed) {
  if (std::isfinite(closed)) wanted_.store(std::clamp(closed, 0.0, 1.0), std::memory_order_relaxed);
}

std::optional<double> Ros2Gripper::position() const {
  const double share = position_.load(std::memory_order_relaxed);
  return std::isnan(share) ? std::nullopt : std::optional(share);
}

void Ros2Gripper::measured(double position) {
  if (!std::isfinite(position)) return;
  const double share = (position - settings_.open) / (settings_.closed - settings_.open);
  position_.store(std::clamp(share, 0.0, 1.0), std::memory_order_relaxed);
}

std::string_view Ros2Gripper::why_not() const {
  const Health there = there_.load(std::memory_order_relaxed), health = health_.load(std::memory_order_relaxed);
  switch (health != Health::kFine ? health : there) {
    case Health::kFine:
      return {};
    case Health::kNobody:
      return nobody_;
    case Health::kSeveral:
      return several_;
    case Health::kSilent:
      return silent_;
    case Health::kRejected:
      return rejected_;
    case Health::kGaveUp:
      return gave_up_;
    case Health::kTakenOver:
      return taken_over_;
  }
  return {};
}

void Ros2Gripper::restart() {
  wanted_ = kNone;
  restart_ = true;
}

// ---------------------------------------------------------------------------------------------- threads of DDS

void Ros2Gripper::hear(const GoalStatusArrayMessage& message) {
  const std::lock_guard lock(mutex_);
  if (!goal_) return;
  const auto& list = message.status_list;
  for (std::uint32_t i = 0; i < list._length; ++i) {
    const auto& entry = list._buffer[i];
    if (goal_id_of(entry.goal_info.goal_id) != goal_->id) continue;
    goal_->answered = true;
    goal_->accepted_at = time_of(entry.goal_info.stamp);
    goal_->status = entry.status;
  }
  for (std::uint32_t i = 0; i < list._length && goal_->accepted_at; ++i) {
    const auto& entry = list._buffer[i];
    const bool active = entry.status == kAccepted || entry.status == kExecuting;
    const bool ours = ids_.owns(goal_id_of(entry.goal_info.goal_id));
    if (active && !ours && time_of(entry.goal_info.stamp) > *goal_->accepted_at) others_ = true;
  }
}

void Ros2Gripper::hear_answer(bool accepted) {
  const std::lock_guard lock(mutex_);
  if (!goal_) return;
  goal_->answered = true;
  if (!accepted && !goal_->refused) goal_->refused = clock_->now();
}

void Ros2Gripper::hear_result(double position, bool stalled) {
  measured(position);
  const std::lock_guard lock(mutex_);
  if (!goal_ || !goal_->asked_result || goal_->over) return;
  goal_->over = true;
  // A held object stops the fingers before their goal: that is a grip, even if the controller reports it as aborted.
  if (goal_->status == kAborted && !stalled) health_ = Health::kGaveUp;
}

// ---------------------------------------------------------------------------------------------- the thread that sends

/// Whether a server would answer requests, by discovery.
Ros2Gripper::Health Ros2Gripper::presence() {
  const std::vector<int> servers = status_.publishers();
  if (servers.empty()) return Health::kNobody;
  if (servers.size() > 1) return Health::kSeveral;
  if (Status s = services_.speak_to(servers.front(), !parallel_.publishers().empty()); !s) return Health::kNobody;
  return services_.are_there() ? Health::kFine : Health::kNobody;
}

void Ros2Gripper::talk() {
  const Time now = clock_->now();
  if (restart_.exchange(false) && health_ != Health::kFine) begin_anew();
  there_ = presence();
  if (there_ != Health::kFine) {
    const std::lock_guard lock(mutex_);
    if (goal_ && health_ == Health::kFine) health_.store(there_);  // no server reports its result any more
    return;
  }
  look_after_goal(now);
  const double wanted = wanted_;
  if (health_ != Health::kFine || std::isnan(wanted) || now - last_sent_ < kBetweenGoals) return;
  if (!told_) {
    const double is = position_;
    const bool asked_before = last_sent_ > Time(0);
    if (!asked_before && std::abs(is - wanted) < kIsThere) told_ = wanted;  // false for NaN
  }
  const bool end = wanted == 0.0 || wanted == 1.0;
  if (told_ && std::abs(wanted - *told_) < (end ? std::numeric_limits<double>::min() : kSmallestMove)) return;
  want(wanted, now);
}

void Ros2Gripper::begin_anew() {
  const std::lock_guard lock(mutex_);
  goal_.reset();
  others_ = false;
  told_.reset();
  health_ = Health::kFine;
}

void Ros2Gripper::want(double closed, Time now) {
  const GoalId id = ids_.next();
  {
    const std::lock_guard lock(mutex_);
    goal_.emplace();
    goal_->id = id;
    goal_->sent = now;
  }
  told_ = closed;
  last_sent_ = now;
  services_.send_goal(id, settings_.open + closed * (settings_.closed - settings_.open), settings_.max_effort);
}

/// Follows up the newest goal only: it replaced those before it.
void Ros2Gripper::look_after_goal(Time now) {
  std::optional<GoalId> cancels, asks;
  {
    const std::lock_guard lock(mutex_);
    if (!goal_ || health_ != Health::kFine) return;
    GripperGoal& goal = *goal_;
    const Time patience = from_seconds(settings_.timeout);
    if (others_ || goal.status == kCanceled) {
      health_ = Health::kTakenOver;
    } else if (goal.over) {
      return;
    } else if (goal.refused && !goal.accepted_at && now - *goal.refused > kSecondWord) {
      health_ = Health::kRejected;
    } else if (!goal.answered && now - goal.sent > patience) {
      health_ = Health::kSilent;
      cancels = goal.id;
    } else if ((goal.status == kSucceeded || goal.status == kAborted) && !goal.asked_result) {
      goal.asked_result = now;
      asks = goal.id;
    } else if (goal.asked_result && now - *goal.asked_result > patience) {
      goal.over = true;
      if (goal.status == kAborted) health_ = Health::kGaveUp;
    }
  }
  if (cancels) services_.cancel(*cancels);
  if (asks) services_.ask_result(*asks);
}

}  // namespace steadyhand

#include "steadyhand/arms/ros2/ros2_feedback.hpp"

#include <fmt/format.h>

#include <utility>

#include "steadyhand/arms/ros2/stamps.hpp"

namespace steadyhand {

namespace {

/// If a joint state's stamp is off the expected one by more than this, a clock was set.
constexpr Time kClockJump = std::chrono::milliseconds(50);
/// Time beyond ros2.state_timeout without a report from the controller, after which it counts as not active; Humble's
/// reports at 50 Hz.
constexpr Time kActive = std::chrono::milliseconds(200);
constexpr double kFullSpeed = 99.9;  // %
/// For this time, a state that could not be used is the reason for missing states.
constexpr Time kUnusable = std::chrono::seconds(1);
constexpr double kSpeedFilter = 0.02;  ///< s, over which speeds are taken from positions, where the arm sends none
constexpr std::string_view kNotRealTime =
    "the stamps of the joint states do not advance in real time: run the simulation at a real-time factor of 1";

}  // namespace

Ros2Feedback::Ros2Feedback(const Ros2Settings& settings, const Clock& clock, const std::vector<std::string>& names,
                           const std::string& topic)
    : clock_(&clock),
      state_timeout_(from_seconds(settings.state_timeout)),
      no_controller_(fmt::format("no controller listens to {}", topic)),
      not_active_(fmt::format("the controller {} is not active", settings.controller)),
      seldom_(fmt::format("joint states from {} have less than {:.0f} Hz: raise the controller manager's "
                          "update_rate, or ros2.state_timeout and ros2.look_ahead",
                          settings.joint_states, 1.0 / settings.state_timeout)),
      joints_(names),
      told_joints_(names) {
  for (int i = 0; i < kJointStateFaults; ++i)
    state_faults_[i] = describe(static_cast<JointStateFault>(i), settings.joint_states);
}

void Ros2Feedback::receive(const JointStateMessage& message, Ros2PublisherId publisher, int controllers) {
  const Time arrival = clock_->now();
  const auto unusable = [&](JointStateFault fault) {
    state_fault_ = fault;
    state_fault_at_ = arrival;
  };
  Received news = newest_;
  JointVector speeds;
  const JointStateFault fault = read_joint_state(message, joints_, news.q, speeds);
  if (fault == JointStateFault::kOtherJoints) return;
  if (fault != JointStateFault::kNone) return unusable(fault);
  news.theirs = time_of(message.header.stamp);
  news.arrival = arrival;

  const bool silent = arrival - newest_.arrival > state_timeout_;
  if (publisher != state_publisher_ && state_publisher_ != 0 && !silent) {
    trouble_ = Trouble::kTwoStatePublishers;
    return;
  }
  const bool follows = following_.load(std::memory_order_relaxed);
  if (publisher != state_publisher_) offset_.reset();
  if (publisher == state_publisher_ && news.theirs <= newest_.theirs) {
    if (newest_.theirs == news.theirs) unusable(JointStateFault::kSameStamp);
    if (newest_.theirs - news.theirs < kClockJump) return;  // overtaken on its way
    clock_jumped(follows);
  } else if (publisher == state_publisher_ && newest_.offset - (arrival - news.theirs) > kClockJump) {
    clock_jumped(follows);
  }
  const bool same_publisher = publisher == state_publisher_ && state_publisher_ != 0;
  take_speeds(speeds, same_publisher, news);
  if (!news.dq.allFinite()) return unusable(JointStateFault::kNotFinite);  // positions too far apart for a number
  const bool set = newest_.arrival - newest_.theirs - (arrival - news.theirs) > kClockJump;
  if (!same_publisher || silent || set) pace_ = {};
  news.off_pace = pace_.update(news.theirs, arrival);
  news.gap = same_publisher ? arrival - newest_.arrival : Time(0);
  state_publisher_ = publisher;
  news.offset = offset_.update(news.theirs, arrival, !follows) - news.theirs;
  news.controllers = controllers;
  newest_ = news;
  received_news_.write(news);
}

/// Or the first state that came had been long on its way, which only a state that took less time shows. Before the arm
/// follows neither does harm.
void Ros2Feedback::clock_jumped(bool follows) {
  offset_.reset();
  if (follows) trouble_ = Trouble::kClockJumped;
}

/// Where the arm sends none, they are differences of positions, smoothed.
void Ros2Feedback::take_speeds(const JointVector& sent, bool same_publisher, Received& news) const {
  const double dt = to_seconds(news.theirs - newest_.theirs);
  if (sent.size() > 0) {
    news.dq = sent;
  } else if (same_publisher && dt > 0.0) {
    news.dq = newest_.dq + dt / (dt + kSpeedFilter) * ((news.q - newest_.q) / dt - newest_.dq);
  } else {
    news.dq.setZero(news.q.size());
  }
}

void Ros2Feedback::receive(const ControllerStateMessage& message) {
  Told& told = newest_told_;
  told.arrival = clock_->now();
  told.theirs = time_of(message.header.stamp);
  told.q.resize(0);
  const std::uint32_t count = message.joint_names._length;
  const dds_sequence_double& q = message.reference.positions;
  if (told_joints_.find({message.joint_names._buffer, count}) && q._length == count) {
    told.q.resize(static_cast<Eigen::Index>(told_joints_.names().size()));
    for (int i = 0; i < told.q.size(); ++i) told.q[i] = q._buffer[told_joints_[i]];
  }
  told_news_.write(told);
}

void Ros2Feedback::receive(const Float64Message& speed_scaling) { slowed_down_ = !(speed_scaling.data >= kFullSpeed); }

bool Ros2Feedback::update() {
  received_before_ = received_;
  (void)told_news_.read(told_);
  if (!received_news_.read(received_)) return false;
  return known_ = true;
}

bool Ros2Feedback::states_are_recent() const { return known_ && clock_->now() - received_.arrival <= state_timeout_; }

std::string_view Ros2Feedback::why_no_states() const {
  const Time at = state_fault_at_;
  const Time after = known_ ? received_.arrival + state_timeout_ / 2 : Time(0);
  const bool unusable = at > after && clock_->now() - at <= kUnusable;
  if (!unusable && known_ && received_.gap > state_timeout_) return seldom_;
  return state_faults_[static_cast<std::size_t>(unusable ? state_fault_.load() : JointStateFault::kOtherJoints)];
}

std::string_view Ros2Feedback::why_not() const {
  if (received_.off_pace && clock_->now() - received_.arrival <= kUnusable) return kNotRealTime;
  switch (trouble_.load(std::memory_order_relaxed)) {
    case Trouble::kTwoStatePublishers:
      return "two publishers send states of this arm's joints";
    case Trouble::kTwoCommanders:
      return "another program sends trajectories to the controller";
    case Trouble::kClockJumped:
      return "the clock of the controller's machine was set";
    case Trouble::kThrew:
      return "the part of the program that talks to ROS 2 failed";
    case Trouble::kNone:
      break;
  }
  if (!states_are_recent()) return why_no_states();
  if (received_.controllers == 0) return no_controller_;
  if (slowed_down_.load(std::memory_order_relaxed)) {
    return "the arm's speed scaling is not 100 %: set its speed slider to that, and start its program";
  }
  if (clock_->now() - told_.arrival > state_timeout_ + kActive) return not_active_;
  return {};
}

}  // namespace steadyhand

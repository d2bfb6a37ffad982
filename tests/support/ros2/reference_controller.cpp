#include "support/ros2/reference_controller.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/arms/ros2/stamps.hpp"

namespace steadyhand {

namespace {

constexpr double kPause = 0.4;  ///< s without trajectories that is meant: nothing was lost

std::vector<double> list(const dds_sequence_double& values) {
  return {values._buffer, values._buffer + values._length};
}

JointTrajectory read(const JointTrajectoryMessage& message) {
  JointTrajectory t;
  t.stamp = std::chrono::seconds(message.header.stamp.sec) + Time(message.header.stamp.nanosec);
  for (std::uint32_t i = 0; i < message.joint_names._length; ++i) {
    t.joints.emplace_back(message.joint_names._buffer[i]);
  }
  for (std::uint32_t i = 0; i < message.points._length; ++i) {
    const JointTrajectoryPointMessage& point = message.points._buffer[i];
    t.points.push_back({std::chrono::seconds(point.time_from_start.sec) + Time(point.time_from_start.nanosec),
                        list(point.positions), list(point.velocities), list(point.accelerations)});
  }
  return t;
}

}  // namespace

Result<std::unique_ptr<ReferenceController>> ReferenceController::make(const RobotModel& model, const JointVector& q,
                                                                       const Settings& settings) {
  Settings complete = settings;
  complete.parameters.period = from_seconds(1.0 / settings.rate_hz);
  complete.parameters.joints.clear();
  for (const Joint& joint : model.joints) complete.parameters.joints.push_back(settings.prefix + joint.name);
  std::unique_ptr<ReferenceController> made(new ReferenceController(model, q, complete));
  if (Status joined = made->join(); !joined) return joined.error();
  return made;
}

ReferenceController::ReferenceController(const RobotModel& model, const JointVector& q, const Settings& settings)
    : settings_(settings), model_(model), controller_(settings.parameters), now_(settings.epoch) {
  model_.velocity_max *= settings.hardware_speed;
  model_.acceleration_max *= settings.hardware_acceleration;
  desired_ = {q, JointVector::Zero(q.size()), JointVector::Zero(q.size())};
  thaw();
  if (settings.active) controller_.activate(q);
}

ReferenceController::~ReferenceController() { stop(); }

/// Replaces the arm by one at its last commanded position.
void ReferenceController::thaw() {
  SimulatedArmSettings arm;
  arm.rate_hz = settings_.rate_hz;
  arm.latency = 0.0;
  arm.servo_lag = settings_.servo_lag;
  arm.start_time = 0.0;
  arm_ = std::make_unique<SimulatedArm>(model_, desired_.q, arm, arm_clock_);
}

Status ReferenceController::join() {
  auto node = Ros2Node::open(settings_.domain);
  if (!node) return node.error();
  auto states = (*node)->publish<JointStateMessage>(settings_.joint_states);
  if (!states) return states.error();
  states_ = *states;
  auto controller_states = (*node)->publish<ControllerStateMessage>(settings_.controller + "/controller_state");
  if (!controller_states) return controller_states.error();
  controller_states_ = *controller_states;
  if (!settings_.speed_scaling.empty()) {
    auto speed_scaling = (*node)->publish<Float64Message>(settings_.speed_scaling);
    if (!speed_scaling) return speed_scaling.error();
    speed_scaling_ = *speed_scaling;
  }
  Status listens = (*node)->listen<JointTrajectoryMessage>(
      settings_.controller + "/joint_trajectory",
      [this](const JointTrajectoryMessage& message, Ros2PublisherId) { hear(message); });
  if (!listens) return listens.error();
  node_ = std::move(*node);
  return Done{};
}

/// On a thread of DDS.
void ReferenceController::hear(const JointTrajectoryMessage& message) {
  if (unplugged_ > 0 || deaf_ > 0) return;
  JointTrajectory trajectory = read(message);
  const std::lock_guard lock(mutex_);
  last_trajectory_ = trajectory;
  const double since = static_cast<double>(cycle_now_ - last_came_) * period();
  const auto missing = std::max(0L, std::lround(since / settings_.expected_every) - 1);
  if (since < kPause) lost_ += static_cast<std::uint64_t>(missing);
  last_came_ = cycle_now_;
  incoming_.emplace_back(cycle_now_ + static_cast<std::uint64_t>(lag_), std::move(trajectory));
}

JointTrajectory ReferenceController::last_trajectory() const {
  const std::lock_guard lock(mutex_);
  return last_trajectory_;
}

void ReferenceController::take_in() {
  const std::lock_guard lock(mutex_);
  while (!incoming_.empty() && incoming_.front().first <= cycle_) {
    const std::string why = controller_.accept(incoming_.front().second, now_);
    incoming_.pop_front();
    ++(why.empty() ? accepted_ : refused_);
    if (!why.empty()) last_refusal_ = why;
  }
}

void ReferenceController::measure(const JointTrajectoryController::State& desired) {
  const double dt = period();
  const auto largest = [](double& sofar, const JointVector& step) {
    sofar = std::max(sofar, step.cwiseAbs().maxCoeff());
  };
  if (past_.size() == 2) {
    const JointTrajectoryController::State &before = past_[0], &last = past_[1];
    largest(largest_.q, desired.q - last.q);
    largest(largest_.dq, (desired.q - 2.0 * last.q + before.q) / dt);
    largest_.ddq = largest_.dq / dt;
    largest(largest_.position_step, desired.q - last.q - 0.5 * dt * (desired.dq + last.dq));
    largest(largest_.speed_step, desired.dq - last.dq);
    past_.erase(past_.begin());
  }
  past_.push_back(desired);
}

void ReferenceController::stop_or_unlock() {
  if (protective_asked_.exchange(false)) {
    arm_->trip("protective stop");
    locked_ = true;
    if (settings_.stopper) controller_.deactivate();
  }
  if (unlock_asked_.exchange(false)) {
    arm_->restart();
    locked_ = false;
    last_stop_.clear();
    if (settings_.stopper) controller_.activate(arm_->q());
  }
  const int asked = activity_asked_.exchange(0);
  if (asked > 0) controller_.activate(arm_->q());
  if (asked < 0) controller_.deactivate();
}

void ReferenceController::step() {
  ++cycle_;
  cycle_now_ = cycle_;
  now_ += from_seconds(period());
  if (frozen_ > 0) {
    ++slept_;
    if (--frozen_ == 0) thaw();
    return;
  }
  stop_or_unlock();
  const ArmState state = arm_->receive();
  take_in();
  if (controller_.active()) {
    controller_.scale(scaling_);
    const JointVector before = desired_.q;
    desired_ = controller_.update(now_, from_seconds((1 + slept_) * period()), state.joints.q, state.joints.dq);
    slept_ = 0;
    if (desired_.q == before) desired_.dq = desired_.ddq = JointVector::Zero(before.size());  // not written again
    measure(desired_);
  } else {
    past_.clear();
  }
  if (state.status == ArmStatus::kStopped) {
    last_stop_ = state.reason;
  } else {
    arm_->send({{state.joints.stamp.made, state.joints.stamp.made}, desired_.q, desired_.dq, desired_.ddq});
  }
  if (!controller_.aborted().empty()) last_stop_ = controller_.aborted();
  if (unplugged_ > 0) {
    --unplugged_;
  } else if (cycle_ % static_cast<std::uint64_t>(settings_.states_every) == 0) {
    const Time paced = settings_.epoch + from_seconds(settings_.pace * to_seconds(now_ - settings_.epoch));
    const Time stamp = settings_.stamp.value_or(settings_.pace == 1.0 ? now_ : paced);
    outgoing_.emplace_back(cycle_ + static_cast<std::uint64_t>(lag_), std::pair(stamp, state.joints));
  }
  if (deaf_ > 0) --deaf_;
  send_states();
  tell();
}

/// Publishes the controller's messages while it is active, and the speed scaling of the hardware.
void ReferenceController::tell() {
  if (unplugged_ > 0) return;
  std::string frame;
  ControllerStateMessage message{};
  message.header.stamp = stamp_of<builtin_interfaces_msg_dds__Time_>(now_);
  message.header.frame_id = frame.data();
  std::vector<char*> names;
  for (const std::string& name : settings_.parameters.joints) names.push_back(const_cast<char*>(name.c_str()));
  message.joint_names = sequence_of<decltype(message.joint_names)>(names);
  JointVector q = controller_.reference().q;
  message.reference.positions._buffer = q.data();
  message.reference.positions._length = message.reference.positions._maximum = static_cast<std::uint32_t>(q.size());
  if (controller_.active()) (void)controller_states_.send(message);
  if (!settings_.speed_scaling.empty()) (void)speed_scaling_.send({100.0 * scaling_});
}

void ReferenceController::send_states() {
  while (!outgoing_.empty() && outgoing_.front().first <= cycle_) {
    auto [stamp, joints] = outgoing_.front().second;
    outgoing_.pop_front();
    std::vector<std::string> names = settings_.parameters.joints;
    joints.q *= settings_.told_positions;
    joints.dq *= settings_.told_speeds;
    std::vector<double> q(joints.q.begin(), joints.q.end()), dq(joints.dq.begin(), joints.dq.end());
    if (settings_.permuted) {
      for (auto* values : {&q, &dq}) std::reverse(values->begin(), values->end());
      std::reverse(names.begin(), names.end());
    }
    if (hidden_) {
      names.pop_back();
      q.pop_back();
      dq.pop_back();
    }
    std::vector<char*> pointers;
    for (std::string& name : names) pointers.push_back(name.data());
    std::string frame;
    JointStateMessage message{};
    message.header.stamp = {static_cast<std::int32_t>(stamp / std::chrono::seconds(1)),
                            static_cast<std::uint32_t>((stamp % std::chrono::seconds(1)).count())};
    message.header.frame_id = frame.data();
    message.name = sequence_of<decltype(message.name)>(pointers);
    message.position = sequence_of<decltype(message.position)>(q);
    message.velocity = sequence_of<decltype(message.velocity)>(dq);
    (void)states_.send(message);
  }
}

void ReferenceController::run() {
  running_ = true;
  thread_ = std::thread([this] {
    MonotonicClock clock;
    const Time cycle = from_seconds(period());
    for (Time next = clock.now() + cycle; running_; next += cycle) {
      clock.sleep_until(next);
      step();  // missed cycles run one after the other: the only clock is the count of cycles
    }
  });
}

void ReferenceController::stop() {
  running_ = false;
  if (thread_.joinable()) thread_.join();
}

}  // namespace steadyhand

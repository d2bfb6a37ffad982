#include "steadyhand/arms/ros2/ros2_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "steadyhand/arms/ros2/stamps.hpp"
#include "steadyhand/arms/ros2/trajectory.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

namespace {

constexpr double kStanding = 0.02;  ///< rad/s, measured, below which an arm counts as standing ...
constexpr Time kStands =
    std::chrono::milliseconds(300);  ///< ... after so long: servos have come to where they were led
constexpr double kOnPlan = 1e-6;     ///< rad, rad/s, between a command and its plan: rounding only
/// Stamps of joint states that are that much ahead of what they were expected to be: somebody set a clock.
constexpr Time kClockJump = std::chrono::milliseconds(50);
/// Before the oldest command that is still to be executed, in what is sent: the controller stands there by the time.
constexpr Time kMargin = std::chrono::milliseconds(20);
/// s beyond ros2.state_timeout without a word from the controller after which it counts as not active; Humble's tells
/// at 50 Hz.
constexpr double kActive = 0.2;
/// The controller's set-point may be off by so much, and by what the joints do in so long.
constexpr double kSetPointError = 0.001;  // rad
constexpr double kSetPointTime = 0.0015;  // s
constexpr double kFullSpeed = 99.9;       // %
constexpr double kStep = 0.004;           ///< rad, from one state to the next, beyond what ...
constexpr double kStepTime = 0.004;       ///< ... the joints may do in the time between and so long
/// For so long a state that could not be used explains that none came.
constexpr Time kUnusable = std::chrono::seconds(1);
constexpr double kSpeedFilter = 0.02;  ///< s, over which speeds are taken from positions, where the arm sends none
constexpr std::string_view kNotRealTime =
    "the stamps of the joint states do not advance in real time: run the simulation at a real-time factor of 1";
constexpr Time kGripperTurn = std::chrono::milliseconds(10);
constexpr Time kSpeedCounts = std::chrono::milliseconds(200);  ///< of commands, in what the joints do now
/// The controller knows why, its topics do not tell.
constexpr std::string_view kOffPath =
    "the arm is not where its commands lead: stopped protectively, held up, or slowed down at its controller";

dds_sequence_double numbers(JointVector& values) {
  dds_sequence_double sequence{};
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(values.size());
  sequence._buffer = values.data();
  return sequence;
}

bool same(const JointCommand& a, const JointCommand& b) {
  return a.q.size() == b.q.size() && (a.q - b.q).cwiseAbs().maxCoeff() <= kOnPlan &&
         (a.dq - b.dq).cwiseAbs().maxCoeff() <= kOnPlan;
}

}  // namespace

Ros2Arm::Order& Ros2Arm::Order::operator=(const Order& other) {
  count = other.count;
  std::copy_n(other.commands.begin(), count, commands.begin());
  plan = other.plan;
  begin = other.begin;
  offset = other.offset;
  return *this;
}

Result<std::unique_ptr<Ros2Arm>> Ros2Arm::make(const RobotModel& model, const Ros2Settings& s, Clock& clock) {
  auto names = ros2_joint_names(model, s);
  if (!names) return names.error();
  if (!(s.state_timeout + 1.0 / s.rate_hz < s.look_ahead)) {
    return Error{fmt::format(
        "ros2.look_ahead is {} s; it must be more than ros2.state_timeout and the time between two trajectories "
        "together, {:.4g} s: otherwise what was held up on its way would still be sent, too late",
        s.look_ahead, s.state_timeout + 1.0 / s.rate_hz)};
  }
  if ((s.look_ahead + to_seconds(kMargin)) * s.control_rate_hz > Order::kCommands) {
    return Error{fmt::format("ros2.look_ahead is {} s; at {} Hz it can be {:.4g} s at most", s.look_ahead,
                             s.control_rate_hz, Order::kCommands / s.control_rate_hz - to_seconds(kMargin))};
  }
  const Result<int> domain = ros2_domain(s.domain);
  if (!domain) return domain.error();
  std::unique_ptr<Ros2Arm> arm(new Ros2Arm(model, s, clock, *std::move(names)));
  if (Status joined = arm->join(*domain); !joined) return joined.error();
  return arm;
}

Result<std::unique_ptr<Ros2Arm>> Ros2Arm::without_thread(const RobotModel& model, const Ros2Settings& settings,
                                                         Clock& clock) {
  return make(model, settings, clock);
}

Result<std::unique_ptr<Ros2Arm>> Ros2Arm::connect(const RobotModel& model, const Ros2Settings& settings, Clock& clock) {
  auto arm = make(model, settings, clock);
  if (!arm) return arm.error();
  (*arm)->running_ = true;
  (*arm)->speaker_ = std::thread([a = arm->get()] { a->speak(); });
  if ((*arm)->gripper_) (*arm)->gripper_keeper_ = std::thread([a = arm->get()] { a->keep_gripper(); });
  return arm;
}

Ros2Arm::Ros2Arm(const RobotModel& model, const Ros2Settings& settings, Clock& clock, std::vector<std::string> names)
    : model_(&model),
      settings_(settings),
      clock_(&clock),
      period_(from_seconds(1.0 / settings.control_rate_hz)),
      look_ahead_(from_seconds(settings.look_ahead)),
      cycles_per_order_(std::max(1, static_cast<int>(std::lround(settings.control_rate_hz / settings.rate_hz)))),
      phase_since_(clock.now()),
      check_(model),
      joints_(names),
      told_joints_(std::move(names)) {
  state_.joints = {{clock.now(), clock.now()}, model.home, JointVector::Zero(model.dof())};
  for (const std::string& name : joints_.names()) letter_.names.push_back(const_cast<char*>(name.c_str()));
}

Status Ros2Arm::join(int domain) {
  auto node = Ros2Node::open(domain, settings_.realtime, [this](const char*) { trouble_ = Trouble::kThrew; });
  if (!node) return node.error();
  const std::string topic = settings_.controller + "/joint_trajectory";
  info_ = {fmt::format("{} (ROS 2 domain {}, {})", model_->name, domain, topic), model_->dof(),
           settings_.control_rate_hz, settings_.look_ahead + settings_.servo_delay};
  for (int i = 0; i < kJointStateFaults; ++i)
    state_faults_[i] = describe(static_cast<JointStateFault>(i), settings_.joint_states);
  seldom_ = fmt::format(
      "joint states come from {} at less than {:.0f} Hz: raise the controller manager's update_rate, or "
      "ros2.state_timeout and ros2.look_ahead",
      settings_.joint_states, 1.0 / settings_.state_timeout);
  for (int i = 0; i < model_->dof(); ++i) {
    beyond_limits_.push_back(
        fmt::format("joint '{}' is beyond its position limits, {:.4g} to {:.4g}: move it back first",
                    joints_.names()[i], model_->position_min[i], model_->position_max[i]));
  }
  no_controller_ = fmt::format("no controller listens to {}", topic);
  not_active_ = fmt::format("the controller {} is not active", settings_.controller);
  auto trajectories =
      (*node)->publish<JointTrajectoryMessage>(topic, from_seconds(settings_.look_ahead - 1.0 / settings_.rate_hz));
  if (!trajectories) return trajectories.error();
  trajectories_ = *trajectories;
  Status listens = (*node)->listen<JointStateMessage>(
      settings_.joint_states, [this](const JointStateMessage& message, Ros2PublisherId publisher) {
        hear_gripper(message);
        receive(message, publisher);
      });
  if (!listens) return listens.error();
  listens = (*node)->listen<JointTrajectoryMessage>(
      topic, [this](const JointTrajectoryMessage&, Ros2PublisherId) { trouble_ = Trouble::kTwoCommanders; });
  if (!listens) return listens.error();
  listens = (*node)->listen<ControllerStateMessage>(
      settings_.controller + "/controller_state",
      [this](const ControllerStateMessage& message, Ros2PublisherId) { receive(message); });
  if (!listens) return listens.error();
  if (!settings_.speed_scaling.empty()) {
    listens = (*node)->listen<Float64Message>(
        settings_.speed_scaling,
        [this](const Float64Message& message, Ros2PublisherId) { slowed_down_ = !(message.data >= kFullSpeed); });
    if (!listens) return listens.error();
  }
  if (model_->gripper_time && !settings_.gripper.action.empty()) {
    auto gripper = Ros2Gripper::join(**node, settings_.gripper, *clock_);
    if (!gripper) return gripper.error();
    gripper_ = *std::move(gripper);
    info_.gripper = true;
  }
  node_ = std::move(*node);
  return Done{};
}

Ros2Arm::~Ros2Arm() {
  running_ = false;
  ++posted_;
  posted_.notify_one();
  if (speaker_.joinable()) speaker_.join();
  if (gripper_keeper_.joinable()) gripper_keeper_.join();
}

Result<JointVector> Ros2Arm::wait_for_states() {
  const Time until = clock_->now() + from_seconds(settings_.start_within);
  while (!received_news_.read(received_)) {
    if (clock_->now() > until)
      return Error{std::string(why_no_states()) + " (domain, topic and names are settings: ros2.*)"};
    clock_->sleep_until(clock_->now() + period_);
  }
  while (gripper_ && !gripper_->why_not().empty()) {
    if (clock_->now() > until) {
      return Error{
          fmt::format("{}: start its controller, name its action with ros2.gripper, or leave it alone with an "
                      "empty one",
                      gripper_->why_not())};
    }
    clock_->sleep_until(clock_->now() + period_);
  }
  known_ = true;
  moved_ = clock_->now();
  return received_.q;
}

// ---------------------------------------------------------------------------------------------- the thread that
// listens

/// Whoever publishes it: a gripper's driver may do that for itself.
void Ros2Arm::hear_gripper(const JointStateMessage& message) {
  if (!gripper_ || settings_.gripper.joint.empty() || message.position._length != message.name._length) return;
  for (std::uint32_t i = 0; i < message.name._length; ++i) {
    if (settings_.gripper.joint == message.name._buffer[i]) gripper_->measured(message.position._buffer[i]);
  }
}

/// States of other joints are not for us. Of ours that cannot be used the fault is kept.
void Ros2Arm::receive(const JointStateMessage& message, Ros2PublisherId publisher) {
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

  const bool silent = arrival - newest_.arrival > from_seconds(settings_.state_timeout);
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
  news.controllers = trajectories_.subscribers();
  newest_ = news;
  received_news_.write(news);
}

/// Or the first state that came had been long on its way, which only a state that took less time shows. Before the arm
/// follows neither does harm.
void Ros2Arm::clock_jumped(bool follows) {
  offset_.reset();
  if (follows) trouble_ = Trouble::kClockJumped;
}

/// Where the arm sends none, they are differences of positions, smoothed.
void Ros2Arm::take_speeds(const JointVector& sent, bool same_publisher, Received& news) const {
  const double dt = to_seconds(news.theirs - newest_.theirs);
  if (sent.size() > 0) {
    news.dq = sent;
  } else if (same_publisher && dt > 0.0) {
    news.dq = newest_.dq + dt / (dt + kSpeedFilter) * ((news.q - newest_.q) / dt - newest_.dq);
  } else {
    news.dq.setZero(news.q.size());
  }
}

void Ros2Arm::receive(const ControllerStateMessage& message) {
  Told& told = newest_told_;
  told.arrival = clock_->now();
  told.theirs = time_of(message.header.stamp);
  told.q.resize(0);
  const std::uint32_t count = message.joint_names._length;
  const dds_sequence_double& q = message.reference.positions;
  if (told_joints_.find({message.joint_names._buffer, count}) && q._length == count) {
    told.q.resize(model_->dof());
    for (int i = 0; i < model_->dof(); ++i) told.q[i] = q._buffer[told_joints_[i]];
  }
  told_news_.write(told);
}

// ---------------------------------------------------------------------------------------------- the thread that speaks

void Ros2Arm::speak() {
  if (settings_.realtime) prefer_this_thread();
  for (int seen = 0; running_;) {
    posted_.wait(seen);
    seen = posted_;
    if (running_) talk();
  }
}

void Ros2Arm::keep_gripper() {
  while (running_) {
    try {
      gripper_->talk();
    } catch (const std::exception&) {
      trouble_ = Trouble::kThrew;
    }
    std::this_thread::sleep_for(kGripperTurn);
  }
}

/// What it throws is a reason to stop, not the program's end.
void Ros2Arm::talk() {
  try {
    write_letter();
    if (gripper_ && !gripper_keeper_.joinable()) gripper_->talk();
  } catch (const std::exception&) {
    trouble_ = Trouble::kThrew;
  }
}

void Ros2Arm::write_letter() {
  if (!orders_.read(letter_order_)) return;
  const Order& order = letter_order_;
  make_trajectory({order.commands.data(), static_cast<std::size_t>(order.count)}, order.plan, letter_.points);
  letter_.messages.resize(letter_.points.size());
  for (std::size_t i = 0; i < letter_.points.size(); ++i) {
    JointCommand& point = letter_.points[i];
    letter_.messages[i] = {};
    letter_.messages[i].positions = numbers(point.q);
    letter_.messages[i].velocities = numbers(point.dq);
    letter_.messages[i].accelerations = numbers(point.ddq);
    letter_.messages[i].time_from_start =
        stamp_of<builtin_interfaces_msg_dds__Duration_>(point.stamp.made - order.begin);
  }
  JointTrajectoryMessage message{};
  message.header.stamp = stamp_of<builtin_interfaces_msg_dds__Time_>(order.begin + look_ahead_ - order.offset);
  message.header.frame_id = letter_.frame.data();
  message.joint_names = sequence_of<decltype(message.joint_names)>(letter_.names);
  message.points = sequence_of<decltype(message.points)>(letter_.messages);
  (void)trajectories_.send(message);  // one that does not get away is made good by the next
}

// ---------------------------------------------------------------------------------------------- the control thread

ArmState Ros2Arm::receive() {
  keep_time();
  received_before_ = received_;
  if (received_news_.read(received_) && !std::exchange(known_, true)) moved_ = state_.joints.stamp.made;
  (void)told_news_.read(told_);
  if (known_) {
    state_.joints.q = received_.q;
    state_.joints.dq = received_.dq;
    if (!states_are_recent()) state_.joints.dq.setZero();
    if (!(state_.joints.dq.cwiseAbs().maxCoeff() < kStanding)) moved_ = state_.joints.stamp.made;
  }
  if (gripper_) state_.joints.gripper = gripper_->position();
  if (phase_ != Phase::kStopped) proceed();
  if (phase_ == Phase::kStopped && lets_go_ && why_not().empty() && standing()) {
    lets_go_ = false;
    hold_here();
  }
  carry_on();
  following_.store(phase_ == Phase::kFollowing, std::memory_order_relaxed);
  state_.status = phase_ == Phase::kFollowing ? ArmStatus::kFollowing
                  : phase_ == Phase::kStopped ? ArmStatus::kStopped
                                              : ArmStatus::kStarting;
  return state_;
}

/// A cycle a period, by our clock: controllers send states when they like.
void Ros2Arm::keep_time() {
  const Time last = state_.joints.stamp.made;
  const Time start = state_.cycle == 0 ? clock_->now() : last;
  const auto late = std::max(Time(0), clock_->now() - start - period_) / period_;
  const Time now = start + (late + 1) * period_;
  clock_->sleep_until(now);
  state_.joints.stamp = {now, now};
  state_.cycle += static_cast<std::uint64_t>(late + 1);
  if (state_.cycle == 1) phase_since_ = now;
}

bool Ros2Arm::states_are_recent() const {
  return known_ && clock_->now() - received_.arrival <= from_seconds(settings_.state_timeout);
}

bool Ros2Arm::standing() const { return state_.joints.stamp.made - moved_ > kStands; }

bool Ros2Arm::long_ago(double seconds) const { return to_seconds(state_.joints.stamp.made - phase_since_) > seconds; }

/// Why there are none that could be used now.
std::string_view Ros2Arm::why_no_states() const {
  const Time at = state_fault_at_;
  const Time after = known_ ? received_.arrival + from_seconds(0.5 * settings_.state_timeout) : Time(0);
  const bool unusable = at > after && clock_->now() - at <= kUnusable;
  if (!unusable && known_ && received_.gap > from_seconds(settings_.state_timeout)) return seldom_;
  return state_faults_[static_cast<std::size_t>(unusable ? state_fault_.load() : JointStateFault::kOtherJoints)];
}

/// Why the arm may not begin or go on; empty: it may.
std::string_view Ros2Arm::why_not() const {
  if (received_.off_pace && clock_->now() - received_.arrival <= kUnusable) return kNotRealTime;
  switch (trouble_.load(std::memory_order_relaxed)) {
    case Trouble::kTwoStatePublishers:
      return "two publishers send states of this arm's joints";
    case Trouble::kTwoCommanders:
      return "somebody else sends trajectories to the controller";
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
  if (to_seconds(clock_->now() - told_.arrival) > settings_.state_timeout + kActive) return not_active_;
  return {};
}

void Ros2Arm::proceed() {
  std::string_view why = why_not();
  if (why.empty() && gripper_) why = gripper_->why_not();
  switch (phase_) {
    case Phase::kWaiting:
      if (why.empty() && standing()) return begin_settling();
      if (long_ago(settings_.start_within)) stop(why.empty() ? "the arm is not at rest: something moves it" : why);
      return;
    case Phase::kSettling:
      if (!why.empty()) return stop(why);
      if ((state_.joints.q - settled_at_).cwiseAbs().maxCoeff() > settings_.start_tolerance) {
        return stop("the arm moved when its controller took over: it was not where the controller wanted it");
      }
      if (!long_ago(settings_.settle + settings_.look_ahead)) return;
      phase_ = Phase::kFollowing;
      check_.restart();
      order_.count = sent_count_ = 0;
      cycles_since_order_ = cycles_per_order_;
      phase_since_ = last_command_ = state_.joints.stamp.made;
      return;
    case Phase::kFollowing:
      lets_go_ = true;  // whatever stops it now, the controller is not to take up again what it has
      if (!why.empty()) return stop(why);
      if (off_path()) return stop(kOffPath);
      if (misled()) return stop("the controller does not execute what it was sent: slowed down, or led by others");
      if (stepped()) return stop("the joints stepped: they moved further than they were told to");
      lets_go_ = false;
      if (to_seconds(state_.joints.stamp.made - last_command_) > settings_.command_timeout) {
        stop("no command came in time");
      }
      return;
    case Phase::kStopped:
      return;
  }
}

/// Through cycles that we slept through the controller goes on along what it was sent. Until it has executed all
/// commands there is time to send it the newest plan; then it follows the plan that came with the last trajectory, and
/// what comes next has to begin there.
void Ros2Arm::carry_on() {
  state_.carried_on.reset();
  if (phase_ != Phase::kFollowing || sent_count_ == 0) return;
  const Time now = state_.joints.stamp.made, last = sent_[newest_sent_].stamp.made;
  if (now - period_ - last < period_ / 2) return;
  const bool executed = now - look_ahead_ + kMargin > last;  // by the time that what is sent now arrives
  const Plan& plan = executed ? order_.plan : plan_;
  const int unsent = executed ? std::min(cycles_since_order_, order_.count) : 0;
  order_.count -= unsent;
  for (Time t = last + (1 - unsent) * period_; t < now - period_ / 2; t += period_) {
    const JointCommand own = sample(plan, t);
    order(own, now);
    if (t <= last) continue;
    remember(own);
    check_.take(own);
  }
  cycles_since_order_ = cycles_per_order_;
  state_.carried_on = sent_[newest_sent_];
}

void Ros2Arm::remember(const JointCommand& command) {
  newest_sent_ = (newest_sent_ + 1) % kSent;
  sent_[newest_sent_] = command;
  sent_count_ = std::min(sent_count_ + 1, kSent);
}

/// What is executed by `now`, and arrives late at that, goes.
void Ros2Arm::order(const JointCommand& command, Time now) {
  const auto keep = std::find_if(order_.commands.begin(), order_.commands.begin() + order_.count,
                                 [&](const JointCommand& c) { return c.stamp.made >= now - look_ahead_ - kMargin; });
  const auto gone = keep - order_.commands.begin();
  std::move(keep, order_.commands.begin() + order_.count, order_.commands.begin());
  order_.count = std::min(order_.count - static_cast<int>(gone), Order::kCommands - 1);
  order_.commands[order_.count++] = command;
}

/// Whether the arm was measured elsewhere than where it should have been by then. Stamps tell when it was measured: on
/// the way to us they may have been held up.
bool Ros2Arm::off_path() const {
  const JointCommand expected = commanded(received_.theirs + received_.offset - from_seconds(info_.delay));
  return expected.q.size() > 0 && (received_.q - expected.q).cwiseAbs().maxCoeff() > settings_.path_tolerance;
}

/// Whether the controller's own set-point is another than that time's: it sets its trajectory time to now with each
/// trajectory that comes; slowed down it would crawl in between, and jump.
bool Ros2Arm::misled() const {
  const JointCommand expected = commanded(told_.theirs + received_.offset - look_ahead_);
  if (expected.q.size() == 0 || told_.q.size() == 0) return false;
  const double most = kSetPointError + kSetPointTime * expected.dq.cwiseAbs().maxCoeff();
  return !((told_.q - expected.q).cwiseAbs().maxCoeff() <= most);
}

/// Whether a joint moved further, from one state to the next, than the speeds explain at which it was commanded lately.
bool Ros2Arm::stepped() const {
  const double dt = to_seconds(received_.theirs - received_before_.theirs);
  if (dt <= 0.0 || sent_count_ == 0) return false;
  const Time since = received_.theirs + received_.offset - look_ahead_ - kSpeedCounts;
  JointVector fastest = JointVector::Zero(received_.q.size()), fastest_back = fastest;
  for (int age = 0; age < sent_count_; ++age) {
    const JointCommand& command = sent_[(newest_sent_ - age + kSent) % kSent];
    if (command.stamp.made < since) break;
    fastest = fastest.cwiseMax(command.dq);
    fastest_back = fastest_back.cwiseMin(command.dq);
  }
  const JointVector moved = received_.q - received_before_.q;
  return (moved - (dt + kStepTime) * fastest).maxCoeff() > kStep ||
         ((dt + kStepTime) * fastest_back - moved).maxCoeff() > kStep;
}

/// What the controller was to execute a lead after `then`; of size 0 if that is before the first command. Beyond the
/// newest one it goes on along the plan that it was sent last.
JointCommand Ros2Arm::commanded(Time then) const {
  if (sent_count_ > 0 && then > sent_[newest_sent_].stamp.made + period_) return sample(order_.plan, then);
  for (int age = 0; age < sent_count_; ++age) {
    const JointCommand& command = sent_[(newest_sent_ - age + kSent) % kSent];
    if (command.stamp.made > then) continue;
    JointCommand expected = command;
    expected.q += to_seconds(then - command.stamp.made) * command.dq;
    return expected;
  }
  return {};
}

void Ros2Arm::begin_settling() {
  const JointVector& q = state_.joints.q;
  for (int i = 0; i < q.size(); ++i)
    if (q[i] < model_->position_min[i] || q[i] > model_->position_max[i]) return stop(beyond_limits_[i]);
  settled_at_ = q;
  hold_here();
  phase_ = Phase::kSettling;
  phase_since_ = state_.joints.stamp.made;
}

/// The controller is to hold the arm where it stands, whatever it wanted before; without a step.
void Ros2Arm::hold_here() {
  const JointVector& q = state_.joints.q;
  const Time now = state_.joints.stamp.made, then = now + from_seconds(settings_.settle);
  const JointVector zero = JointVector::Zero(q.size());
  order_.count = 1;
  order_.commands[0] = {{then, then}, q, zero, zero};
  stand(q, then, order_.plan);
  post(now - look_ahead_);
}

void Ros2Arm::send(const JointCommand& command) {
  if (phase_ != Phase::kFollowing) return;
  if (const std::string_view why = check_.refusal(command, state_.joints.q); !why.empty()) return stop(why);
  const Time now = command.stamp.made;
  const JointCommand on_plan = sample(plan_, now);
  if (!same(on_plan, command)) return stop("a command is not on the plan that was checked");
  last_command_ = state_.joints.stamp.made;
  if (gripper_ && command.gripper) gripper_->move_to(*command.gripper);
  remember(command);
  order({command.stamp, command.q, command.dq, on_plan.ddq}, now);
  if (++cycles_since_order_ < cycles_per_order_) return;
  cycles_since_order_ = 0;
  order_.plan = plan_;
  post(std::min(order_.commands[0].stamp.made, now - look_ahead_));
}

/// Hands the order to the thread that speaks.
void Ros2Arm::post(Time begin) {
  order_.begin = begin;
  order_.offset = received_.offset;
  orders_.write(order_);
  ++posted_;
  posted_.notify_one();
}

/// No motion is sent any more: the controller goes on to the end of what it has, where the arm rests.
void Ros2Arm::stop(std::string_view reason) {
  state_.reason = reason;
  state_.status = ArmStatus::kStopped;
  phase_ = Phase::kStopped;
}

void Ros2Arm::restart() {
  phase_ = Phase::kWaiting;
  phase_since_ = state_.joints.stamp.made;
  state_.reason = {};
  lets_go_ = false;
  trouble_ = Trouble::kNone;
  if (gripper_) gripper_->restart();
}

}  // namespace steadyhand

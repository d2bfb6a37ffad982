#include "steadyhand/arms/ros2/ros2_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/arms/driver/clocked_arm.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

namespace {

using Trouble = Ros2Feedback::Trouble;

constexpr double kStanding = 0.02;  ///< rad/s, measured, below which an arm counts as stationary ...
constexpr Time kStands = std::chrono::milliseconds(300);  ///< ... after this time: servos have reached their set-points
constexpr double kOnPlan = 1e-6;                          ///< rad, rad/s, between a command and its plan: rounding only
/// A trajectory begins this long before the oldest command that is still to be executed: the controller is there when
/// it arrives.
constexpr Time kMargin = std::chrono::milliseconds(20);
/// The controller's set-point may differ by kSetPointError, and by how far the joints move in kSetPointTime.
constexpr double kSetPointError = 0.001;  // rad
constexpr double kSetPointTime = 0.0015;  // s
constexpr double kStep = 0.004;           ///< rad, from one state to the next, beyond how far ...
constexpr double kStepTime = 0.004;       ///< ... the joints may move in the time between them plus this
constexpr Time kGripperTurn = std::chrono::milliseconds(10);
constexpr Time kSpeedCounts = std::chrono::milliseconds(200);  ///< of commands, in what the joints do now
/// The controller's topics do not report the cause.
constexpr std::string_view kOffPath =
    "the arm is not at its commanded position: protective stop, obstruction, or reduced speed at its controller";

bool same(const JointCommand& a, const JointCommand& b) {
  return a.q.size() == b.q.size() && (a.q - b.q).cwiseAbs().maxCoeff() <= kOnPlan &&
         (a.dq - b.dq).cwiseAbs().maxCoeff() <= kOnPlan;
}

}  // namespace

Result<std::unique_ptr<Ros2Arm>> Ros2Arm::make(const RobotModel& model, const Ros2Settings& s, Clock& clock) {
  auto names = ros2_joint_names(model, s);
  if (!names) return names.error();
  if (!(s.state_timeout + 1.0 / s.rate_hz < s.look_ahead)) {
    return Error{fmt::format(
        "ros2.look_ahead is {} s; it must be more than ros2.state_timeout and the time between two trajectories "
        "together, {:.4g} s: otherwise commands after a delay would still be sent, too late",
        s.look_ahead, s.state_timeout + 1.0 / s.rate_hz)};
  }
  if ((s.look_ahead + to_seconds(kMargin)) * s.control_rate_hz > TrajectoryOrder::kCommands) {
    return Error{fmt::format("ros2.look_ahead is {} s; at {} Hz it can be {:.4g} s at most", s.look_ahead,
                             s.control_rate_hz, TrajectoryOrder::kCommands / s.control_rate_hz - to_seconds(kMargin))};
  }
  const Result<int> domain = ros2_domain(s.domain);
  if (!domain) return domain.error();
  std::unique_ptr<Ros2Arm> arm(new Ros2Arm(model, s, clock, *names));
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

Ros2Arm::Ros2Arm(const RobotModel& model, const Ros2Settings& settings, Clock& clock,
                 const std::vector<std::string>& names)
    : model_(&model),
      settings_(settings),
      clock_(&clock),
      period_(from_seconds(1.0 / settings.control_rate_hz)),
      look_ahead_(from_seconds(settings.look_ahead)),
      cycles_per_order_(std::max(1, static_cast<int>(std::lround(settings.control_rate_hz / settings.rate_hz)))),
      feedback_(settings, clock, names, settings.controller + "/joint_trajectory"),
      sender_(names),
      phase_since_(clock.now()),
      check_(model) {
  state_.joints = {{clock.now(), clock.now()}, model.home, JointVector::Zero(model.dof())};
  for (int i = 0; i < model.dof(); ++i) {
    beyond_limits_.push_back(
        fmt::format("joint '{}' is beyond its position limits, {:.4g} to {:.4g}: move it back first", names[i],
                    model.position_min[i], model.position_max[i]));
  }
}

Status Ros2Arm::join(int domain) {
  auto node = Ros2Node::open(domain, settings_.realtime, [this](const char*) { feedback_.fail(Trouble::kThrew); });
  if (!node) return node.error();
  const std::string topic = settings_.controller + "/joint_trajectory";
  info_ = {fmt::format("{} (ROS 2 domain {}, {})", model_->name, domain, topic), model_->dof(),
           settings_.control_rate_hz, settings_.look_ahead + settings_.servo_delay};
  Status opened = sender_.open(**node, topic, from_seconds(settings_.look_ahead - 1.0 / settings_.rate_hz));
  if (!opened) return opened;
  Status listens = (*node)->listen<JointStateMessage>(
      settings_.joint_states, [this](const JointStateMessage& message, Ros2PublisherId publisher) {
        hear_gripper(message);
        feedback_.receive(message, publisher, sender_.subscribers());
      });
  if (!listens) return listens.error();
  listens = (*node)->listen<JointTrajectoryMessage>(
      topic, [this](const JointTrajectoryMessage&, Ros2PublisherId) { feedback_.fail(Trouble::kTwoCommanders); });
  if (!listens) return listens.error();
  listens = (*node)->listen<ControllerStateMessage>(
      settings_.controller + "/controller_state",
      [this](const ControllerStateMessage& message, Ros2PublisherId) { feedback_.receive(message); });
  if (!listens) return listens.error();
  if (!settings_.speed_scaling.empty()) {
    listens = (*node)->listen<Float64Message>(
        settings_.speed_scaling,
        [this](const Float64Message& message, Ros2PublisherId) { feedback_.receive(message); });
    if (!listens) return listens.error();
  }
  const PerTool<bool> grippers = grippers_of(*model_);
  gripper_tool_ = static_cast<int>(std::find(grippers.begin(), grippers.end(), true) - grippers.begin());
  if (gripper_tool_ < kMaxTools && !settings_.gripper.action.empty()) {
    if (std::count(grippers.begin(), grippers.end(), true) > 1) {
      return Error{
          fmt::format("robot '{}' has two grippers, and ros2.gripper names the action of one; give each arm "
                      "its own driver (--arm), or set ros2.gripper to nothing",
                      model_->name)};
    }
    auto gripper = Ros2Gripper::join(**node, settings_.gripper, *clock_);
    if (!gripper) return gripper.error();
    gripper_ = *std::move(gripper);
    info_.gripper[gripper_tool_] = true;
  }
  node_ = std::move(*node);
  return Done{};
}

Ros2Arm::~Ros2Arm() {
  running_ = false;
  sender_.wake();
  if (speaker_.joinable()) speaker_.join();
  if (gripper_keeper_.joinable()) gripper_keeper_.join();
}

Result<JointVector> Ros2Arm::wait_for_states() {
  const Time until = clock_->now() + from_seconds(settings_.start_within);
  while (!feedback_.update()) {
    if (clock_->now() > until)
      return Error{std::string(feedback_.why_no_states()) + " (domain, topic and names are settings: ros2.*)"};
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
  moved_ = clock_->now();
  return feedback_.state().q;
}

// ---------------------------------------------------------------------------------------------- the thread that
// listens

/// Takes its joint from any publisher: a gripper's driver may publish on its own.
void Ros2Arm::hear_gripper(const JointStateMessage& message) {
  if (!gripper_ || settings_.gripper.joint.empty() || message.position._length != message.name._length) return;
  for (std::uint32_t i = 0; i < message.name._length; ++i) {
    if (settings_.gripper.joint == message.name._buffer[i]) gripper_->measured(message.position._buffer[i]);
  }
}

// ---------------------------------------------------------------------------------------------- the thread that speaks

void Ros2Arm::speak() {
  if (settings_.realtime) prefer_this_thread();
  for (int seen = 0; running_;) {
    seen = sender_.wait(seen);
    if (running_) talk();
  }
}

void Ros2Arm::keep_gripper() {
  while (running_) {
    try {
      gripper_->talk();
    } catch (const std::exception&) {
      feedback_.fail(Trouble::kThrew);
    }
    std::this_thread::sleep_for(kGripperTurn);
  }
}

/// An exception in it stops the arm, not the program.
void Ros2Arm::talk() {
  try {
    sender_.send_newest();
    if (gripper_ && !gripper_keeper_.joinable()) gripper_->talk();
  } catch (const std::exception&) {
    feedback_.fail(Trouble::kThrew);
  }
}

// ---------------------------------------------------------------------------------------------- the control thread

ArmState Ros2Arm::receive() {
  keep_time();
  if (const bool known = feedback_.known(); feedback_.update() && !known) moved_ = state_.joints.stamp.made;
  if (feedback_.known()) {
    state_.joints.q = feedback_.state().q;
    state_.joints.dq = feedback_.state().dq;
    if (!feedback_.states_are_recent()) state_.joints.dq.setZero();
    if (!(state_.joints.dq.cwiseAbs().maxCoeff() < kStanding)) moved_ = state_.joints.stamp.made;
  }
  if (gripper_) state_.joints.gripper[gripper_tool_] = gripper_->position();
  if (phase_ != Phase::kStopped) proceed();
  if (phase_ == Phase::kStopped && lets_go_ && feedback_.why_not().empty() && standing()) {
    lets_go_ = false;
    hold_here();
  }
  carry_on();
  feedback_.set_following(phase_ == Phase::kFollowing);
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

bool Ros2Arm::standing() const { return state_.joints.stamp.made - moved_ > kStands; }

bool Ros2Arm::long_ago(double seconds) const { return to_seconds(state_.joints.stamp.made - phase_since_) > seconds; }

void Ros2Arm::proceed() {
  std::string_view why = feedback_.why_not();
  if (why.empty() && gripper_) why = gripper_->why_not();
  switch (phase_) {
    case Phase::kWaiting:
      if (why.empty() && standing()) return begin_settling();
      if (long_ago(settings_.start_within)) stop(why.empty() ? "the arm is not stationary: something moves it" : why);
      return;
    case Phase::kSettling:
      if (!why.empty()) return stop(why);
      if ((state_.joints.q - settled_at_).cwiseAbs().maxCoeff() > settings_.start_tolerance) {
        return stop("the arm moved when its controller took over: it was not where the controller wanted it");
      }
      if (!long_ago(settings_.settle + settings_.look_ahead)) return;
      phase_ = Phase::kFollowing;
      check_.restart();
      order_.count = 0;
      sent_.clear();
      cycles_since_order_ = cycles_per_order_;
      phase_since_ = last_command_ = state_.joints.stamp.made;
      return;
    case Phase::kFollowing:
      lets_go_ = true;  // for any stop below: the controller must not resume its trajectory
      if (!why.empty()) return stop(why);
      if (off_path()) return stop(kOffPath);
      if (misled())
        return stop("the controller does not execute its trajectories: reduced speed, or commands of another program");
      if (stepped()) return stop("the joints jumped: they moved further than commanded");
      lets_go_ = false;
      if (to_seconds(state_.joints.stamp.made - last_command_) > settings_.command_timeout) {
        stop("no command arrived in time");
      }
      return;
    case Phase::kStopped:
      return;
  }
}

/// In cycles that we missed, the controller continues along its last trajectory. Until it has executed all commands,
/// there is time to send it the newest plan. After that it follows the plan of its last trajectory, and the next one
/// must begin there.
void Ros2Arm::carry_on() {
  state_.carried_on.reset();
  if (phase_ != Phase::kFollowing || sent_.empty()) return;
  const Time now = state_.joints.stamp.made, last = sent_[0].stamp.made;
  if (now - period_ - last < period_ / 2) return;
  const bool executed = now - look_ahead_ + kMargin > last;  // by the time that what is sent now arrives
  const Plan& plan = executed ? order_.plan : plan_;
  const int unsent = executed ? std::min(cycles_since_order_, order_.count) : 0;
  order_.count -= unsent;
  for (Time t = last + (1 - unsent) * period_; t < now - period_ / 2; t += period_) {
    const JointCommand own = sample(plan, t);
    order(own, now);
    if (t <= last) continue;
    sent_.add(own);
    check_.take(own);
  }
  cycles_since_order_ = cycles_per_order_;
  state_.carried_on = sent_[0];
}

/// Appends `command`, and drops those that were executed more than kMargin before `now`.
void Ros2Arm::order(const JointCommand& command, Time now) {
  const auto keep = std::find_if(order_.commands.begin(), order_.commands.begin() + order_.count,
                                 [&](const JointCommand& c) { return c.stamp.made >= now - look_ahead_ - kMargin; });
  const auto gone = keep - order_.commands.begin();
  std::move(keep, order_.commands.begin() + order_.count, order_.commands.begin());
  order_.count = std::min(order_.count - static_cast<int>(gone), TrajectoryOrder::kCommands - 1);
  order_.commands[order_.count++] = command;
}

/// Whether the measured position is off the commanded one by more than path_tolerance, at the time of the state's
/// stamp: the message may be delayed on its way to us.
bool Ros2Arm::off_path() const {
  const Ros2Feedback::Received& state = feedback_.state();
  const JointCommand expected = commanded(state.theirs + state.offset - from_seconds(info_.delay));
  return expected.q.size() > 0 && (state.q - expected.q).cwiseAbs().maxCoeff() > settings_.path_tolerance;
}

/// Whether the controller's own set-point is another than that time's: it sets its trajectory time to now with each
/// trajectory that comes; slowed down it would crawl in between, and jump.
bool Ros2Arm::misled() const {
  const Ros2Feedback::Told& told = feedback_.told();
  const JointCommand expected = commanded(told.theirs + feedback_.state().offset - look_ahead_);
  if (expected.q.size() == 0 || told.q.size() == 0) return false;
  const double most = kSetPointError + kSetPointTime * expected.dq.cwiseAbs().maxCoeff();
  return !((told.q - expected.q).cwiseAbs().maxCoeff() <= most);
}

/// Whether a joint moved further, from one state to the next, than the speeds explain at which it was commanded lately.
bool Ros2Arm::stepped() const {
  const Ros2Feedback::Received &state = feedback_.state(), &before = feedback_.state_before();
  const double dt = to_seconds(state.theirs - before.theirs);
  if (dt <= 0.0 || sent_.empty()) return false;
  const Time since = state.theirs + state.offset - look_ahead_ - kSpeedCounts;
  JointVector fastest = JointVector::Zero(state.q.size()), fastest_back = fastest;
  for (int age = 0; age < sent_.count() && sent_[age].stamp.made >= since; ++age) {
    fastest = fastest.cwiseMax(sent_[age].dq);
    fastest_back = fastest_back.cwiseMin(sent_[age].dq);
  }
  const JointVector moved = state.q - before.q;
  return (moved - (dt + kStepTime) * fastest).maxCoeff() > kStep ||
         ((dt + kStepTime) * fastest_back - moved).maxCoeff() > kStep;
}

/// The command that the controller was to execute look_ahead_ after `then`; of size 0 if that is before the first
/// command. Beyond the newest command it is on the plan that was sent last.
JointCommand Ros2Arm::commanded(Time then) const {
  if (!sent_.empty() && then > sent_[0].stamp.made + period_) return sample(order_.plan, then);
  return sent_.at(then);
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

/// Replaces the controller's motion: it is to hold the arm at its present position, without a step.
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
  if (gripper_ && command.gripper[gripper_tool_]) gripper_->move_to(*command.gripper[gripper_tool_]);
  sent_.add(command);
  order({command.stamp, command.q, command.dq, on_plan.ddq}, now);
  if (++cycles_since_order_ < cycles_per_order_) return;
  cycles_since_order_ = 0;
  order_.plan = plan_;
  post(std::min(order_.commands[0].stamp.made, now - look_ahead_));
}

/// Hands the order to the thread that speaks.
void Ros2Arm::post(Time begin) {
  order_.begin = begin;
  order_.executes = begin + look_ahead_ - feedback_.state().offset;
  sender_.post(order_);
}

/// Sends no more motion: the controller continues to the end of its trajectory, where the arm is at rest.
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
  feedback_.forget_trouble();
  if (gripper_) gripper_->restart();
}

}  // namespace steadyhand

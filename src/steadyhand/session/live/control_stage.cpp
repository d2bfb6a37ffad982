#include "steadyhand/session/live/control_stage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "steadyhand/planning/plan/return_to_plan.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"

namespace steadyhand {

namespace {

/// Largest difference between the followed plan and the next one where that begins: rounding only.
constexpr double kContinuity = 1e-6;  // rad, rad/s (m, m/s)
/// Measured speed below which an arm that stopped by itself counts as stationary.
constexpr double kAtRest = 0.02;  // rad/s (m/s)
/// After missed cycles the arm returns to its plan in two parts of so many intervals of make_return each; the shortest
/// return that passes the check is taken.
constexpr int kReturns[] = {1, 2, 3, 4, 6, 9, 13};
/// If none passes, the arm stops straight in this time, unless the planner takes over before.
constexpr double kEasy = 0.2;  // s
/// Commands remembered for each cycle: ours, and that of an arm that continued by itself.
constexpr double kEachCycle = 2.0;
constexpr Time kWishWaits = std::chrono::seconds(5);  ///< how long a gripper request waits for the arm
constexpr std::size_t kAtLeast = 16;

bool same(const JointCommand& a, const JointCommand& b, double tolerance) {
  return (a.q - b.q).cwiseAbs().maxCoeff() <= tolerance && (a.dq - b.dq).cwiseAbs().maxCoeff() <= tolerance;
}

/// Position at time t between two commands: the cubic through their positions and speeds.
JointVector between(const JointCommand& a, const JointCommand& b, Time t) {
  const double h = to_seconds(b.stamp.made - a.stamp.made), s = to_seconds(t - a.stamp.made) / h;
  const double rest = 1.0 - s;
  return rest * rest * ((1.0 + 2.0 * s) * a.q + s * h * a.dq) + s * s * ((1.0 + 2.0 * rest) * b.q - rest * h * b.dq);
}

/// True if no joint becomes faster than the plan's profile allows, or than it is at the start.
bool keeps_to_profile(const Plan& plan) {
  if (plan.velocity_max.size() == 0) return true;
  const JointVector most = plan.velocity_max.cwiseMax(plan.x[0].tail(plan.joints).cwiseAbs());
  for (int k = 1; k <= plan.intervals; ++k) {
    if ((plan.x[k].tail(plan.joints).cwiseAbs() - most).maxCoeff() > kContinuity) return false;
  }
  return true;
}

Time end_of(const Plan& plan) { return plan.start + from_seconds(plan.intervals * plan.dt); }

}  // namespace

ControlStage::ControlStage(const RobotModel& model, const ControlSettings& settings, Links& links)
    : settings_(settings),
      links_(&links),
      kinematics_(model),
      supervisors_(model.tools.size(), Supervisor(settings.supervisor)),
      tracker_(model.home),
      history_(static_cast<std::size_t>(kEachCycle * settings.arm_delay * settings.check.command_rate_hz) + kAtLeast) {}

/// The tool whose state is that of the whole robot.
const Supervisor& ControlStage::foremost() const {
  for (const SupervisionState state : {SupervisionState::kEngaged, SupervisionState::kHolding}) {
    for (const Supervisor& supervisor : supervisors_) {
      if (supervisor.state() == state) return supervisor;
    }
  }
  return supervisors_.front();
}

const ControlStage::Output& ControlStage::step(const ArmState& state) {
  const Time now = state.joints.stamp.made;
  output_.follows = nullptr;
  const bool first = view_.cycles == 0;
  const std::uint64_t missed = first ? 0 : state.cycle - last_cycle_ - 1;
  last_cycle_ = state.cycle;
  if (first) anchor(state.joints.q, now);
  if (state.carried_on) resume(*state.carried_on);
  (void)links_->hands.read(hands_);
  take_obstacles(now);
  take_plan(now);

  const SupervisionState before = this->state();
  supervise(state, missed);
  const SupervisionState after = this->state();
  output_.restart_arm = before != SupervisionState::kIdle && after == SupervisionState::kIdle;
  halt(state, after);
  for (int t = 0; t < std::ssize(supervisors_); ++t) {
    if (taken_[t] == nullptr) continue;
    if (taken_[t]->to == SupervisionState::kEngaged) last_hand_counted_ = now;
    const bool fresh_grip = taken_[t]->from == SupervisionState::kReady && taken_[t]->to == SupervisionState::kEngaged;
    if (fresh_grip || output_.restart_arm) ++links_->refills[t];  // both begin with a full glass
  }
  const bool arm_fault = after == SupervisionState::kFault && !input_.arm_follows && !state.part_follows;
  const bool shadows =
      after == SupervisionState::kIdle || arm_fault || (taken_[0] != nullptr && before == SupervisionState::kIdle);
  if (shadows && state.joints.q.allFinite()) anchor(state.joints.q, now);

  output_.command = tracker_.update(now);
  for (int t = 0; t < std::ssize(supervisors_); ++t) {
    if (settings_.gripper[t]) take_gripper(t, state.joints);
    output_.command.gripper[t] = grippers_[t].command;
  }
  remember(output_.command);
  // The arm stops a little after its commands. A client that takes it over where it is must find it stationary.
  const Time until_held_off = held_off_ ? from_seconds(settings_.arm_delay) : Time(0);  // then it may give way
  const bool told_to_rest = !has_pending_ && now >= end_of(tracker_.plan()) + until_held_off;
  at_rest_ = (told_to_rest || arm_fault) && state.joints.dq.cwiseAbs().maxCoeff() < kAtRest;
  publish(state, missed);
  return output_;
}

/// Decides for each tool what it may do.
void ControlStage::supervise(const ArmState& state, std::uint64_t missed) {
  SupervisionInput& input = input_;
  input.now = state.joints.stamp.made;
  input.arm_follows = state.status == ArmStatus::kFollowing;
  input.arm_stopped = state.status == ArmStatus::kStopped || !state.joints.q.allFinite();
  input.arm_reason = state.status == ArmStatus::kStopped ? state.reason : "the arm reports no numbers";
  const char* failure = links_->failure;
  input.failure = failure == nullptr ? std::string_view() : failure;
  input.at_rest = at_rest_;
  input.stops = links_->asked.stops;
  input.reset_of = links_->asked.reset_of;
  stop_asked_ = input.stops != supervisors_.front().stops();
  input.off_path = off_path(state.joints);
  input.stalled = missed >= settings_.stall_cycles;
  input.last_plan = last_plan_;
  PerTool<bool> lost{}, silent{};
  const int tools = static_cast<int>(supervisors_.size());
  for (int t = 0; t < tools && settings_.supervisor.together; ++t) {
    input.hand = hands_[t];
    lost[t] = supervisors_[t].loses_hand(input);
    silent[t] = supervisors_[t].misses_device(input);
  }
  for (int t = 0; t < tools; ++t) {
    input.hand = hands_[t];
    input.other_lost = input.other_silent = false;
    for (int other = 0; other < tools; ++other) {
      input.other_lost |= other != t && lost[other];
      input.other_silent |= other != t && silent[other];
    }
    taken_[t] = supervisors_[t].update(input);
  }
  links_->asked.halts = supervisors_.front().halts();
  const SupervisionState after = this->state();
  links_->asked.halted = after == SupervisionState::kStopping || after == SupervisionState::kFault;
}

/// Stops the arm where the state says so. An arm that something keeps away from its commands then gives way.
void ControlStage::halt(const ArmState& state, SupervisionState after) {
  const Time now = input_.now;
  const Transition* transition = taken_[0];  // what halts the arm is the same for all tools
  held_off_ = links_->asked.halted && input_.arm_follows && (held_off_ || input_.off_path);
  if (transition != nullptr && after == SupervisionState::kStopping) {
    begin_stop(*transition, now);
  } else if (transition != nullptr && after == SupervisionState::kFault && (input_.arm_follows || state.part_follows)) {
    brake();
  } else if (after != SupervisionState::kStopping) {
    soft_ = false;
  } else if (soft_ &&
             (stop_asked_ || held_off_ || now + from_seconds(stop_time(kinematics_.model(), last_.dq)) >= stop_by_)) {
    brake();
  }
  const bool gives_way = gives_way_to_ && now < end_of(tracker_.plan());
  if (gives_way && (stop_asked_ || (transition != nullptr && after == SupervisionState::kFault))) {
    end_giving_way();
  }
  if (!held_off_) {
    gives_way_to_.reset();
    gave_way_by_ = std::numeric_limits<double>::infinity();
  }
  if (held_off_ && now >= end_of(tracker_.plan()) + from_seconds(settings_.arm_delay)) {
    give_way(state.joints);
  } else {
    holds_still_since_ = now;
  }
}

/// Tells planner, taps and observers of this cycle.
void ControlStage::publish(const ArmState& state, std::uint64_t missed) {
  const auto view_of = [](const Supervisor& s) { return ControlView::Hand{s.state(), s.reason(), s.cause()}; };
  ++view_.cycles;
  view_.now = input_.now;
  view_.state = foremost().state();
  view_.reason = foremost().reason();
  view_.cause = foremost().cause();
  view_.command = last_;
  view_.measured = state.joints;
  view_.at_rest = at_rest_;
  view_.stops = supervisors_.front().stops();
  view_.missed_deadlines += missed;
  ControlReport report{input_.now, view_.state, {}, soft_};
  for (int t = 0; t < std::ssize(supervisors_); ++t) {
    const Supervisor& supervisor = supervisors_[t];
    view_.hands[t] = view_of(supervisor);
    report.hands[t] = {supervisor.state(), supervisor.engagements(), supervisor.grip()};
  }
  links_->report.write(report);
  links_->control_view.write(view_);
  const bool obeyed = input_.arm_follows || state.part_follows;
  if (obeyed && links_->taps.commands.push({last_, anew_})) anew_ = false;
  links_->taps.states.push(state.joints);
  for (int t = 0; t < std::ssize(supervisors_); ++t) {
    if (taken_[t] == nullptr) continue;
    const auto& [from, event, to, reason] = *taken_[t];
    const bool is_failure =
        to == SupervisionState::kFault || (to == SupervisionState::kStopping && event != SupervisionEvent::kStopAsked);
    links_->taps.changes.push(
        {input_.now, from, to, supervisors_[t].reason(), is_failure, supervisors_[t].cause().code, t});
  }
}

/// If the followed plan would touch an obstacle that has just appeared or moved, the arm brakes and continues once the
/// planner finds a way. Braking is the gentlest reaction even if it leads into an obstacle too.
void ControlStage::take_obstacles(Time now) {
  if (!links_->obstacles_to_control.read(settings_.obstacles)) return;
  const Plan& followed = tracker_.plan();
  if (check_way(followed, now, settings_.check, kinematics_, settings_.obstacles) == PlanFault::kNone) return;
  make_straight_stop(kinematics_.model(), last_, 0.0, candidate_);
  candidate_.world = settings_.obstacles.version;
  const PlanFault fault = check_plan(candidate_, candidate_.x[0], settings_.check, kinematics_, settings_.obstacles);
  if (fault != PlanFault::kNone && fault != PlanFault::kObstacle) return;
  has_pending_ = false;
  follow(candidate_);
  ++view_.dodges;
}

/// Switches to the newest plan at its start, if that is still to come and continues the followed plan.
void ControlStage::take_plan(Time now) {
  if (links_->plan.read(pending_)) has_pending_ = true;
  if (!has_pending_ || pending_.start > now) return;
  has_pending_ = false;
  const SupervisionState state = this->state();
  const bool wanted = state == SupervisionState::kReady || state == SupervisionState::kEngaged ||
                      state == SupervisionState::kHolding || soft_;
  const bool continues = pending_.start > last_.stamp.made &&
                         same(tracker_.update(pending_.start), sample(pending_, pending_.start), kContinuity);
  if (!wanted || !continues || !knows_obstacles(pending_, now)) {
    ++view_.rejected_plans;
    return;
  }
  follow(pending_);
  last_plan_ = now;
  ++view_.plans;
  if (state == SupervisionState::kEngaged && pending_.stamp.hand > last_hand_counted_) {
    last_hand_counted_ = pending_.stamp.hand;
    links_->latency_us.add(1e6 * to_seconds(now - pending_.stamp.hand));
  }
}

/// Opens and closes the gripper where the operator may move the arm. A stop leaves the gripper as it is, whether it
/// holds something or not, and drops requests made meanwhile. A request waits while the arm gets ready, but only for
/// kWishWaits: later it would surprise the operator.
void ControlStage::take_gripper(int tool, const JointState& measured) {
  auto& [command, last_wish, waiting_wish] = grippers_[tool];
  const HandReport& hand = hands_[tool];
  if (!command) command = measured.gripper[tool];
  if (hand.gripper != last_wish) last_wish = waiting_wish = hand.gripper;
  const SupervisionState state = this->state();
  const bool halted = state == SupervisionState::kStopping || state == SupervisionState::kFault;
  if (halted || measured.stamp.made - hand.gripper_said > kWishWaits) waiting_wish.reset();
  if (state == SupervisionState::kIdle || !waiting_wish) return;
  command = waiting_wish;
  waiting_wish.reset();
}

/// True if the plan knows the obstacles or passes their check. While objects change faster than plans are made, no plan
/// knows them all.
bool ControlStage::knows_obstacles(const Plan& plan, Time now) {
  return plan.world >= settings_.obstacles.version ||
         check_way(plan, now, settings_.check, kinematics_, settings_.obstacles) == PlanFault::kNone;
}

void ControlStage::follow(const Plan& plan) {
  tracker_.follow(plan);
  output_.follows = &tracker_.plan();
  links_->followed.write(plan);
}

void ControlStage::remember(const JointCommand& command) {
  last_ = command;
  links_->moved.push(command);
  const int size = static_cast<int>(history_.size());
  newest_ = (newest_ + 1) % size;
  history_[newest_] = command;
  stored_ = std::min(stored_ + 1, size);
}

/// @param age 0 is the newest
const JointCommand& ControlStage::command_before(int age) const {
  const int size = static_cast<int>(history_.size());
  return history_[(newest_ - age + size) % size];
}

/// The arm continued by itself and is not where the plan has it now: commands continue from where it is. They try, in
/// this order: a return to the plan, a stop in kEasy, the shortest stop. If a hard stop is under way, only the last is
/// possible. The shortest stop alone is followed even if it fails the check. The planner continues from there.
void ControlStage::resume(const JointCommand& carried_on) {
  remember(carried_on);
  if (same(tracker_.update(carried_on.stamp.made), carried_on, 1e-3 * kContinuity)) return;
  const SupervisionState state = this->state();
  const bool hard = (state == SupervisionState::kStopping && !soft_) || state == SupervisionState::kFault;
  const auto check = [&] {
    return check_plan(candidate_, candidate_.x[0], settings_.check, kinematics_, settings_.obstacles);
  };
  for (const int steps : kReturns) {
    if (hard || !make_return(tracker_.plan(), carried_on, steps, candidate_)) break;
    const PlanFault fault = keeps_to_profile(candidate_) ? check() : PlanFault::kVelocity;
    if (fault == PlanFault::kNone) return follow(candidate_);
    // These faults are found in microseconds, and a slower return may avoid them; a distance takes the time of a cycle.
    if (fault != PlanFault::kAcceleration && fault != PlanFault::kVelocity && fault != PlanFault::kPosition) break;
  }
  for (const double duration : {hard ? 0.0 : kEasy, 0.0}) {
    make_straight_stop(kinematics_.model(), carried_on, duration, candidate_);
    if (check() == PlanFault::kNone) break;
  }
  follow(candidate_);
}

/// From here on the commands hold the arm at q.
void ControlStage::anchor(const JointVector& q, Time now) {
  stand(q, now, candidate_);
  follow(candidate_);
  has_pending_ = false;
  anew_ = true;
  stored_ = 0;
  last_ = sample(candidate_, now);
}

/// Brakes straight, as hard as the limits allow, from the last command. If that leads into a limit or the arm itself,
/// the followed plan, which was checked to its end, stops the arm instead.
void ControlStage::brake() {
  soft_ = has_pending_ = false;
  make_straight_stop(kinematics_.model(), last_, 0.0, candidate_);
  if (check_plan(candidate_, candidate_.x[0], settings_.check, kinematics_, settings_.obstacles) == PlanFault::kNone) {
    follow(candidate_);
  }
}

/// Something keeps the arm away from its commands, and the servos press against it as long as the commands stay there.
/// Once the arm is stationary, the commands therefore move to its measured position. The relieved contact springs back
/// a little, and the commands move again, but only by less than half of the move before: an arm that sinks under a load
/// would ask for as much each time. If missed cycles or an object interrupt the move, it starts again. A contact on the
/// way does not prevent the move, since the arm is there already. If the arm is measured far away, an encoder is wrong,
/// and the commands do not move.
void ControlStage::give_way(const JointState& measured) {
  constexpr double kSlight = 1e-3, kFar = 0.3;                // rad (m)
  constexpr Time kPatience = std::chrono::milliseconds(500);  // for an arm that is never measured to be stationary
  const RobotModel& model = kinematics_.model();
  if (!last_.dq.isZero(0.0)) return;
  if (!gives_way_to_ || last_.q == *gives_way_to_) {
    const bool stands = measured.dq.cwiseAbs().maxCoeff() < kAtRest;
    if (!stands && measured.stamp.made < holds_still_since_ + kPatience) return;
    const JointVector to = measured.q.cwiseMax(model.position_min).cwiseMin(model.position_max);
    const double way = (to - last_.q).cwiseAbs().maxCoeff();
    if (!(way > kSlight && way < 0.5 * gave_way_by_ && way < std::max(kFar, 2.0 * settings_.path_tolerance))) return;
    gives_way_to_ = to;
    gave_way_by_ = way;
  }
  for (const double duration : {0.0, 0.5, 2.0}) {  // s; slower where the tool's speed is limited
    make_straight_move(model, last_, *gives_way_to_, duration, candidate_);
    const PlanFault fault = check_plan(candidate_, candidate_.x[0], settings_.check, kinematics_, settings_.obstacles);
    if (fault == PlanFault::kNone || fault == PlanFault::kSelfCollision || fault == PlanFault::kObstacle)
      return follow(candidate_);
  }
  gives_way_to_ = last_.q;
}

/// Stops a move of give_way(); during this halt it does not move again. The arm is in contact, which does not prevent
/// the stop.
void ControlStage::end_giving_way() {
  gives_way_to_.reset();
  gave_way_by_ = 0.0;
  make_straight_stop(kinematics_.model(), last_, 0.0, candidate_);
  const PlanFault fault = check_plan(candidate_, candidate_.x[0], settings_.check, kinematics_, settings_.obstacles);
  if (fault != PlanFault::kNone && fault != PlanFault::kSelfCollision && fault != PlanFault::kObstacle) return;
  follow(candidate_);
}

/// Starts a requested stop: as long as there is time, the planner's stop is followed, which keeps the liquid in.
void ControlStage::begin_stop(const Transition& transition, Time now) {
  const double shortest = stop_time(kinematics_.model(), last_.dq);
  soft_ = transition.event == SupervisionEvent::kStopAsked && settings_.soft_stop > 0.0;
  stop_by_ = now + from_seconds(shortest + settings_.soft_stop);
  if (!soft_) brake();
}

bool ControlStage::off_path(const JointState& measured) const {
  const Time then = measured.stamp.made - from_seconds(settings_.arm_delay);
  for (int age = 0; age < stored_; ++age) {
    const JointCommand& command = command_before(age);
    if (command.stamp.made > then) continue;
    const JointVector expected = age > 0 ? between(command, command_before(age - 1), then)
                                         : command.q + to_seconds(then - command.stamp.made) * command.dq;
    return (measured.q - expected).cwiseAbs().maxCoeff() > settings_.path_tolerance;
  }
  return false;
}

}  // namespace steadyhand

#include "steadyhand/session/live/planning_stage.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <utility>

#include "steadyhand/core/turn.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/model_check.hpp"
#include "steadyhand/planning/pipeline/complete.hpp"
#include "steadyhand/planning/plan/active_constraint.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

namespace {

/// How far plans stay inside the limits: more than the tolerances of solver and check, and than the motion between two
/// instants that the check tests.
constexpr double kPositionMargin = 1e-4;  // rad (m)
constexpr double kMargin = 1e-4;          // share of speed and acceleration

/// m: largest deviation of the bodies due to the lag of the servos. A lag of T smooths a motion with acceleration a by
/// about a T^2 / 2; for a UR5e's limits, 10 ms and a metre that is 0.8 mm.
constexpr double kServoMargin = 1e-3;

/// s; an arm that stops is taken to travel its speed times this. Of 0, 0.1, 0.2 and 0.5 the value with the shortest
/// stops.
constexpr double kOnward = 0.2;

/// An arm that stops is slow below this speed; the rest of its stop is straight.
constexpr double kSlow = 0.1;  // rad/s (m/s)

/// The model with a share of its limits, less the margins. Pairs of bodies are larger by the servos' margin, or by less
/// if they are nearer than that at home.
RobotModel within(const RobotModel& model, double speed_scaling) {
  Kinematics arm(model);
  arm.set_position(model.home);
  const double inflated = std::clamp(0.25 * clearance(arm), 0.0, kServoMargin);
  RobotModel limited = model;
  limited.velocity_max *= speed_scaling * (1.0 - kMargin);
  limited.acceleration_max *= speed_scaling * (1.0 - kMargin);
  const JointVector range = model.position_max - model.position_min;
  const JointVector margin = (0.01 * range).cwiseMin(kPositionMargin);
  limited.position_min += margin;
  limited.position_max -= margin;
  for (Body& body : limited.bodies) body.shape = body.shape.inflated(0.5 * inflated);
  return limited;
}

bool stands(const JointCommand& command) { return command.dq.isZero(0.0) && command.ddq.isZero(0.0); }

}  // namespace

Result<PlanningStage::ScaledPlanner> PlanningStage::make_scaled(const RobotModel& model, double speed_scaling,
                                                                const PlanningSettings& settings) {
  auto limited = std::make_unique<RobotModel>(within(model, speed_scaling));
  std::vector<std::unique_ptr<Planner>> planners;
  const auto add = [&](const OcpSettings& ocp, const PlannerSettings& how) -> Status {
    auto planner = Planner::make(*limited, ocp, how);
    if (!planner) return planner.error();
    planners.push_back(*std::move(planner));
    return Done{};
  };
  if (Status s = add(settings.ocp, settings.planner); !s) return s.error();
  for (PlanningSettings::Choice choice : settings.more) {
    choice.ocp.objectives = settings.ocp.objectives;
    choice.ocp.weights = settings.ocp.weights;
    if (choice.ocp.obstacle_rows == 0) choice.ocp.obstacle_rows = settings.ocp.obstacle_rows;
    PlannerSettings how = settings.planner;
    how.solver = choice.solver;
    how.tolerance = choice.tolerance;
    if (Status s = add(choice.ocp, how); !s) return s.error();
  }
  Planner* first = planners.front().get();
  Kinematics arm(*limited);
  return ScaledPlanner{std::move(limited), speed_scaling < 1.0, std::move(planners), first, std::move(arm)};
}

Result<std::unique_ptr<PlanningStage>> PlanningStage::make(const RobotModel& model, const PlanningSettings& settings,
                                                           Links& links, const Clock& clock) {
  PlanningSettings resolved = settings;
  // Obstacles may appear while the session runs.
  if (resolved.ocp.obstacle_rows == 0) resolved.ocp.obstacle_rows = kUsualObstacleRows;
  const bool slow_first = settings.first_speed_scaling < 1.0 && settings.first_moves > 0.0;
  auto scaled = make_scaled(model, slow_first ? settings.first_speed_scaling : 1.0, resolved);
  if (!scaled) return scaled.error();
  std::optional<ScaledPlanner> next;
  if (slow_first) {
    auto made = make_scaled(model, 1.0, resolved);
    if (!made) return made.error();
    next = std::move(*made);
  }
  // The gate checks every sample before it reaches the retargeter.
  resolved.retarget.accept_emulated = true;
  return std::unique_ptr<PlanningStage>(
      new PlanningStage(resolved, links, clock, std::move(*scaled), std::move(next), compute_reaches(model)));
}

PlanningStage::PlanningStage(const PlanningSettings& settings, Links& links, const Clock& clock, ScaledPlanner scaled,
                             std::optional<ScaledPlanner> after_first_moves, std::vector<Reach> reaches)
    : settings_(settings),
      links_(&links),
      clock_(&clock),
      reaches_(std::move(reaches)),
      scaled_(std::move(scaled)),
      after_first_moves_(std::move(after_first_moves)),
      ocp_(&(after_first_moves_ ? *after_first_moves_ : scaled_).planner->ocp()) {
  followed_ = scaled_.planner->plan();
  for (std::size_t i = 0; i < ocp_->objectives().size(); ++i) {
    if (ocp_->tool_count() > 1 && ocp_->objectives()[i]->info().ties_tools) tie_ = i;
  }
  set_weights(scaled_.planner->instance().weights);
  moved_ = sample(followed_, followed_.start);
  for (const Reach& reach : reaches_) {
    hands_.push_back({HandGate(settings.gate),
                      {},
                      Retargeter(settings.retarget),
                      Predictor(complete(settings.predictor, settings.ocp, reach)),
                      {}});
  }
  for (const auto& planner : scaled_.planners) {
    const LiquidSettings* liquid = planner->ocp().liquid();
    liquids_.emplace_back();
    for (int t = 0; liquid && t < scaled_.model->tool_count(); ++t)
      liquids_.back().emplace_back(*scaled_.model, *liquid, t);
  }
  use_liquid();
}

bool PlanningStage::step(Time now) {
  const std::uint64_t solves = view_.solves;
  (void)links_->report.read(report_);
  apply_obstacles();
  const Time start = next_start(now);

  // The next plan begins on the plan that control follows, not on the one sent last: that may have arrived too late.
  (void)links_->followed.read(followed_);
  scaled_.planner->continue_from(followed_);
  const JointCommand at_start = sample(followed_, start);
  apply_settings(now, at_start);
  follow_liquid();
  scaled_.arm.set_position(at_start.q);
  take_hands(now);
  for (int t = 0; t < std::ssize(hands_); ++t) follow_state(t, now, at_start);
  if (any_follows()) followed_for_ += to_seconds(now - last_step_);
  last_step_ = now;
  const bool moves = start < followed_.start + from_seconds(followed_.intervals * followed_.dt);
  const SupervisionState state = report_.state;
  if (!any_follows()) view_.constraint = {};
  view_.reference.nodes = 0;
  if (any_follows()) {
    plan_following(at_start);
  } else if (moves && (state == SupervisionState::kReady || state == SupervisionState::kHolding || report_.soft_stop)) {
    plan_rest(at_start);
  } else if (state == SupervisionState::kHolding) {
    plan_standing(at_start);
  }
  if (view_.solves > solves) tap();

  scaled_.arm.set_position(at_start.q);
  for (int t = 0; t < std::ssize(hands_); ++t) {
    const Predictor& predictor = hands_[t].predictor;
    view_.targets[t] = predictor.newest();
    view_.tracking_error[t] = (predictor.at(start).p - scaled_.arm.p(t)).norm();
  }
  view_.plan = followed_;
  links_->planner_view.write(view_);
  return view_.solves > solves;
}

/// Start of the next plan: in time for a control cycle and not much before it, since a plan waits for the cycle after
/// its start.
Time PlanningStage::next_start(Time now) const {
  const Time earliest = now + from_seconds(settings_.look_ahead), cycle = from_seconds(settings_.cycle);
  if (cycle <= Time(0) || report_.now <= Time(0)) return earliest;
  const Time before = cycle / 8;  // the cycle may come a little early
  const auto ahead = std::max<std::int64_t>(0, (earliest - report_.now + cycle - Time(1)) / cycle);
  return std::max(report_.now + ahead * cycle - before, now);
}

/// The liquid follows the commands that moved the arm, also where the arm continued by itself. After a refill it is at
/// rest.
void PlanningStage::follow_liquid() {
  for (JointCommand next; links_->moved.pop(next); moved_ = next) {
    for (int t = 0; liquid_ && t < std::ssize(hands_); ++t)
      hands_[t].liquid_state = (*liquid_)[t].between(moved_, next, hands_[t].liquid_state);
  }
  if (!liquid_) return;
  for (int t = 0; t < std::ssize(hands_); ++t) {
    const std::uint64_t refills = links_->refills[t];
    if (std::exchange(hands_[t].refills, refills) != refills || is_fresh_)
      hands_[t].liquid_state = (*liquid_)[t].at_rest(moved_.q);
    scaled_.planner->set_liquid(hands_[t].liquid_state, moved_.stamp.made, t);
  }
  is_fresh_ = false;
}

/// All settings change together: the weights of one profile do not suit the limits of another.
void PlanningStage::apply_settings(Time now, const JointCommand& at_start) {
  OperatorSettings& settings = operator_settings_;
  settings_wait_ = links_->settings.read(settings) || settings_wait_;
  if (!settings_wait_) return;
  if (settings.planner != planner_) {
    if (any_follows() || !stands(at_start)) return;
    use_planner(settings.planner);
  }
  settings_wait_ = false;
  for (Hand& hand : hands_) {
    hand.retargeter.set_scale(settings.scale);
    hand.retargeter.set_yaw(settings.yaw);
    hand.retargeter.set_tilt_max(settings.tilt_max);
    hand.delay.set(from_seconds(settings.latency));
    if (settings.prediction) hand.predictor.set_model(*settings.prediction);
  }
  for_each_planner([&](Planner& planner) {
    if (planner.ocp().liquid()) planner.set_no_spill(settings.no_spill);
  });
  if (liquid_ && settings.fill && *settings.fill != glass_.fill) pour(*settings.fill);
  const bool held = holds_one_thing();
  if (settings.objectives > 0) set_weights({settings.weights.data(), std::size_t(settings.objectives)});
  if (any_follows() && holds_one_thing() != held) change_hold(now, at_start);
  links_->taps.settings.push({now, settings});
}

/// The tools take one thing, or release it, while a hand moves one: they keep their present pose, and a tool without a
/// hand stops.
void PlanningStage::change_hold(Time now, const JointCommand& at_start) {
  scaled_.arm.set_position(at_start.q);
  latch_pose_of_tools();
  for (int t = 0; t < std::ssize(hands_); ++t)
    if (!hands_[t].following) end_following(t, now, at_start);
}

/// Call it after set_position.
void PlanningStage::latch_pose_of_tools() {
  if (tie_) X_tool_tool_ = tool_at_start(0).inverse() * tool_at_start(1);
}

/// Refills the glasses. @param fill m, checked by the caller
void PlanningStage::pour(double fill) {
  glass_.fill = fill;
  is_fresh_ = true;
  for (int t = 0; t < std::ssize(hands_); ++t) {
    (*liquid_)[t].set_glass(glass_);
    for_each_planner([&](Planner& planner) { (void)planner.set_glass(glass_, t); });
  }
}

/// Call it at rest, where every motion satisfies the new limits.
/// @pre a planner of this number exists
void PlanningStage::use_planner(int planner) {
  Planner& before = *scaled_.planner;
  planner_ = planner;
  for (ScaledPlanner* scaled : {&scaled_, after_first_moves_ ? &*after_first_moves_ : nullptr})
    if (scaled != nullptr) scaled->planner = scaled->planners[static_cast<std::size_t>(planner)].get();
  scaled_.planner->continue_from(before);
  for (Hand& hand : hands_) hand.predictor.set_horizon(scaled_.planner->ocp().horizon(), scaled_.planner->ocp().dt());
  use_liquid();
}

/// Takes the liquid of the problem in use. If it has none, that of the problem before stays in the glass.
void PlanningStage::use_liquid() {
  std::vector<LiquidEstimate>& liquid = liquids_[static_cast<std::size_t>(planner_)];
  if (liquid.empty()) return;
  const bool is_first = liquid_ == nullptr;
  liquid_ = &liquid;
  if (is_first) glass_ = scaled_.planner->ocp().liquid()->glass;
  for (int t = 0; t < std::ssize(hands_); ++t) {
    liquid[t].set_glass(glass_);
    if (is_first) hands_[t].liquid_state = liquid[t].at_rest(moved_.q);
  }
}

void PlanningStage::apply_obstacles() {
  Obstacles& obstacles = settings_.planner.obstacles;
  if (!links_->obstacles_to_plan.read(obstacles)) return;
  for_each_planner([&](Planner& planner) { (void)planner.set_obstacles(obstacles); });  // the sender has checked them
}

/// The weights at rest pull the arm nowhere: it slows down and rights the glass as fast as the liquid allows. The
/// terms' bounds were found by stopping moving arms at random instants: of the bounds that stop within 0.6 s they spill
/// least.
void PlanningStage::set_weights(std::span<const JointVector> weights) {
  for (auto* kept : {&weights_, &rest_weights_, &mixed_weights_}) kept->assign(weights.begin(), weights.end());
  for (std::size_t i = 0; i < rest_weights_.size(); ++i) {
    const ObjectiveInfo& term = scaled_.planner->ocp().objectives()[i]->info();
    rest_weights_[i] = rest_weights_[i].cwiseMax(term.at_rest_min).cwiseMin(term.at_rest_max);
  }
}

/// Reads the samples of the hands since the last step. Call it after set_position at the start of the next plan.
void PlanningStage::take_hands(Time now) {
  HeldSample held;
  while (links_->samples.pop(held)) {
    const OperatorSample& sample = held.sample;
    if (sample.tool < 0 || sample.tool >= std::ssize(hands_)) continue;
    ++view_.samples;
    links_->taps.samples.push(sample);
    change_holder(held.holder);
    Hand& hand = hands_[sample.tool];
    if (hand.gate.update(sample, now) != HandVerdict::kGood) continue;
    hand.trusted = sample;
    const HandReport& report = hand.gate.report();
    const bool followed = report.clutch && report.grips == report_.hands[sample.tool].grip;
    if (hand.following && followed) hand.delay.push(sample);
  }
  change_holder(links_->holder);  // the new hand may not have sent a sample yet
  view_.dropped_samples = links_->samples.dropped();
  PerTool<HandReport> reports;
  for (int t = 0; t < std::ssize(hands_); ++t) {
    Hand& hand = hands_[t];
    for (OperatorSample sample; hand.delay.pop(now, sample);)
      send_target(t, hand.retargeter.update(sample, tool_at_start(t)));
    view_.dropped_samples += hand.gate.dropped();
    // A person then grips again. A policy reports only once that its hand is open.
    const bool grips_again = settings_wait_ && (!waited_ || hand.gate.report().leader != Leader::kPolicy);
    if (grips_again || to_seconds(now - hand.gate.report().received) > settings_.sample_timeout) hand.gate.forget();
    reports[t] = hand.gate.report();
    reports[t].settings_wait = settings_wait_;
    if (settings_wait_) reports[t].clutch = reports[t].trusted = false;
  }
  waited_ = settings_wait_;
  links_->hands.write(reports);
}

/// In the order of the samples: samples of the next hand count, however soon after the last one.
void PlanningStage::change_holder(std::uint64_t holder) {
  if (holder == holder_) return;
  holder_ = holder;
  for (Hand& hand : hands_) hand.gate.forget();
}

/// Begins and ends following as control decided.
void PlanningStage::follow_state(int tool, Time now, const JointCommand& at_start) {
  Hand& hand = hands_[tool];
  const bool follow = report_.hands[tool].state == SupervisionState::kEngaged;
  if (!follow) hand.delay.clear();
  if (follow && report_.hands[tool].engagement != hand.engagement) {
    begin_following(tool, at_start);
  } else if (!follow && hand.following) {
    for (int t = 0; t < std::ssize(hands_); ++t) {
      if (t == tool || (holds_one_thing() && !hands_[t].following)) end_following(t, now, at_start);
    }
  }
  hand.following = follow;
}

void PlanningStage::begin_following(int tool, const JointCommand& at_start) {
  Hand& hand = hands_[tool];
  hand.engagement = report_.hands[tool].engagement;
  const bool new_grip = std::exchange(hand.grip, report_.hands[tool].grip) != report_.hands[tool].grip;
  if (!any_follows()) latch_pose_of_tools();
  if (stands(at_start)) {
    if (new_grip) leave_first_moves();
    scaled_.arm.set_position(at_start.q);
    scaled_.planner->reset(at_start.q, at_start.stamp.made);  // the last solution is no guess from rest
    for (int t = 0; t < std::ssize(hands_); ++t)
      scaled_.planner->set_liquid(hands_[t].liquid_state, moved_.stamp.made, t);
  }
  OperatorSample grip = hand.trusted;
  grip.clutch = true;
  hand.retargeter.release();
  send_target(tool, hand.retargeter.update(grip, tool_at_start(tool)));
  for (int t = 0; t < std::ssize(hands_); ++t) {  // a tool that has never moved stays where it is
    if (t != tool && hands_[t].predictor.predict(at_start.stamp.made).nodes == 0)
      send_target(t, {grip.stamp, tool_at_start(t), false, Time(0), grip.leader, t});
  }
}

/// Target of a stop: the glass leans as the hand held it last; position and heading are those where the arm stops. An
/// arm that lags behind a turn or cannot reach it does not catch up: that would take decimetres.
void PlanningStage::end_following(int tool, Time now, const JointCommand& at_start) {
  Hand& hand = hands_[tool];
  scaled_.arm.set_position(at_start.q + kOnward * at_start.dq);
  const Pose stop = tool_at_start(tool);
  scaled_.arm.set_position(at_start.q);
  const Target& newest = hand.predictor.newest();
  const Vector3 up = newest.X_base_tool.q * Vector3::UnitZ();
  const Quaternion righted = turn_between(stop.q * Vector3::UnitZ(), up) * stop.q;
  send_target(tool, {{now, now}, {stop.p, righted}, false, Time(0), newest.leader, tool});
  hand.resting_since = now;
  hand.settled = false;
}

/// Call it at rest, where every motion satisfies the new limits.
void PlanningStage::leave_first_moves() {
  if (!scaled_.is_slow || followed_for_ < settings_.first_moves) return;
  after_first_moves_->planner->continue_from(*scaled_.planner);
  std::swap(scaled_, *after_first_moves_);
}

void PlanningStage::send_target(int tool, const Target& target) {
  hands_[tool].predictor.update(target);
  links_->taps.targets.push(target);
}

/// A tool whose hand has released stops by the problem while it is fast; then its joints stop straight. The
/// other tool goes on meanwhile.
void PlanningStage::settle(const JointCommand& at_start) {
  std::bitset<kMaxJoints> given;
  for (int t = 0; t < std::ssize(hands_); ++t) {
    Hand& hand = hands_[t];
    if (hand.following) continue;
    if (any_follows() && holds_one_thing()) continue;
    const std::vector<int>& chain = scaled_.arm.chain(t);
    const bool slow = std::ranges::all_of(chain, [&](int k) { return std::abs(at_start.dq[k]) < kSlow; });
    const bool in_time = to_seconds(at_start.stamp.made - hand.resting_since) < settings_.rest_within;
    hand.settled = hand.settled || slow || !in_time;
    for (const int k : chain) given[k] = given[k] || hand.settled;
  }
  scaled_.planner->set_given(given);
  if (tie_) scaled_.planner->set_held(X_tool_tool_);
}

/// The weights in force; of terms of each tool those at rest where the tool does not follow.
std::span<const JointVector> PlanningStage::weights_of_hands() {
  if (std::ranges::all_of(hands_, &Hand::following) || holds_one_thing()) return weights_;
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    const WeightCount& count = scaled_.planner->ocp().objectives()[i]->info().weights;
    mixed_weights_[i] = weights_[i];
    if (count.of != WeightCount::Of::kTool || weights_[i].size() != count.in(*scaled_.model)) continue;
    for (int t = 0; t < std::ssize(hands_); ++t) {
      if (!hands_[t].following)
        mixed_weights_[i].segment(t * count.each, count.each) = rest_weights_[i].segment(t * count.each, count.each);
    }
  }
  return mixed_weights_;
}

Reference PlanningStage::predict(Time start) const {
  Reference reference = hands_[0].predictor.predict(start);
  for (int t = 1; t < std::ssize(hands_); ++t) {
    const Reference other = hands_[t].predictor.predict(start);
    reference.nodes = std::min(reference.nodes, other.nodes);
    reference.stamp.hand = std::max(reference.stamp.hand, other.stamp.hand);
    reference.tools[t] = other.tools[0];
  }
  if (!any_follows() || !holds_one_thing()) return reference;
  for (int t = 0; t < std::ssize(hands_); ++t) {  // a tool without a hand goes with the other
    const ToolReference& leader = reference.tools[1 - t];
    const Pose X_leader_tool = t == 1 ? X_tool_tool_ : X_tool_tool_.inverse();
    for (int k = 0; k < reference.nodes && !hands_[t].following; ++k) {
      reference.tools[t].p[k] = leader.p[k] + leader.R[k] * X_leader_tool.p;
      reference.tools[t].R[k] = leader.R[k] * X_leader_tool.q.toRotationMatrix();
    }
  }
  return reference;
}

void PlanningStage::plan_following(const JointCommand& at_start) {
  settle(at_start);
  const bool solved = solve(at_start.stamp.made, weights_of_hands());
  view_.reference = scaled_.planner->instance().reference;
  if (!solved) return;
  send(scaled_.planner->plan());
  view_.constraint = active_constraint(scaled_.planner->plan(), scaled_.planner->ocp().horizon(),
                                       scaled_.planner->instance(), reaches_, scaled_.arm, settings_.planner.obstacles);
}

/// Plans to rest: by the problem while the arm is fast, then straight. If the problem has no solution or does not end
/// at rest in time, the plan is straight; where the liquid must not spill, the followed plan continues instead.
void PlanningStage::plan_rest(const JointCommand& at_start) {
  constexpr double kLastPart = 0.1;                                // s
  if (stop_.joints > 0 && followed_.start == stop_.start) return;  // the last part is under way
  const bool slow = at_start.dq.cwiseAbs().maxCoeff() < kSlow;
  settle(at_start);
  const bool settled = std::ranges::all_of(hands_, &Hand::settled);
  if (!settled && solve(at_start.stamp.made, rest_weights_)) return send(scaled_.planner->plan());
  // The followed plan also ends at rest, and spills less than a straight stop.
  const auto& liquids = scaled_.planner->instance().liquid;
  if (!slow && scaled_.planner->ocp().liquid() && std::ranges::any_of(liquids, &LiquidInstance::counts)) return;
  make_straight_stop(scaled_.arm.model(), at_start, kLastPart, stop_);
  stop_.world = settings_.planner.obstacles.version;
  if (check_plan(stop_, stop_.x[0], settings_.planner.check, scaled_.arm, settings_.planner.obstacles) ==
      PlanFault::kNone)
    send(stop_);
}

/// At rest while holding: shows that the planner can plan, and stays there.
void PlanningStage::plan_standing(const JointCommand& at_start) {
  scaled_.planner->set_given({});
  if (!solve(at_start.stamp.made, weights_)) return;
  make_straight_stop(scaled_.arm.model(), at_start, 0.0, stop_);
  stop_.world = settings_.planner.obstacles.version;
  send(stop_);
}

/// True if the plan is new and passed its check.
bool PlanningStage::solve(Time start, std::span<const JointVector> weights) {
  reference_ = predict(start);
  if (reference_.nodes == 0) return false;
  scaled_.planner->set_weights(weights);
  const Time before = clock_->now();
  (void)scaled_.planner->update(reference_);
  ++view_.solves;
  links_->solve_us.add(1e6 * to_seconds(clock_->now() - before));
  const bool solved = scaled_.planner->fault() == PlanFault::kNone;
  view_.failed += !solved;
  return solved;
}

/// Records the solve of this step if it is due or it failed. The plan has been sent by then.
void PlanningStage::tap() {
  const bool failed = scaled_.planner->fault() != PlanFault::kNone;
  if (!failed && reference_.start < next_tap_) return;
  next_tap_ = reference_.start + from_seconds(settings_.tap_period);
  record_.at = reference_.start;
  record_.plan = scaled_.planner->plan();
  for (int t = 0; t < std::ssize(hands_); ++t) {
    record_.X_base_target[t] = hands_[t].predictor.at(reference_.start);
    record_.engaged[t] = hands_[t].following;
  }
  record_.reference = reference_;
  record_.ocp = &scaled_.planner->ocp();
  record_.solved = scaled_.planner->figures();
  links_->taps.steps.push(record_);
}

void PlanningStage::send(const Plan& plan) {
  sent_ = plan;
  sent_.stamp.made = clock_->now();
  links_->plan.write(sent_);
}

}  // namespace steadyhand

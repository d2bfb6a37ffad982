#include "steadyhand/session/live/planning_stage.hpp"

#include <algorithm>

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
  if (Status s = check_one_tool(model); !s) return s.error();
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
  const Reach reach = compute_reach(model);
  resolved.predictor = complete(settings.predictor, settings.ocp, reach);
  // The gate checks every sample before it reaches the retargeter.
  resolved.retarget.accept_emulated = true;
  return std::unique_ptr<PlanningStage>(
      new PlanningStage(resolved, links, clock, std::move(*scaled), std::move(next), reach));
}

PlanningStage::PlanningStage(const PlanningSettings& settings, Links& links, const Clock& clock, ScaledPlanner scaled,
                             std::optional<ScaledPlanner> after_first_moves, const Reach& reach)
    : settings_(settings),
      links_(&links),
      clock_(&clock),
      reach_(reach),
      gate_(settings.gate),
      retargeter_(settings.retarget),
      predictor_(settings.predictor),
      scaled_(std::move(scaled)),
      after_first_moves_(std::move(after_first_moves)),
      ocp_(&(after_first_moves_ ? *after_first_moves_ : scaled_).planner->ocp()) {
  followed_ = scaled_.planner->plan();
  set_weights(scaled_.planner->instance().weights);
  moved_ = sample(followed_, followed_.start);
  for (const auto& planner : scaled_.planners) {
    const LiquidSettings* liquid = planner->ocp().liquid();
    liquids_.emplace_back();
    if (liquid) liquids_.back().emplace(*scaled_.model, *liquid);
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
  const Pose X_base_tool{scaled_.arm.p(), Quaternion(scaled_.arm.R())};
  take_hand(now, X_base_tool);
  follow_state(now, at_start, X_base_tool);
  if (following_) followed_for_ += to_seconds(now - last_step_);
  last_step_ = now;
  const bool moves = start < followed_.start + from_seconds(followed_.intervals * followed_.dt);
  const SupervisionState state = report_.state;
  if (!following_) view_.constraint = {};
  view_.reference.nodes = 0;
  if (following_) {
    plan_following(start);
  } else if (moves && (state == SupervisionState::kReady || state == SupervisionState::kHolding || report_.soft_stop)) {
    plan_rest(at_start);
  } else if (state == SupervisionState::kHolding) {
    plan_standing(at_start);
  }
  if (view_.solves > solves) tap();

  view_.target = predictor_.newest();
  view_.plan = followed_;
  view_.tracking_error = (predictor_.at(start).p - X_base_tool.p).norm();
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
  for (JointCommand next; links_->moved.pop(next); moved_ = next)
    if (liquid_) liquid_state_ = liquid_->between(moved_, next, liquid_state_);
  if (!liquid_) return;
  const std::uint64_t refills = links_->refills;
  if (is_fresh_ || refills != refills_) liquid_state_ = liquid_->at_rest(moved_.q);
  is_fresh_ = false;
  refills_ = refills;
  scaled_.planner->set_liquid(liquid_state_, moved_.stamp.made);
}

/// All settings change together: the weights of one profile do not suit the limits of another.
void PlanningStage::apply_settings(Time now, const JointCommand& at_start) {
  OperatorSettings& settings = operator_settings_;
  settings_wait_ = links_->settings.read(settings) || settings_wait_;
  if (!settings_wait_) return;
  if (settings.planner != planner_) {
    if (following_ || !stands(at_start)) return;
    use_planner(settings.planner);
  }
  settings_wait_ = false;
  retargeter_.set_scale(settings.scale);
  retargeter_.set_yaw(settings.yaw);
  retargeter_.set_tilt_max(settings.tilt_max);
  for_each_planner([&](Planner& planner) {
    if (planner.ocp().liquid()) planner.set_no_spill(settings.no_spill);
  });
  if (liquid_ && settings.fill && *settings.fill != glass_.fill) pour(*settings.fill);
  delay_.set(from_seconds(settings.latency));
  if (settings.prediction) predictor_.set_model(*settings.prediction);
  if (settings.objectives > 0) set_weights({settings.weights.data(), std::size_t(settings.objectives)});
  links_->taps.settings.push({now, settings});
}

/// Refills the glass. @param fill m, checked by the caller
void PlanningStage::pour(double fill) {
  glass_.fill = fill;
  is_fresh_ = true;
  liquid_->set_glass(glass_);
  for_each_planner([&](Planner& planner) { (void)planner.set_glass(glass_); });
}

/// Call it at rest, where every motion satisfies the new limits.
/// @pre a planner of this number exists
void PlanningStage::use_planner(int planner) {
  Planner& before = *scaled_.planner;
  planner_ = planner;
  for (ScaledPlanner* scaled : {&scaled_, after_first_moves_ ? &*after_first_moves_ : nullptr})
    if (scaled != nullptr) scaled->planner = scaled->planners[static_cast<std::size_t>(planner)].get();
  scaled_.planner->continue_from(before);
  predictor_.set_horizon(scaled_.planner->ocp().horizon(), scaled_.planner->ocp().dt());
  use_liquid();
}

/// Takes the liquid of the problem in use. If it has none, that of the problem before stays in the glass.
void PlanningStage::use_liquid() {
  std::optional<LiquidEstimate>& liquid = liquids_[static_cast<std::size_t>(planner_)];
  if (!liquid) return;
  const bool is_first = liquid_ == nullptr;
  liquid_ = &*liquid;
  if (is_first) glass_ = scaled_.planner->ocp().liquid()->glass;
  liquid_->set_glass(glass_);
  if (is_first) liquid_state_ = liquid_->at_rest(moved_.q);
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
  weights_.assign(weights.begin(), weights.end());
  rest_weights_.assign(weights.begin(), weights.end());
  for (std::size_t i = 0; i < rest_weights_.size(); ++i) {
    const ObjectiveInfo& term = scaled_.planner->ocp().objectives()[i]->info();
    rest_weights_[i] = rest_weights_[i].cwiseMax(term.at_rest_min).cwiseMin(term.at_rest_max);
  }
}

/// Reads the samples of the hand since the last step.
void PlanningStage::take_hand(Time now, const Pose& X_base_tool) {
  HeldSample held;
  while (links_->samples.pop(held)) {
    const OperatorSample& sample = held.sample;
    ++view_.samples;
    links_->taps.samples.push(sample);
    change_holder(held.holder);
    if (gate_.update(sample, now) != HandVerdict::kGood) continue;
    trusted_ = sample;
    const bool followed = gate_.report().clutch && gate_.report().grips == report_.grip;
    if (following_ && followed) delay_.push(sample);
  }
  for (OperatorSample sample; delay_.pop(now, sample);) send_target(retargeter_.update(sample, X_base_tool));
  view_.dropped_samples = gate_.dropped() + links_->samples.dropped();
  change_holder(links_->holder);  // the new hand may not have sent a sample yet
  // A person then grips again. A policy reports only once that its hand is open.
  const bool grips_again = settings_wait_ && (!waited_ || gate_.report().leader != Leader::kPolicy);
  waited_ = settings_wait_;
  if (grips_again || to_seconds(now - gate_.report().received) > settings_.sample_timeout) gate_.forget();
  HandReport report = gate_.report();
  report.settings_wait = settings_wait_;
  if (settings_wait_) report.clutch = report.trusted = false;
  links_->hand.write(report);
}

/// In the order of the samples: samples of the next hand count, however soon after the last one.
void PlanningStage::change_holder(std::uint64_t holder) {
  if (holder == holder_) return;
  holder_ = holder;
  gate_.forget();
}

/// Begins and ends following as control decided.
void PlanningStage::follow_state(Time now, const JointCommand& at_start, const Pose& X_base_tool) {
  const bool follow = report_.state == SupervisionState::kEngaged;
  if (!follow) delay_.clear();
  if (follow && report_.engagement != engagement_) {
    engagement_ = report_.engagement;
    const bool new_grip = report_.grip != grip_;
    grip_ = report_.grip;
    if (stands(at_start)) {
      if (new_grip) leave_first_moves();
      scaled_.planner->reset(at_start.q, at_start.stamp.made);  // the last solution is no guess from rest
      scaled_.planner->set_liquid(liquid_state_, moved_.stamp.made);
    }
    OperatorSample grip = trusted_;
    grip.clutch = true;
    retargeter_.release();
    send_target(retargeter_.update(grip, X_base_tool));
  } else if (!follow && following_) {
    // Target of a stop: the glass leans as the hand held it last; position and heading are those where the arm stops.
    // An arm that lags behind a turn or cannot reach it does not catch up: that would take decimetres.
    scaled_.arm.set_position(at_start.q + kOnward * at_start.dq);
    const Target& newest = predictor_.newest();
    const Vector3 up = newest.X_base_tool.q * Vector3::UnitZ();
    const Quaternion turned(scaled_.arm.R()), righted = turn_between(turned * Vector3::UnitZ(), up) * turned;
    send_target({{now, now}, {scaled_.arm.p(), righted}, false, Time(0), newest.leader});
    resting_since_ = now;
  }
  following_ = follow;
}

/// Call it at rest, where every motion satisfies the new limits.
void PlanningStage::leave_first_moves() {
  if (!scaled_.is_slow || followed_for_ < settings_.first_moves) return;
  after_first_moves_->planner->continue_from(*scaled_.planner);
  std::swap(scaled_, *after_first_moves_);
}

void PlanningStage::send_target(const Target& target) {
  predictor_.update(target);
  links_->taps.targets.push(target);
}

void PlanningStage::plan_following(Time start) {
  const bool solved = solve(start, weights_);
  view_.reference = scaled_.planner->instance().reference;
  if (!solved) return;
  send(scaled_.planner->plan());
  view_.constraint = active_constraint(scaled_.planner->plan(), scaled_.planner->ocp().horizon(),
                                       scaled_.planner->instance(), reach_, scaled_.arm, settings_.planner.obstacles);
}

/// Plans to rest: by the problem while the arm is fast, then straight. If the problem has no solution or does not end
/// at rest in time, the plan is straight; where the liquid must not spill, the followed plan continues instead.
void PlanningStage::plan_rest(const JointCommand& at_start) {
  constexpr double kSlow = 0.1, kLastPart = 0.1;                   // rad/s (m/s), s
  if (stop_.joints > 0 && followed_.start == stop_.start) return;  // the last part is under way
  const bool slow = at_start.dq.cwiseAbs().maxCoeff() < kSlow;
  const bool in_time = to_seconds(at_start.stamp.made - resting_since_) < settings_.rest_within;
  if (!slow && in_time && solve(at_start.stamp.made, rest_weights_)) return send(scaled_.planner->plan());
  // The followed plan also ends at rest, and spills less than a straight stop.
  if (!slow && scaled_.planner->ocp().liquid() && scaled_.planner->instance().liquid[0].counts) return;
  make_straight_stop(scaled_.arm.model(), at_start, kLastPart, stop_);
  stop_.world = settings_.planner.obstacles.version;
  if (check_plan(stop_, stop_.x[0], settings_.planner.check, scaled_.arm, settings_.planner.obstacles) ==
      PlanFault::kNone)
    send(stop_);
}

/// At rest while holding: shows that the planner can plan, and stays there.
void PlanningStage::plan_standing(const JointCommand& at_start) {
  if (!solve(at_start.stamp.made, weights_)) return;
  make_straight_stop(scaled_.arm.model(), at_start, 0.0, stop_);
  stop_.world = settings_.planner.obstacles.version;
  send(stop_);
}

/// True if the plan is new and passed its check.
bool PlanningStage::solve(Time start, std::span<const JointVector> weights) {
  reference_ = predictor_.predict(start);
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
  record_.X_base_target = predictor_.at(reference_.start);
  record_.reference = reference_;
  record_.ocp = &scaled_.planner->ocp();
  record_.solved = scaled_.planner->figures();
  record_.engaged = following_;
  links_->taps.steps.push(record_);
}

void PlanningStage::send(const Plan& plan) {
  sent_ = plan;
  sent_.stamp.made = clock_->now();
  links_->plan.write(sent_);
}

}  // namespace steadyhand

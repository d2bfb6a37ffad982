#include "session/planning_stage.hpp"

namespace steadyhand {

Result<std::unique_ptr<PlanningStage>> PlanningStage::make(const RobotModel& model, const PlanningSettings& settings,
                                                           Links& links, const Clock& clock) {
  auto planner = Planner::make(model, settings.ocp, settings.planner);
  if (!planner) return planner.error();
  const Reach reach = compute_reach(model);
  PlanningSettings resolved = settings;
  resolved.predictor.horizon = settings.ocp.horizon;
  resolved.predictor.dt = settings.ocp.dt;
  resolved.predictor.reach_center = reach.center;
  resolved.predictor.reach = reach.radius;
  // The gate has judged every sample before it comes to the retargeter.
  resolved.retarget.accept_emulated = true;
  return std::unique_ptr<PlanningStage>(new PlanningStage(model, resolved, links, clock, std::move(*planner), reach));
}

PlanningStage::PlanningStage(const RobotModel& model, const PlanningSettings& settings, Links& links,
                             const Clock& clock, std::unique_ptr<Planner> planner, const Reach& reach)
    : settings_(settings),
      links_(&links),
      clock_(&clock),
      reach_(reach),
      gate_(settings.gate),
      retargeter_(settings.retarget),
      predictor_(settings.predictor),
      planner_(std::move(planner)),
      arm_(model) {
  followed_ = sent_ = planner_->plan();
}

void PlanningStage::step(Time now) {
  (void)links_->report.read(report_);
  apply_settings();
  const Time start = now + from_seconds(settings_.lead);

  // What control follows decides where the next plan begins, not what was sent: it may have come too late.
  if (report_.anchor != anchor_) {
    anchor_ = report_.anchor;
    planner_->reset(report_.command.q, report_.now);
    followed_ = planner_->plan();
  } else if (report_.following == sent_.start) {
    followed_ = sent_;
  } else {
    planner_->continue_from(followed_);
    ++view_.late;
  }

  const JointCommand at_start = sample(followed_, start);
  arm_.set_position(at_start.q);
  const Pose X_base_tool{arm_.p(), Quaternion(arm_.R())};
  hear(now, X_base_tool);
  follow_state(now, at_start, X_base_tool);
  if (has_work(start)) plan(start);

  view_.target = predictor_.newest();
  view_.plan = followed_;
  view_.tracking_error = (predictor_.at(start).p - X_base_tool.p).norm();
  links_->planner_view.write(view_);
}

void PlanningStage::apply_settings() {
  OperatorSettings& settings = operator_settings_;
  if (!links_->settings.read(settings)) return;
  retargeter_.set_scale(settings.scale);
  retargeter_.set_yaw(settings.yaw);
  if (settings.objectives > 0) planner_->set_weights({settings.weights.data(), std::size_t(settings.objectives)});
}

/// Takes in what the hand did since the last step.
void PlanningStage::hear(Time now, const Pose& X_base_tool) {
  OperatorSample sample;
  while (links_->samples.pop(sample)) {
    ++view_.samples;
    links_->taps.samples.push(sample);
    if (gate_.update(sample, now) != HandVerdict::kGood) continue;
    trusted_ = sample;
    if (following_ && sample.clutch) send_target(retargeter_.update(sample, X_base_tool));
  }
  view_.dropped_samples = gate_.dropped() + links_->samples.dropped();
  if (to_seconds(now - gate_.report().heard) > settings_.silence) gate_.forget();
  links_->hand.write(gate_.report());
}

/// Begins and ends following as control decided.
void PlanningStage::follow_state(Time now, const JointCommand& at_start, const Pose& X_base_tool) {
  const bool follow = report_.state == SupervisionState::kEngaged;
  if (follow && report_.engagement != engagement_) {
    engagement_ = report_.engagement;
    OperatorSample released = trusted_;
    released.clutch = false;
    (void)retargeter_.update(released, X_base_tool);
    released.clutch = true;
    send_target(retargeter_.update(released, X_base_tool));
  } else if (!follow && following_) {
    // Where an even stop leads to, so that the arm neither goes on nor comes back.
    arm_.set_position(at_start.q + 0.5 * settings_.rest_time * at_start.dq);
    send_target({{now, now}, {arm_.p(), Quaternion(arm_.R())}, false});
  }
  following_ = follow;
}

void PlanningStage::send_target(const Target& target) {
  predictor_.update(target);
  links_->taps.targets.push(target);
}

/// Following, or not yet at rest. When holding plans go on, since they show that they could.
bool PlanningStage::has_work(Time start) const {
  switch (report_.state) {
    case SupervisionState::kEngaged:
      return true;
    case SupervisionState::kHolding:
      return true;
    case SupervisionState::kReady:
      return start < followed_.start + from_seconds(followed_.intervals * followed_.dt);
    default:
      return false;
  }
}

void PlanningStage::plan(Time start) {
  const Reference reference = predictor_.predict(start);
  if (reference.nodes == 0) return;
  links_->taps.references.push(reference);
  const Time before = clock_->now();
  const Plan& plan = planner_->update(reference);
  ++view_.solves;
  links_->solve_us.add(1e6 * to_seconds(clock_->now() - before));
  if (planner_->fault() != PlanFault::kNone) {
    ++view_.failed;
    return;
  }
  sent_ = plan;
  sent_.stamp.made = clock_->now();
  links_->plan.write(sent_);
  links_->taps.plans.push(sent_);
}

}  // namespace steadyhand

#include "steadyhand/replay/replay.hpp"

#include <fmt/format.h>

#include <cmath>

#include "steadyhand/robot/reach.hpp"
#include "steadyhand/record/step_describer.hpp"
#include "steadyhand/track/tracker.hpp"

namespace steadyhand {

namespace {

/// One run: the stages in the order of the arrows, and the clock of the recording.
class Run {
 public:
  Run(const RobotModel& model, const ReplaySettings& settings, std::unique_ptr<Planner> planner, const ReplayTaps& taps)
      : settings_(settings),
        taps_(taps),
        retargeter_(settings.retarget),
        predictor_(settings.predictor),
        planner_(std::move(planner)),
        tracker_(model.home),
        describer_(planner_->ocp()),
        arm_(model) {}

  /// Everything that happens from `now` until just before `next`: samples have been fed up to `now`.
  Status step(Time now, Time next, ReplayResult& result) {
    if (Status s = change_settings(now); !s) return s;
    const Reference reference = predictor_.predict(now);
    if (Status s = tap(reference); !s) return s;
    const Plan& plan = planner_->update(reference);
    if (Status s = tap(plan); !s) return s;
    tracker_.follow(plan);
    result.steps.push_back(describe_step(now));
    if (Status s = tap(result.steps.back()); !s) return s;
    if (taps_.keep_problems) {
      result.problems.push_back(
          to_record(planner_->ocp(), planner_->instance(), planner_->guess(), settings_.planner.tolerance));
    }
    for (; command_time() < next; ++commands_) {
      const JointCommand command = tracker_.update(command_time());
      const JointState state{command.stamp, command.q, command.dq};  // the arm follows exactly
      if (Status s = tap(command); !s) return s;
      if (Status s = tap(state); !s) return s;
      result.commands.push_back(command);
    }
    return Done{};
  }

  /// What the operator had changed by then.
  Status change_settings(Time now) {
    for (; changed_ < settings_.changes.size() && settings_.changes[changed_].at <= now; ++changed_) {
      const SettingsChange& change = settings_.changes[changed_];
      retargeter_.set_scale(change.scale);
      retargeter_.set_yaw(change.yaw);
      if (change.weights.empty()) continue;
      const Result<std::vector<JointVector>> weights = planner_->ocp().weights(change.weights);
      if (!weights)
        return Error{fmt::format("settings at {:.3f} s: {}", to_seconds(change.at), weights.error().message)};
      planner_->set_weights(*weights);
    }
    return Done{};
  }

  Status feed(const OperatorSample& sample) {
    if (Status s = change_settings(sample.stamp.hand); !s) return s;
    if (Status s = tap(sample); !s) return s;
    arm_.set_position(tracker_.update(sample.stamp.hand).q);
    const Target target = retargeter_.update(sample, {arm_.p(), Quaternion(arm_.R())});
    predictor_.update(target);
    return tap(target);
  }

 private:
  Time command_time() const { return from_seconds(static_cast<double>(commands_) / settings_.command_rate_hz); }

  template <typename Message>
  Status tap(const Message& message) {
    return taps_.recorder ? taps_.recorder->write(message) : Status(Done{});
  }
  Status tap(const Plan& plan) {
    return taps_.recorder ? taps_.recorder->write(plan, describer_.path(plan)) : Status(Done{});
  }

  PlanStep describe_step(Time now) {
    const Solution& solution = planner_->solution();
    PlanStep step = describer_.describe(planner_->plan(), now, planner_->instance(), solution.trajectory);
    step.X_base_target = predictor_.at(now);
    step.engaged = predictor_.newest().engaged;
    step.iterations = solution.iterations;
    step.solve_time_us = solution.time_us;
    step.objective = solution.objective;
    return step;
  }

  const ReplaySettings& settings_;
  const ReplayTaps& taps_;
  Retargeter retargeter_;
  Predictor predictor_;
  std::unique_ptr<Planner> planner_;
  Tracker tracker_;
  StepDescriber describer_;
  Kinematics arm_;
  std::int64_t commands_ = 0;
  std::size_t changed_ = 0;  ///< how many of the changes are in force
};

}  // namespace

Result<ReplayResult> replay(const RobotModel& model, const Recording& recording, const ReplaySettings& settings,
                            const ReplayTaps& taps) {
  if (!(settings.rate_hz >= 1.0) || settings.rate_hz > settings.command_rate_hz) {
    return Error{fmt::format("rate is {} Hz; it must be from 1 to {} Hz, the arm's rate", settings.rate_hz,
                             settings.command_rate_hz)};
  }
  auto planner = Planner::make(model, settings.ocp, settings.planner);
  if (!planner) return planner.error();

  ReplaySettings resolved = settings;
  const Reach reach = compute_reach(model);
  resolved.predictor.horizon = settings.ocp.horizon;
  resolved.predictor.dt = settings.ocp.dt;
  resolved.predictor.reach_center = reach.center;
  resolved.predictor.reach = reach.radius;

  ReplayResult result;
  Run run(model, resolved, std::move(*planner), taps);
  const Time first = recording.samples.front().stamp.hand, last = recording.samples.back().stamp.hand;
  const auto steps = static_cast<std::int64_t>(std::floor(to_seconds(last - first) * settings.rate_hz)) + 1;
  std::size_t fed = 0;
  for (std::int64_t i = 0; i < steps; ++i) {
    const Time now = from_seconds(static_cast<double>(i) / settings.rate_hz);
    const Time next = from_seconds(static_cast<double>(i + 1) / settings.rate_hz);
    for (; fed < recording.samples.size() && recording.samples[fed].stamp.hand - first <= now; ++fed) {
      OperatorSample sample = recording.samples[fed];
      sample.stamp.hand -= first;
      sample.stamp.made = sample.stamp.hand;
      if (Status s = run.feed(sample); !s) return s.error();
    }
    if (Status s = run.step(now, next, result); !s) return s.error();
    if (taps.progress) taps.progress(static_cast<double>(i + 1) / static_cast<double>(steps));
  }
  return result;
}

}  // namespace steadyhand

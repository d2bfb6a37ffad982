#include "steadyhand/report/replay/replay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/files/record/step_describer.hpp"

namespace steadyhand {

namespace {

/// One run in the recording's own time.
class Run {
 public:
  Run(const ReplaySettings& settings, Pipeline& pipeline, const ReplayTaps& taps)
      : settings_(settings), taps_(taps), pipeline_(pipeline), describer_(pipeline.planner().ocp().model()) {
    (void)describer_.set_cell(settings.cell, Time(0));  // it has been checked
  }

  /// Processes everything from `now` until just before `next`. Samples have been fed up to `now`.
  Status step(Time now, Time next, ReplayResult& result) {
    if (Status s = change_settings(now); !s) return s;
    if (Status s = change_cell(now); !s) return s;
    const Plan& plan = pipeline_.plan(now);
    const Planner& planner = pipeline_.planner();
    if (Status s = tap(planner.instance().reference); !s) return s;
    if (Status s = tap(plan); !s) return s;
    result.steps.push_back(describe_step(now));
    if (Status s = tap(result.steps.back()); !s) return s;
    if (taps_.keep_problems) {
      result.problems.push_back(
          to_record(planner.ocp(), planner.instance(), planner.guess(), settings_.pipeline.planner.tolerance));
    }
    for (; command_time() < next; ++commands_) {
      const JointCommand command = pipeline_.command(command_time());
      const JointState state{command.stamp, command.q, command.dq};  // the arm follows exactly
      if (Status s = tap(command); !s) return s;
      if (Status s = tap(state); !s) return s;
      result.commands.push_back(command);
    }
    return Done{};
  }

  /// Applies the operator's changes up to now.
  Status change_settings(Time now) {
    for (; changed_ < settings_.changes.size() && settings_.changes[changed_].at <= now; ++changed_) {
      const SettingsChange& change = settings_.changes[changed_];
      for (int t = 0; t < pipeline_.model().tool_count(); ++t) {
        pipeline_.retargeter(t).set_scale(change.scale);
        pipeline_.retargeter(t).set_yaw(change.yaw);
        if (change.tilt) pipeline_.retargeter(t).set_tilt_max(*change.tilt);
        if (const auto model = prediction_of(change.prediction)) pipeline_.predictor(t).set_model(*model);
      }
      if (change.no_spill) pipeline_.planner().set_no_spill(*change.no_spill);
      if (const LiquidSettings* liquid = pipeline_.planner().ocp().liquid(); liquid && change.fill) {
        GlassSettings glass = liquid->glass;
        glass.fill = *change.fill;
        for (int t = 0; t < pipeline_.model().tool_count(); ++t) {
          if (Status s = pipeline_.planner().set_glass(glass, t); !s)
            return Error{fmt::format("settings at {:.3f} s: {}", to_seconds(change.at), s.error().message)};
        }
      }
      if (change.weights.empty()) continue;
      const Result<std::vector<JointVector>> weights = pipeline_.planner().ocp().weights(known(change.weights));
      if (!weights)
        return Error{fmt::format("settings at {:.3f} s: {}", to_seconds(change.at), weights.error().message)};
      pipeline_.planner().set_weights(*weights);
    }
    return Done{};
  }

  /// Removes the terms that the session had only for a profile other than the replayed one.
  Weights known(Weights weights) const {
    const auto has = [](const Objectives& objectives, const std::string& name) {
      return std::any_of(objectives.begin(), objectives.end(), [&](const auto& each) { return each->name() == name; });
    };
    std::erase_if(weights, [&](const auto& weight) {
      return has(optional_objectives(), weight.first) && !has(pipeline_.planner().ocp().objectives(), weight.first);
    });
    return weights;
  }

  /// Applies the changes of obstacles up to now.
  Status change_cell(Time now) {
    for (; cells_ < settings_.cells.size() && settings_.cells[cells_].at <= now; ++cells_) {
      const auto& [at, cell] = settings_.cells[cells_];
      const auto refuse = [at = at](const Error& error) {
        return Error{fmt::format("cell at {:.3f} s: {}", to_seconds(at), error.message)};
      };
      Result<Obstacles> obstacles = obstacles_of(cell, pipeline_.model());
      if (!obstacles) return refuse(obstacles.error());
      obstacles->time = at;
      if (Status s = pipeline_.planner().set_obstacles(*obstacles); !s) return refuse(s.error());
      (void)describer_.set_cell(cell, at);  // it has been checked
      if (Status s = taps_.recorder ? taps_.recorder->write(now, cell_after(cell, to_seconds(now - at))) : Done{}; !s)
        return s;
    }
    return Done{};
  }

  Status feed(const OperatorSample& sample) {
    if (Status s = change_settings(sample.stamp.hand); !s) return s;
    if (Status s = tap(sample); !s) return s;
    if (Status s = pipeline_.feed(sample); !s) return s;
    seen_[sample.tool] = true;
    return tap(pipeline_.target(sample.tool));
  }

 private:
  Time command_time() const { return from_seconds(static_cast<double>(commands_) / settings_.command_rate_hz); }

  template <typename Message>
  Status tap(const Message& message) {
    return taps_.recorder ? taps_.recorder->write(message) : Status(Done{});
  }
  Status tap(const Plan& plan) {
    return taps_.recorder ? taps_.recorder->write(plan, describer_.paths(plan)) : Status(Done{});
  }

  PlanStep describe_step(Time now) {
    Planner& planner = pipeline_.planner();
    PlanStep step = describer_.describe(planner.plan(), now, planner.ocp().horizon(), planner.figures());
    for (int t = 0; t < step.tool_count; ++t) {
      const Predictor& predictor = pipeline_.predictor(t);
      step.tools[t].X_base_target = seen_[t] ? predictor.at(now) : step.tools[t].X_base_planned;
      step.tools[t].engaged = predictor.newest().engaged;
    }
    return step;
  }

  const ReplaySettings& settings_;
  const ReplayTaps& taps_;
  Pipeline& pipeline_;
  StepDescriber describer_;
  std::int64_t commands_ = 0;
  std::size_t changed_ = 0;  ///< how many of the changes are in force
  std::size_t cells_ = 0;    ///< likewise
  PerTool<bool> seen_{};     ///< hands, by the tool that they move
};

}  // namespace

Result<ReplayResult> replay(const RobotModel& model, const Recording& recording, const ReplaySettings& settings,
                            const ReplayTaps& taps) {
  const double rate_hz = settings.pipeline.rate_hz;
  if (!(settings.command_rate_hz >= 1.0) || settings.command_rate_hz > 1e5)
    return Error{fmt::format("the arm's rate is {} Hz; it must be from 1 to 1e5", settings.command_rate_hz)};
  if (!(rate_hz >= 1.0) || rate_hz > settings.command_rate_hz) {
    return Error{
        fmt::format("rate is {} Hz; it must be from 1 to {} Hz, the arm's rate", rate_hz, settings.command_rate_hz)};
  }
  if (recording.samples.size() < 2) {
    return Error{fmt::format("recording: holds {} samples; a recording needs at least 2", recording.samples.size())};
  }
  Time newest = Time::min();
  PerTool<Time> seen;  // the newest of each hand
  seen.fill(newest);
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    const Time now = recording.samples[i].stamp.hand;
    const int tool = recording.samples[i].tool, tools = model.tool_count();
    if (tool < 0 || tool >= tools) {
      return Error{
          fmt::format("recording: sample {} is of the hand that moves tool {}; robot '{}' has {}. A robot needs a "
                      "tool for each hand of the recording, as two_ur5e has for two",
                      i, tool, model.name, tools == 1 ? "tool 0 alone" : "the tools 0 and 1")};
    }
    if (now < newest || now <= seen[tool]) {
      return Error{fmt::format("recording: sample {} is at {} s, and that before it at {} s; times must increase", i,
                               to_seconds(now), to_seconds(newest))};
    }
    newest = seen[tool] = now;
  }
  const Result<Obstacles> obstacles = obstacles_of(settings.cell, model);
  if (!obstacles) return obstacles.error();
  PipelineSettings around = settings.pipeline;
  around.planner.obstacles = *obstacles;
  if (!settings.cells.empty() && around.ocp.obstacle_rows == 0) around.ocp.obstacle_rows = kUsualObstacleRows;
  const auto spares = [](const SettingsChange& change) { return change.no_spill.value_or(false); };
  if (!around.ocp.liquid && std::any_of(settings.changes.begin(), settings.changes.end(), spares))
    around.ocp.liquid.emplace();
  auto pipeline = Pipeline::make(model, around);
  if (!pipeline) return pipeline.error();

  ReplayResult result;
  Run run(settings, **pipeline, taps);
  const Time first = recording.samples.front().stamp.hand, last = recording.samples.back().stamp.hand;
  const auto steps = static_cast<std::int64_t>(std::floor(to_seconds(last - first) * rate_hz)) + 1;
  std::size_t fed = 0;
  for (std::int64_t i = 0; i < steps; ++i) {
    const Time now = from_seconds(static_cast<double>(i) / rate_hz);
    const Time next = from_seconds(static_cast<double>(i + 1) / rate_hz);
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

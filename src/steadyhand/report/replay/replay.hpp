#pragma once

#include <functional>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/input/recording.hpp"
#include "steadyhand/files/record/cell_change.hpp"
#include "steadyhand/files/record/problem_json.hpp"
#include "steadyhand/files/record/recorder.hpp"
#include "steadyhand/files/record/settings_change.hpp"
#include "steadyhand/files/record/step.hpp"
#include "steadyhand/planning/pipeline/pipeline.hpp"

namespace steadyhand {

struct ReplaySettings {
  PipelineSettings pipeline;
  Cell cell;                       ///< replaces the planner's obstacles
  double command_rate_hz = 500.0;  ///< rate of the arm's commands
  /// The operator's changes during the run, in order; times count from the recording's first sample.
  std::vector<SettingsChange> changes;
  /// Later cells that replace `cell`, likewise.
  std::vector<CellChange> cells;
};

/// Result of one run, in addition to what the recorder wrote.
struct ReplayResult {
  std::vector<PlanStep> steps;
  std::vector<JointCommand> commands;
  std::vector<ProblemRecord> problems;  ///< one for each step, if requested
};

struct ReplayTaps {
  Recorder* recorder = nullptr;  ///< gets the data of every connection; may be null
  bool keep_problems = false;
  std::function<void(double fraction)> progress;  ///< called now and then; may be empty
};

/// Sends a recording through a Pipeline in the recording's own time, as in a live session with a planner that needs no
/// time and an arm that follows exactly. Equal input gives equal results, except solve times. Fails on settings or
/// changes out of range, with the reason.
Result<ReplayResult> replay(const RobotModel& model, const Recording& recording, const ReplaySettings& settings,
                            const ReplayTaps& taps);

}  // namespace steadyhand

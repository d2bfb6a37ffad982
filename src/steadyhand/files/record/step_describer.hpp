#pragma once

#include "steadyhand/files/record/step.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/planning/plan/planner.hpp"

namespace steadyhand {

/// Those of RobotModel::pairs whose bodies are on different arms.
std::vector<BodyPair> pairs_between_arms(const RobotModel& model);

/// Computes the data of a planning step for log and report. One thread.
class StepDescriber {
 public:
  /// The model must outlive it.
  explicit StepDescriber(const RobotModel& model) : arm_(model), between_arms_(pairs_between_arms(model)) {}

  /// Obstacles around the arm from here on, as they are at a time in the clock of `describe`. None at first.
  Status set_cell(const Cell& cell, Time at);
  /// Motion, distances and what was solved; where the targets were is left to the caller.
  /// @param horizon intervals of the plan, from `at` on, that the distances are of
  PlanStep describe(const Plan& plan, Time at, int horizon, const SolveFigures& solved);
  /// X_base_tool of each tool at the plan's nodes; valid until the next call.
  const ToolPaths& paths(const Plan& plan);

 private:
  Kinematics arm_;
  std::vector<BodyPair> between_arms_;
  Cell cell_;
  Obstacles obstacles_;  ///< its objects, in the same order
  ToolPaths paths_;
};

}  // namespace steadyhand

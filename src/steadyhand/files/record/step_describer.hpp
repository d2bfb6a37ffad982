#pragma once

#include "steadyhand/files/record/step.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"

namespace steadyhand {

/// Makes what log and report tell of a planning step. One thread.
class StepDescriber {
 public:
  /// The Ocp must outlive it.
  explicit StepDescriber(const Ocp& ocp) : evaluation_(ocp), arm_(ocp.model()) {}
  const Ocp& ocp() const { return evaluation_.ocp(); }

  /// What stands around the arm from here on: as it is at a time, in the clock of `describe`. None at first.
  Status set_cell(const Cell& cell, Time at);
  /// Motion, distances and shares of the objective; what the solver did and where the target was is left to the caller.
  /// @param trajectory the solution of the instance
  PlanStep describe(const Plan& plan, Time at, const OcpInstance& instance, const Trajectory& trajectory);
  /// X_base_tool at the plan's nodes; valid until the next call.
  const std::vector<Pose>& path(const Plan& plan);

 private:
  Evaluation evaluation_;
  Kinematics arm_;
  Cell cell_;
  Obstacles obstacles_;  ///< its objects, in the same order
  std::vector<Pose> path_;
};

}  // namespace steadyhand

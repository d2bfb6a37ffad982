#pragma once

#include "steadyhand/ocp/evaluation.hpp"
#include "steadyhand/record/step.hpp"

namespace steadyhand {

/// Makes what log and report tell of a planning step. One thread.
class StepDescriber {
 public:
  /// The Ocp must outlive it.
  explicit StepDescriber(const Ocp& ocp) : evaluation_(ocp), arm_(ocp.model()) {}

  /// Motion, distances and shares of the objective; what the solver did and where the target was is left to the caller.
  /// @param trajectory the solution of the instance
  PlanStep describe(const Plan& plan, Time at, const OcpInstance& instance, const Trajectory& trajectory);
  /// X_base_tool at the plan's nodes; valid until the next call.
  const std::vector<Pose>& path(const Plan& plan);

 private:
  Evaluation evaluation_;
  Kinematics arm_;
  std::vector<Pose> path_;
};

}  // namespace steadyhand

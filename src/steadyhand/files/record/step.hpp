#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/names.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

constexpr auto names_of(PlanOrigin) {
  using enum PlanOrigin;
  return named("PlanOrigin", {Name{kSolved, "solved"}, Name{kFeasible, "feasible"}, Name{kPrevious, "previous"}});
}

/// A tool in a planning step.
struct ToolStep {
  Pose X_base_target;                     ///< newest target when the step began; controlled frame in base
  Pose X_base_planned;                    ///< controlled frame in base at x_0: where the plan is at that time
  Vector3 local_acceleration = kGravity;  ///< m/s^2, R' (p'' + g) of x_0, u_0: [0, 0, 9.81] when the glass is at rest
  bool engaged = false;                   ///< it followed the hand
};

/// One planning step: a row of plan.csv, a message on /plan_step, a point of every curve of the report.
struct PlanStep {
  double t_s = 0;                               ///< s, start of the plan
  int tool_count = 1;                           ///< entries of tools
  PerTool<ToolStep> tools;                      ///< of each
  JointVector q;                                ///< of x_0; rad (m for prismatic joints)
  JointVector dq;                               ///< of x_0; rad/s
  JointVector ddq;                              ///< u_0; rad/s^2
  double objective = 0;                         ///< J of the plan
  std::array<double, kMaxObjectives> shares{};  ///< what each term adds to J, in the order of the run's term names
  int iterations = 0;                           ///< the solver's
  double solve_time_us = 0;                     ///< wall clock, us
  PlanOrigin status = PlanOrigin::kSolved;      ///< anything but kSolved counts as a failure
  double smallest_sphere_distance_m = 0;        ///< m, surface to surface, over all pairs and the nodes of the horizon
  /// m, the same of pairs whose bodies are on different arms; infinite if there are none.
  double distance_between_arms_m = std::numeric_limits<double>::infinity();
  /// m, by name of each object of the cell: distance at `t_s`, without margin, to the bodies that must not touch it.
  std::vector<std::pair<std::string, double>> object_distances;
};

/// Poses of each tool at the nodes of a plan; none of tools that the robot does not have.
using ToolPaths = PerTool<std::vector<Pose>>;

/// Names of a run's joints, terms and tools; the same for every step.
struct RunNames {
  std::vector<std::string> joints;       ///< n
  std::vector<std::string> joint_units;  ///< n: "rad" or "m"
  std::vector<std::string> terms;        ///< the objectives' names, at most kMaxObjectives
  std::vector<std::string> tools{};      ///< those of the robot; none: one, whose name is not known

  int tool_count() const { return std::max(1, static_cast<int>(tools.size())); }  ///< how many tools
};

/// Those of runs with these joints and objectives.
RunNames run_names(const RobotModel& model, const Objectives& objectives);

}  // namespace steadyhand

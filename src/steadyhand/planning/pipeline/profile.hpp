#pragma once

#include <string>
#include <vector>

#include "steadyhand/planning/ocp/ocp.hpp"
#include "steadyhand/planning/plan/planner.hpp"
#include "steadyhand/planning/predict/predictor.hpp"
#include "steadyhand/planning/retarget/retargeter.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

/// How the arm follows the hand: a profile file, profiles/NAME.yaml.
struct Profile {
  std::string name;                                       ///< in paths and tables
  std::string label;                                      ///< for people
  OcpSettings ocp;                                        ///< objectives with their weights, constraints, horizon
  Prediction prediction = Prediction::kConstantVelocity;  ///< prediction of the hand
  double tilt_max = M_PI;                                 ///< rad, see RetargetSettings
  /// Share of the file's weights of position and orientation that each tool has in `ocp`; empty: all.
  std::vector<double> priority;
  std::string solver = kDefaultSolver;  ///< see solver_names()
  double tolerance = 1e-6;              ///< tolerance of the KKT conditions
};

/// Fails for what needs two tools, an objective with a weight or a priority, if the robot has one.
Status suits(const Profile& profile, const RobotModel& robot);

/// Writes the profile's values to the settings of the stages; other values do not change.
void apply(const Profile& profile, RetargetSettings& retarget, PredictorSettings& predictor, OcpSettings& ocp,
           PlannerSettings& planner);

/// Comma-separated keys of profile files whose values differ so that each profile needs its own planner. Empty: one
/// planner serves both; their weights, prediction and tilt, and whether the liquid counts, may change while the arm
/// moves.
std::string planner_differences(const Profile& a, const Profile& b);

}  // namespace steadyhand

#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/core/math.hpp"

namespace steadyhand {

class Constraint;
class Objective;
struct OcpSettings;
struct RobotModel;

/// Terms are const and may be shared by problems, also of several threads.
using Objectives = std::vector<std::shared_ptr<const Objective>>;
/// Makes a constraint for a robot, which must outlive it; null where the robot needs none.
using ConstraintMaker = std::function<std::shared_ptr<const Constraint>(const RobotModel&, const OcpSettings&)>;

/// Those of docs/explanation/formulation.md: a new one is added there (ocp.cpp), in one line.
Objectives default_objectives();
/// More of them, which a problem has where its weights name them.
Objectives optional_objectives();
std::vector<ConstraintMaker> default_constraints();

/// By name of an objective; one number stands for all of its entries.
using Weights = std::map<std::string, std::vector<double>>;

/// The liquid in the problem, which shall not be spilled.
struct LiquidSettings {
  GlassSettings glass;
  /// m, by which the wave of the first mode stays below the rim: crests stand above it. In a glass that is full nearly
  /// to the rim three quarters of what is left, if that is less.
  double margin = 5e-3;
  /// Frequencies of the liquids for which a plan is made, times the glass's.
  std::array<double, 3> frequencies = {0.97, 1.0, 1.03};
  double price = 200.0;  ///< units of the objective per m of wave above the margin, at each node
  /// (0, 1): the least specific force along the glass's axis, in g. Below it the liquid comes loose.
  double least_weight = 0.3;
  double lean_max = 20.0 * M_PI / 180.0;  ///< rad, (0, pi/2]: of the glass's axis, from the vertical
  bool operator==(const LiquidSettings&) const = default;
};

/// The optimal control problem as a profile file states it (profiles/*.yaml), and the terms that it may weigh.
struct OcpSettings {
  int horizon = 8;                  ///< N, intervals, 1..kMaxHorizon
  double dt = 0.05;                 ///< s
  Weights weights;                  ///< an objective that is absent has weight 0
  double velocity_scale = 1.0;      ///< (0, 1], of the robot's velocity limits
  double acceleration_scale = 1.0;  ///< (0, 1], of the robot's acceleration limits
  /// rad (m), by which the joints stay inside their position limits at the nodes; empty: not at all.
  JointVector position_margin;
  /// Pairs of a body and an obstacle that one problem sees, the nearest ones; at most kMaxObstacleRows. 0: the problem
  /// knows none. What the rows do not tell, the check of the plan does: kUsualObstacleRows are enough.
  int obstacle_rows = 0;
  std::optional<LiquidSettings> liquid;          ///< none: nothing is known of a liquid
  Objectives objectives = default_objectives();  ///< kMaxObjectives of them at most, each of its own name
  std::vector<ConstraintMaker> constraints = default_constraints();
};

/// Adds the optional objectives that the weights name and `objectives` has not.
void add_optional_objectives(OcpSettings& settings);

}  // namespace steadyhand

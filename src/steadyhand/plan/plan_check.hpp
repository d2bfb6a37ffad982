#pragma once

#include <string_view>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/robot/kinematics.hpp"

namespace steadyhand {

struct PlanCheckSettings {
  double command_rate_hz = 500.0;  ///< limits are checked at every command
  double tolerance = 1e-5;         ///< rad, rad/s, rad/s^2 (m...): how far beyond a limit counts as inside
  /// m: how deep spheres may overlap between nodes, where the optimal control problem does not look.
  double overlap_between_nodes = 2e-3;
  /// m/s, where the arm's own safety system has such limits: of the tool, and of the elbow (the third joint), at nodes and
  /// half-way; 0: none.
  double tool_speed_max = 0.0, elbow_speed_max = 0.0;
};

enum class PlanFault {
  kNone,
  kNotFinite,
  kNotAtRest,
  kDiscontinuous,
  kPosition,
  kVelocity,
  kAcceleration,
  kSelfCollision,
  kToolSpeed,
  kElbowSpeed
};
std::string_view to_string(PlanFault fault);

/// The last thing before a plan may be followed: finite numbers, states that obey the double integrator, position,
/// velocity and acceleration limits of the model at every command, sphere distances at all times (gaps.hpp), and rest at
/// the end. A plan that begins beyond one of these may lead back, or rest there, and no further beyond. Allocates
/// nothing.
/// @param before state at plan.start of what is being followed: the plan must continue it
PlanFault check_plan(const Plan& plan, const StateVector& before, const PlanCheckSettings& settings,
                     Kinematics& kinematics);

}  // namespace steadyhand

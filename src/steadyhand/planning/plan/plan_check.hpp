#pragma once

#include <string_view>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/geometry/collision/obstacle.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

/// Limits of a plan. Limits of joints and pairs of bodies are in the model.
struct PlanCheckSettings {
  double command_rate_hz = 500.0;  ///< limits are checked at every command
  double tolerance = 1e-5;         ///< rad, rad/s, rad/s^2 (m...): violations and overlaps up to this are ignored
  /// m/s, of the tool at nodes and half-way, if the arm's own safety system has such a limit; 0: none.
  double tool_speed_max = 0.0;
  double elbow_speed_max = 0.0;  ///< m/s, the same of the elbow (the third joint)
};

/// Why a plan may not be followed: the first fault found.
enum class PlanFault {
  kNone,           ///< no fault
  kNotFinite,      ///< a number is not finite
  kNotAtRest,      ///< its end is not at rest
  kDiscontinuous,  ///< it does not continue the followed plan, or is not a double integrator's
  kPosition,       ///< limit of a joint
  kVelocity,       ///< limit of a joint
  kAcceleration,   ///< limit of a joint
  kSelfCollision,  ///< a pair of bodies overlaps
  kObstacle,       ///< a body overlaps an obstacle
  kToolSpeed,      ///< PlanCheckSettings::tool_speed_max
  kElbowSpeed,     ///< PlanCheckSettings::elbow_speed_max
  kSpill           ///< a wave over the rim that the followed plan does not have
};
/// Text for messages and recordings.
std::string_view to_string(PlanFault fault);

/// The last check before a plan may be followed: finite numbers, states that obey the double integrator, position,
/// velocity and acceleration limits of the model at every command, distances of bodies to each other and to obstacles
/// at all times, and rest at the end. A plan that starts beyond one of these may move back, or stop
/// there, but not further beyond. Moving obstacles may come as near as if the arm braked at once. Allocates nothing.
/// @param before state of the followed plan at plan.start: the plan must continue it
PlanFault check_plan(const Plan& plan, const StateVector& before, const PlanCheckSettings& settings,
                     Kinematics& kinematics, const Obstacles& obstacles = kNoObstacles);

/// What is left of a plan from a time on, once its numbers have passed: distances of bodies to each other and to
/// obstacles, and the speeds of tool and elbow. Allocates nothing.
PlanFault check_way(const Plan& plan, Time from, const PlanCheckSettings& settings, Kinematics& kinematics,
                    const Obstacles& obstacles);

}  // namespace steadyhand

#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "steadyhand/core/histogram.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/planning/plan/active_constraint.hpp"
#include "steadyhand/session/supervise/state.hpp"

namespace steadyhand {

/// One look at a live session.
struct SessionSnapshot {
  Time now{0};  ///< of the session's clock
  SupervisionState state = SupervisionState::kIdle;
  std::string_view reason;  ///< why it is in this state; static text
  Cause cause;              ///< the same for programs
  ActiveConstraint constraint;
  Target target;  ///< without a grip, where the controlled frame is: the next grip begins there
  JointState measured;
  JointCommand command;
  Pose X_base_tool;              ///< where the controlled frame is, from `measured`
  Vector3 local_acceleration;    ///< m/s^2, glass frame, a liquid at rest feels [0, 0, 9.81]
  double tracking_error = 0.0;   ///< m, target to controlled frame; NaN without a grip
  double clearance = 0.0;        ///< m, of the nearest pair of bodies
  std::array<int, 2> nearest{};  ///< that pair
  int path_nodes = 0;
  std::array<Pose, kMaxHorizon + 1> path;  ///< of the controlled frame at the plan's nodes; path_nodes of them
  Reference prediction;                    ///< where the hand is expected; no nodes without a grip
  LiquidState liquid;
  TimingSummary solve_us, latency_us;  ///< planner's solve; hand to command
  TimingSummary wake_us;               ///< how late control cycles began
  std::uint64_t plans = 0, cycles = 0, missed_deadlines = 0, rejected_plans = 0, samples = 0;
  double planner_rate_hz = 0.0;
  bool planner_rate_automatic = false;  ///< it follows what the machine sustains
};

}  // namespace steadyhand

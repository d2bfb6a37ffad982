#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/planning/plan/active_constraint.hpp"
#include "steadyhand/planning/plan/planner.hpp"
#include "steadyhand/session/live/live_settings.hpp"
#include "steadyhand/session/supervise/supervision.hpp"

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

/// They are in force from here on.
struct AppliedSettings {
  Time at{0};
  OperatorSettings settings;
};

/// A planning step that asked the solver, as far as the report tells of it.
struct PlanningRecord {
  Time at{0};  ///< where its plan begins
  Plan plan;   ///< what is followed from there on, if the step failed the plan before
  Pose X_base_target;
  Reference reference;
  const Ocp* ocp = nullptr;  ///< what was solved; lives as long as the session
  SolveFigures solved;
  bool engaged = false;  ///< following the hand, not coming to rest
};

/// Gets a copy of everything that went through a live session, from one thread that is neither control nor planner,
/// some hundred times a second. Any may be empty.
struct LiveTaps {
  std::function<void(const OperatorSample&)> sample;
  std::function<void(const Target&)> target;
  std::function<void(const AppliedSettings&)> settings;
  /// What stands around the arm from a time on, which is also when what moves is where it says; first as it begins.
  std::function<void(Time, const Cell&)> cell;
  std::function<void(const PlanningRecord&)> step;
  std::function<void(const JointCommand&)> command;
  std::function<void(const JointState&)> state;
  std::function<void(const SupervisionChange&)> change;
  std::function<void(const SessionSnapshot&)> look;  ///< after each round, 100 times a second
};

/// What the whole session's commands and measured motion came to. Whatever is more than rounding counts, and by how
/// much is told.
struct MonitorResult {
  std::uint64_t commands = 0, states = 0;
  /// Commands out of the model's limits of position, speed or acceleration, by their own word or by what became of them
  /// from one to the next, however long that took.
  std::uint64_t beyond_limits = 0;
  std::uint64_t too_fast = 0;    ///< measured states beyond a speed limit
  std::uint64_t in_contact = 0;  ///< commands that let a pair of bodies overlap
  // ---- the most by which anything was beyond a limit, 0: nothing was
  double position_excess = 0.0;      ///< rad (m)
  double speed_excess = 0.0;         ///< rad/s (m/s)
  double acceleration_excess = 0.0;  ///< rad/s^2 (m/s^2)
  double step = 0.0;                 ///< rad (m): of a command, beyond where those accelerations lead
  double measured_excess = 0.0;      ///< rad/s (m/s), of measured speed
  double smallest_clearance = std::numeric_limits<double>::infinity();  ///< m, over all commands; < 0: overlap
  std::array<std::string, 2> nearest;  ///< names of the pair of bodies at that, what is carried included
  // ---- of obstacles, without their margins, and the bodies that must not touch them
  std::uint64_t touching = 0;                                          ///< commands that let any overlap
  double smallest_distance = std::numeric_limits<double>::infinity();  ///< m, over all commands; < 0: overlap
  std::string nearest_body;      ///< its name, at that; empty: there was no obstacle
  std::string nearest_obstacle;  ///< likewise
};
/// In two lines or more, for people.
std::string to_text(const MonitorResult& result);

/// What a session came to, for people.
struct LiveSummary {
  double duration = 0.0, engaged = 0.0;  ///< s
  std::uint64_t engagements = 0, samples = 0, dropped_samples = 0, plans = 0, failed_plans = 0, late_plans = 0;
  std::uint64_t cycles = 0, missed_deadlines = 0, tap_drops = 0;
  TimingSummary latency_us, solve_us, wake_us;
  MonitorResult monitor;
  bool spilled = false;
  /// Why the arm did not follow although the clutch was closed or a stop was asked for, and how often.
  std::vector<std::pair<std::string, std::uint64_t>> holds;
};

}  // namespace steadyhand

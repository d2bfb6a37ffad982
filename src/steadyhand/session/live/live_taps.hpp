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

/// A tool, and the hand that moves it, at one time.
struct ToolSnapshot {
  SupervisionState state = SupervisionState::kIdle;  ///< whether it follows its hand
  std::string_view reason;                           ///< why; static text
  Cause cause;                                       ///< the same for programs
  Target target;                                     ///< if not engaged, the controlled frame: engaging starts there
  Pose X_base_tool;                                  ///< where the controlled frame is, from SessionSnapshot::measured
  Vector3 local_acceleration;                        ///< m/s^2, glass frame, a liquid at rest feels [0, 0, 9.81]
  double tracking_error = 0.0;                       ///< m, target to controlled frame; NaN if not engaged
  std::optional<double> gripper;                     ///< measured, 0 open to 1 closed; none: it is no gripper
  std::optional<double> gripper_command;             ///< where it is commanded to be
  int path_nodes = 0;                                ///< entries of path
  std::array<Pose, kMaxHorizon + 1> path;            ///< controlled frame at the plan's nodes; path_nodes of them
  int predicted = 0;                                 ///< nodes of prediction; none if not engaged
  ToolReference prediction;                          ///< predicted hand
  LiquidState liquid;                                ///< as the monitor has it
};

/// State of a live session at one time.
struct SessionSnapshot {
  Time now{0};  ///< time of the session's clock
  /// State of the supervision: if not that of all tools, kEngaged or else kHolding if that of any.
  SupervisionState state = SupervisionState::kIdle;
  std::string_view reason;              ///< why it is in this state; static text
  Cause cause;                          ///< the same for programs
  ActiveConstraint constraint;          ///< active limit
  JointState measured;                  ///< newest
  JointCommand command;                 ///< newest
  int tool_count = 1;                   ///< entries of tools
  PerTool<ToolSnapshot> tools;          ///< of each
  double clearance = 0.0;               ///< m, of the nearest pair of bodies
  std::array<int, 2> nearest{};         ///< that pair
  TimingSummary solve_us;               ///< planner's solve
  TimingSummary latency_us;             ///< hand to command
  TimingSummary wake_us;                ///< how late control cycles began
  std::uint64_t plans = 0;              ///< plans that were followed, since the session started
  std::uint64_t cycles = 0;             ///< cycles of the arm, likewise
  std::uint64_t missed_deadlines = 0;   ///< cycles that control missed
  std::uint64_t rejected_plans = 0;     ///< too late, or failed
  std::uint64_t samples = 0;            ///< samples of the hand
  double planner_rate_hz = 0.0;         ///< planning steps a second
  bool planner_rate_automatic = false;  ///< it follows what the machine sustains
};

/// Settings that are in force from a time on.
struct AppliedSettings {
  Time at{0};                 ///< session's clock
  OperatorSettings settings;  ///< all of them
};

/// A planning step that ran the solver: the data that reports use.
struct PlanningRecord {
  Time at{0};                   ///< start of its plan
  Plan plan;                    ///< followed from there on; the plan before if the step failed
  PerTool<Pose> X_base_target;  ///< of the newest hands
  Reference reference;          ///< reference of the solve
  const Ocp* ocp = nullptr;     ///< the solved problem; lives as long as the session
  SolveFigures solved;          ///< result of the solve
  PerTool<bool> engaged{};      ///< following the hand, not stopping
};

/// Get copies of all data of a live session, about a hundred times a second, on one thread that is neither control nor
/// planner. Any may be empty.
struct LiveTaps {
  std::function<void(const OperatorSample&)> sample;     ///< each sample that arrived
  std::function<void(const Target&)> target;             ///< each new target
  std::function<void(const AppliedSettings&)> settings;  ///< as they take effect
  /// Obstacles from a time on, when moving ones are at their positions; called first at the start.
  std::function<void(Time, const Cell&)> cell;
  std::function<void(const PlanningRecord&)> step;       ///< see PlanningSettings::tap_period
  std::function<void(const JointCommand&)> command;      ///< each
  std::function<void(const JointState&)> state;          ///< each
  std::function<void(const SupervisionChange&)> change;  ///< each
  std::function<void(const SessionSnapshot&)> look;      ///< after each round, 100 times a second
};

/// Violations in the whole session's commands and measured motion. Every excess beyond rounding counts, with its size.
struct MonitorResult {
  std::uint64_t commands = 0;  ///< commands checked
  std::uint64_t states = 0;    ///< measured, likewise
  /// Commands out of the model's limits of position, speed or acceleration, in their own values or in the change from
  /// one to the next, over any time between them.
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

/// Summary of a session, for people.
struct LiveSummary {
  double duration = 0.0;               ///< s
  double engaged = 0.0;                ///< s, of following a hand, or both
  std::uint64_t engagements = 0;       ///< how often following began
  std::uint64_t samples = 0;           ///< samples of the hand
  std::uint64_t dropped_samples = 0;   ///< out of order or too old
  std::uint64_t plans = 0;             ///< that were followed
  std::uint64_t failed_plans = 0;      ///< not solved, or refused by the check
  std::uint64_t late_plans = 0;        ///< that came after their beginning
  std::uint64_t cycles = 0;            ///< cycles of the arm
  std::uint64_t missed_deadlines = 0;  ///< cycles that control missed
  std::uint64_t tap_drops = 0;         ///< what the taps missed
  TimingSummary latency_us;            ///< as SessionSnapshot has it
  TimingSummary solve_us;              ///< the same
  TimingSummary wake_us;               ///< the same
  MonitorResult monitor;               ///< what an independent look at it found
  bool spilled = false;                ///< any liquid, at any time
  /// Why the arm did not follow although the clutch was closed or a stop was asked for, and how often.
  std::vector<std::pair<std::string, std::uint64_t>> holds;
};

}  // namespace steadyhand

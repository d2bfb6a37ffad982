#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"
#include "steadyhand/planning/pipeline/profile.hpp"
#include "steadyhand/planning/plan/plan_check.hpp"
#include "steadyhand/planning/plan/planner.hpp"
#include "steadyhand/planning/predict/predictor.hpp"
#include "steadyhand/planning/retarget/retargeter.hpp"
#include "steadyhand/session/supervise/supervision.hpp"

namespace steadyhand {

/// Tolerances of the control loop, and how it stops.
struct ControlSettings {
  SupervisorSettings supervisor;  ///< when the arm is no longer engaged
  double path_tolerance = 0.05;   ///< rad (m), any joint, measured to commanded a delay ago
  /// The arm stops after this many missed cycles in a row. After fewer, commands continue from where the arm moved
  /// meanwhile.
  std::uint64_t stall_cycles = 50;
  /// s that a stop may take beyond the shortest time to keep the liquid in; 0: always the shortest.
  double soft_stop = 0.5;
  double arm_delay = 0.0;   ///< s, see ArmInfo
  PerTool<bool> gripper{};  ///< the tool is one, see ArmInfo
  PlanCheckSettings check;  ///< limits of straight stops
  Obstacles obstacles;      ///< initial obstacles for those stops
};

/// Settings of the planner: problem, solver, look-ahead.
struct PlanningSettings {
  /// s of the control cycles; plans begin just before one, the first at least `look_ahead` ahead. 0: anywhere.
  double cycle = 0.0;
  double look_ahead = 0.008;  ///< s from the start of a step to the start of its plan; covers solve and check
  /// A look-ahead that leaves the margin that sustained_rate() needs. @param period of planning, s
  static double default_look_ahead(double period) { return 0.4 * period; }
  /// s, for a stop after following: planned by the problem, with weights that keep the liquid in. The rest is
  /// straight, once the arm is slow or this time has passed.
  double rest_within = 1.0;
  /// s of following that plans keep to `first_speed_scaling` of the model's speeds and accelerations; the first
  /// engagement after it, from rest, is followed at all of them.
  double first_moves = 10.0;
  double first_speed_scaling = 1.0;        ///< (0, 1]; 1: no first moves
  double tap_period = 0.02;                ///< s between steps that taps receive; failed steps are always sent
  double sample_timeout = kSampleTimeout;  ///< s without a sample after which a closed clutch is ignored
  HandGateSettings gate;                   ///< which poses are trusted
  RetargetSettings retarget;               ///< from the hand to the target
  PredictorSettings predictor;             ///< horizon, dt and reach are set from `ocp` and the robot
  OcpSettings ocp;                         ///< objectives, constraints, horizon
  PlannerSettings planner;                 ///< solver and check of plans
  /// Further problems with their solvers, selected by OperatorSettings::planner. Objectives and first weights are those
  /// of `ocp`.
  struct Choice {
    OcpSettings ocp;                      ///< the problem
    std::string solver = kDefaultSolver;  ///< see PlannerSettings, as the next
    double tolerance = 1e-6;              ///< likewise
  };
  std::vector<Choice> more;  ///< after `ocp`, which is number 0

  PlanningSettings() = default;
  /// As the profile has it.
  explicit PlanningSettings(const Profile& profile) { apply(profile, retarget, predictor, ocp, planner); }
};

/// Settings of a live session.
struct LiveSettings {
  /// From 4 to the arm's rate; 0: the rate that this machine sustains, measured when the session is made.
  double planner_rate_hz = 0.0;
  /// The rate follows what the machine sustains while it runs. Set by Session::resolve if no rate is set.
  bool adapt_rate = false;
  /// s, see PlanningSettings::look_ahead, which this sets; 0: PlanningSettings::default_look_ahead. It is also the
  /// solver's budget: a plan that takes longer would begin in the past.
  double look_ahead = 0.0;
  bool time_budget = true;    ///< a solve ends when its look-ahead has passed; false: a session may be repeatable
  bool realtime = true;       ///< request real-time priority, locked memory, and no sleep states
  PlanningSettings planning;  ///< settings of the planner's thread
  ControlSettings control;    ///< settings of the control thread
  GlassSettings glass;        ///< glass of the monitor's liquid
  Cell cell;                  ///< obstacles

  LiveSettings() = default;
  /// As the profile has it.
  explicit LiveSettings(const Profile& profile) : planning(profile) {}
};

/// Settings that the operator can change while a session runs.
struct OperatorSettings {
  std::array<JointVector, kMaxObjectives> weights;  ///< by index of Ocp::objectives()
  int objectives = 0;                               ///< entries of weights in use; 0: weights are unchanged
  double scale = 0.5;                               ///< motion of the tool for each metre of the hand
  double yaw = 0.0;                                 ///< rad
  std::optional<Prediction> prediction;             ///< absent: unchanged
  double tilt_max = M_PI;                           ///< rad, see RetargetSettings
  bool no_spill = false;                            ///< plans spill nothing, if the problem has a liquid
  std::optional<double> fill;                       ///< m of liquid in the refilled glass; absent: unchanged
  double latency = 0.0;                             ///< s, added after the gate, see HandDelay
  /// Number of the planner: 0 for PlanningSettings::ocp, 1 for the first of PlanningSettings::more. Another one takes
  /// over once the arm is at rest. Until then none of these settings is in force, and no hand is followed.
  int planner = 0;
  std::string_view profile;  ///< profile that set these values first, kept by its setter; empty: none
};

}  // namespace steadyhand

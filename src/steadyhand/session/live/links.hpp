#pragma once

#include <atomic>
#include <optional>
#include <string_view>

#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/histogram.hpp"
#include "steadyhand/core/latest_value.hpp"
#include "steadyhand/core/spsc_ring.hpp"
#include "steadyhand/session/live/live_settings.hpp"
#include "steadyhand/session/live/live_taps.hpp"
#include "steadyhand/session/supervise/supervisor.hpp"

namespace steadyhand {

/// Control thread to planner, once a cycle.
struct ControlReport {
  Time now{0};
  SupervisionState state = SupervisionState::kIdle;
  std::uint64_t engagement = 0;  ///< see Supervisor::engagements
  std::uint64_t grip = 0;        ///< see Supervisor::grip
  bool soft_stop = false;        ///< stopping, and the planner has still time to do it
};

/// A sample and whose it is: grips of one hand are not those of another.
struct HeldSample {
  OperatorSample sample;
  std::uint64_t holder = 0;  ///< Links::holder when it came in
};

/// Control thread to whoever looks.
struct ControlView {
  Time now{0};
  SupervisionState state = SupervisionState::kIdle;
  std::string_view reason;
  Cause cause;
  JointCommand command;
  JointState measured;
  bool at_rest = false;
  std::uint64_t stops = 0;  ///< Asked::stops that this takes into account
  std::uint64_t cycles = 0, missed_deadlines = 0, rejected_plans = 0, plans = 0;
  std::uint64_t dodges = 0;  ///< brakings for obstacles that appeared on the way
};

/// Planner thread to whoever looks.
struct PlannerView {
  Target target;
  ActiveConstraint constraint;
  Plan plan;
  Reference reference;          ///< of the newest plan towards the hand; without a grip no nodes
  double tracking_error = 0.0;  ///< m, target to tool where the plan begins
  std::uint64_t samples = 0, dropped_samples = 0, solves = 0, failed = 0;
};

/// A command for taps and monitor.
struct TappedCommand {
  JointCommand command;
  bool anew = false;  ///< the arm was restarted where it stands: it need not continue those before
};

/// Copies of everything on its way, for a recorder. What does not fit is dropped and counted; nobody waits.
struct TapRings {
  // written by the planner thread
  SpscRing<OperatorSample> samples{1024};
  SpscRing<Target> targets{1024};
  SpscRing<AppliedSettings> settings{64};
  SpscRing<PlanningRecord> steps{64};  ///< some of all: see PlanningSettings::tap_period
  // written by the control thread
  SpscRing<TappedCommand> commands{2048};
  SpscRing<JointState> states{2048};
  SpscRing<SupervisionChange> changes{256};
};

/// Stops and resets that people ask for, and what control made of them. Counters, where flags would be taken back and
/// with them what was asked in that moment; see Supervisor.
struct Asked {
  std::atomic<std::uint64_t> stops{0};     ///< any thread counts on
  std::atomic<std::uint64_t> reset_of{0};  ///< any thread: `halts` when a reset was asked for
  std::atomic<std::uint64_t> halts{0};     ///< written by control: Supervisor::halts
  std::atomic<bool> halted{false};         ///< written by control: stopping or fault

  void stop() { ++stops; }
  void reset() { reset_of = halts.load(); }
};

/// Everything that the threads of a session share. Each member has one writer and one reader, but for the counters.
struct Links {
  SpscRing<HeldSample> samples{256};                               ///< input to planner
  LatestValue<OperatorSettings> settings;                          ///< main to planner
  LatestValue<Obstacles> obstacles_to_plan, obstacles_to_control;  ///< main to planner and to control
  LatestValue<HandReport> hand;                                    ///< planner to control
  LatestValue<Plan> plan;                                          ///< planner to control
  LatestValue<ControlReport> report;                               ///< control to planner
  LatestValue<Plan> followed;             ///< control to planner: what is followed since the last change
  LatestValue<ControlView> control_view;  ///< control to main
  LatestValue<PlannerView> planner_view;  ///< planner to main
  Asked asked;
  std::atomic<const char*> failure{nullptr};  ///< any thread that cannot go on, for good: static text for people
  std::atomic<std::uint64_t> holder{0};       ///< any thread: counts whose hand it is; each must open its clutch first
  /// Any thread: counts how often the glass was filled again. A request, control at a fresh grip or a reset.
  std::atomic<std::uint64_t> refills{0};
  /// Control to planner: how the arm moves, command by command, and at the end of missed cycles its own set-point.
  SpscRing<JointCommand> moved{512};
  TapRings taps;
  Histogram solve_us;    ///< written by the planner: duration of a solve with its check
  Histogram latency_us;  ///< written by control: hand to the first command made from it
  Histogram wake_us;     ///< written by control: how late a cycle began
};

}  // namespace steadyhand

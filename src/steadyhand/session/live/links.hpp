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

/// From the control thread to the planner, once a cycle.
struct ControlReport {
  /// Of a tool.
  struct Hand {
    SupervisionState state = SupervisionState::kIdle;
    std::uint64_t engagement = 0;  ///< see Supervisor::engagements
    std::uint64_t grip = 0;        ///< see Supervisor::grip
  };
  Time now{0};
  SupervisionState state = SupervisionState::kIdle;  ///< of all, see SessionSnapshot::state
  PerTool<Hand> hands;
  bool soft_stop = false;  ///< stopping, and the planner still has time for the stop
};

/// A sample with its owner: grips of one hand are not those of another.
struct HeldSample {
  OperatorSample sample;
  std::uint64_t holder = 0;  ///< Links::holder when it arrived
};

/// From the control thread to observers.
struct ControlView {
  /// Of a tool.
  struct Hand {
    SupervisionState state = SupervisionState::kIdle;
    std::string_view reason;
    Cause cause;
  };
  Time now{0};
  SupervisionState state = SupervisionState::kIdle;  ///< of all, as the next two; see SessionSnapshot::state
  std::string_view reason;
  Cause cause;
  PerTool<Hand> hands;
  JointCommand command;
  JointState measured;
  bool at_rest = false;
  std::uint64_t stops = 0;  ///< Asked::stops included in this view
  std::uint64_t cycles = 0, missed_deadlines = 0, rejected_plans = 0, plans = 0;
  std::uint64_t dodges = 0;  ///< times the arm braked for an obstacle that appeared on its way
};

/// From the planner thread to observers.
struct PlannerView {
  PerTool<Target> targets;
  ActiveConstraint constraint;
  Plan plan;
  Reference reference;               ///< for the newest plan that follows a hand; without a grip no nodes
  PerTool<double> tracking_error{};  ///< m, target to tool where the plan begins
  std::uint64_t samples = 0, dropped_samples = 0, solves = 0, failed = 0;
};

/// A command for taps and monitor.
struct TappedCommand {
  JointCommand command;
  bool anew = false;  ///< the arm was restarted where it is: this command need not continue the one before
};

/// Copies of all data in transit, for a recorder. If a ring is full, data is dropped and counted; no thread waits.
struct TapRings {
  // written by the planner thread
  SpscRing<OperatorSample> samples{1024};
  SpscRing<Target> targets{1024};
  SpscRing<AppliedSettings> settings{64};
  SpscRing<PlanningRecord> steps{64};  ///< some of them: see PlanningSettings::tap_period
  // written by the control thread
  SpscRing<TappedCommand> commands{2048};
  SpscRing<JointState> states{2048};
  SpscRing<SupervisionChange> changes{256};
};

/// Requested stops and resets, and the resulting halts. They are counters, since clearing a flag could lose a request
/// made at the same moment; see Supervisor.
struct Asked {
  std::atomic<std::uint64_t> stops{0};     ///< any thread counts on
  std::atomic<std::uint64_t> reset_of{0};  ///< any thread: `halts` when a reset was asked for
  std::atomic<std::uint64_t> halts{0};     ///< written by control: Supervisor::halts
  std::atomic<bool> halted{false};         ///< written by control: stopping or fault

  void stop() { ++stops; }
  void reset() { reset_of = halts.load(); }
};

/// Everything that the threads of a session share. Each member has one writer and one reader, except the counters.
struct Links {
  SpscRing<HeldSample> samples{256};                               ///< input to planner
  LatestValue<OperatorSettings> settings;                          ///< main to planner
  LatestValue<Obstacles> obstacles_to_plan, obstacles_to_control;  ///< main to planner and to control
  LatestValue<PerTool<HandReport>> hands;                          ///< planner to control
  LatestValue<Plan> plan;                                          ///< planner to control
  LatestValue<ControlReport> report;                               ///< control to planner
  LatestValue<Plan> followed;             ///< control to planner: the followed plan, after each change
  LatestValue<ControlView> control_view;  ///< control to main
  LatestValue<PlannerView> planner_view;  ///< planner to main
  Asked asked;
  std::atomic<const char*> failure{nullptr};  ///< any thread that failed for good: static text for people
  std::atomic<std::uint64_t> holder{0};       ///< any thread: counts hands in control; each must first open its clutch
  /// Any thread: counts refills of each tool's glass. Incremented by a request, and by control at a new grip of its
  /// hand or a reset.
  PerTool<std::atomic<std::uint64_t>> refills{};
  /// Control to planner: each command that moves the arm; after missed cycles also the arm's own set-point.
  SpscRing<JointCommand> moved{512};
  TapRings taps;
  Histogram solve_us;    ///< written by the planner: duration of a solve with its check
  Histogram latency_us;  ///< written by control: hand to the first command made from it
  Histogram wake_us;     ///< written by control: how late a cycle began
};

}  // namespace steadyhand

#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/core/mutex.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/session/live/control_stage.hpp"
#include "steadyhand/session/live/monitor.hpp"
#include "steadyhand/session/live/planning_stage.hpp"
#include "steadyhand/session/live/snapshot.hpp"
#include "steadyhand/session/live/sustained_rate.hpp"

namespace steadyhand {

struct LiveSettings {
  /// From 4 to the arm's rate; 0: what this machine sustains, measured when the session is made.
  double planner_rate_hz = 0.0;
  /// The rate follows what the machine sustains while it runs. Set by Session::resolve where it is not told.
  bool adapt_rate = false;
  /// s, see PlanningSettings::look_ahead, which this sets; 0: PlanningSettings::default_look_ahead. It is also the
  /// solver's budget: a plan that takes longer would begin in the past.
  double look_ahead = 0.0;
  bool time_budget =
      true;              ///< a solve ends when its look-ahead has passed; without, a session may be the same each time
  bool realtime = true;  ///< ask for real-time priority, locked memory and processors that do not sleep
  PlanningSettings planning;
  ControlSettings control;
  GlassSettings glass;
  Cell cell;  ///< what stands around the arm

  LiveSettings() = default;
  /// As the profile has it.
  explicit LiveSettings(const Profile& profile) : planning(profile) {}
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

/// A live session's stages and what joins them, without the threads that run them: what operators ask of it, what
/// there is to see, and the writer's work. LiveSession runs it on threads. Nothing moves before the operator's hand
/// grips.
class Session {
 public:
  static constexpr Time kWriterPeriod = std::chrono::milliseconds(10);  ///< of drain() and refresh()

  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Lines for people about what could not be had, or failed, or is in the arm at start. Any thread.
  /// @param from index of the first
  std::vector<std::string> warnings(std::size_t from = 0) const;

  /// The operator's hand. One thread at a time.
  void feed(const OperatorSample& sample) { links_->samples.push({sample, links_->holder}); }
  /// Another hand from here on: the arm disengages until a fresh grip. Any thread.
  void release_hand() { ++links_->holder; }
  /// The glass is full again, at the level that it has; the arm goes on. Any thread.
  void refill() { ++links_->refills; }
  /// Any thread.
  void ask_stop() { links_->asked.stop(); }
  /// Of the stop or fault that there is now: what halts the arm later is not undone.
  void ask_reset() { links_->asked.reset(); }
  /// Supervisor::halts and whether the arm is stopped, or about to be, as control saw it last. Any thread.
  std::uint64_t halts() const { return links_->asked.halts; }
  bool is_halted() const { return links_->asked.halted; }
  /// A part of the program cannot go on: the arm comes to rest, for good. Any thread. @param why static text
  void fail(const char* why, const char* details) noexcept;
  /// Weights, scale, yaw; one thread at a time. @pre 0 <= settings.planner < planners()
  void set(const OperatorSettings& settings) { links_->settings.write(settings); }

  /// What stands around the arm from here on. At the next cycle the plan that is followed is looked at anew, and left
  /// for the shortest stop where it would touch. Any thread. Fails, and changes nothing, where obstacles_of does, with
  /// the reason.
  /// @param at session's clock: what moves is there then
  Status set_cell(const Cell& cell, Time at);
  /// The same as it is at a time, once the session has started. Any thread.
  Cell cell(Time at) const;
  /// The cell as it was set last, when, and how often it has been set. Any thread.
  struct CellSet {
    Cell cell;
    Time at;
    std::uint64_t version;
  };
  CellSet cell_set() const;
  /// Makes a new cell of the present one; of those who change it so, one at a time. Any thread. Fails, and changes
  /// nothing, where the change or set_cell does.
  Status change_cell(const std::function<Result<Cell>(Cell)>& change, Time at);
  /// The arm as it is commanded to be at a time near now, after set_position. Any thread. Fails before it has said
  /// where it is.
  Result<Kinematics> arm_at(Time at) const;
  /// The tool carries this object from here on, where it is in the tool now, or lets go of it where it is now. Any
  /// thread. Fails, and changes nothing, as attach() and detach() of robot/cell.hpp do.
  /// @param at session's clock, now
  Status attach(const std::string& object, Time at);
  Status detach(const std::string& object, Time at);

  /// Planning steps a second from here on, Hz; 0: what this machine sustains, as it goes. Any thread. Fails, and
  /// changes nothing, on a rate at which supervision would take the planner for late, or beyond the arm's.
  Status set_planner_rate(double rate_hz);

  /// One look at the session, any thread.
  SessionSnapshot snapshot() const;
  /// The arm stands, after every stop that was asked for so far or by a fault. Any thread.
  bool stopped_at_rest() const;

  const Ocp& ocp() const { return planning_->ocp(); }
  /// How many there are for OperatorSettings::planner to choose among. Any thread.
  int planners() const { return 1 + static_cast<int>(settings_.planning.more.size()); }
  double planner_rate_hz() const {
    const double chosen = chosen_rate_hz_;
    return chosen > 0.0 ? chosen : sustained_rate_hz_.load();
  }

 protected:
  /// The settings for this model and arm; how fast the machine plans is measured where they do not say a rate. Fails on
  /// settings out of range, with the reason.
  static Result<LiveSettings> resolve(const LiveSettings& settings, const RobotModel& model, const Arm& arm,
                                      const Clock& clock);
  /// @param settings resolved. Model, arm and clock must outlive it.
  Session(const RobotModel& model, const LiveSettings& settings, Arm& arm, Clock& clock);
  ~Session() = default;
  /// Makes the planner's stage. Once. Fails as PlanningStage::make.
  Status make_planning();

  /// Begins to be told. Once, before any of what follows.
  void begin(LiveTaps taps);
  /// One cycle of the arm, which it waits for. Control thread.
  void control_cycle();
  /// One planning step. Planner's thread. @returns what it took
  Time plan();
  /// s, PlanningSettings::look_ahead for planning steps at this rate (Hz).
  double look_ahead_at(double rate) const;
  /// Hands on what went through since. Writer thread, as the next two.
  void drain();
  /// Renews the snapshot.
  void refresh();
  LiveSummary summarize();
  void warn(const std::string& line);

  const RobotModel* model_;
  LiveSettings settings_;
  Arm* arm_;
  Clock* clock_;
  std::unique_ptr<Links> links_;
  std::unique_ptr<ControlStage> control_;
  std::unique_ptr<PlanningStage> planning_;
  std::atomic<bool> control_failed_{false};
  LiveTaps taps_;

 private:
  void see_cell();
  void count(const SupervisionChange& change);
  /// Hz, at which supervision does not take the planner for late.
  double slowest_rate() const;

  std::atomic<double> chosen_rate_hz_;  ///< 0: nobody told one
  std::atomic<double> sustained_rate_hz_;
  RateKeeper rate_keeper_;  ///< of the planner's thread

  // ---- of the writer thread
  Monitor monitor_;
  std::uint64_t refills_ = 0;  ///< Links::refills that were poured
  Kinematics arm_kinematics_;
  ControlView control_view_;
  PlannerView planner_view_;
  LiveSummary summary_;
  Time started_{0}, engaged_since_{0};

  mutable Mutex mutex_;  ///< of what follows; never taken by control or planner
  Mutex changes_;        ///< of the cell, one at a time
  Cell cell_;
  Time cell_at_{0};
  std::optional<Obstacles> fresh_obstacles_;  ///< of the cell, which the writer has not seen
  std::uint64_t world_ = 0;                   ///< versions of the cell so far
  SessionSnapshot snapshot_;
  bool stopped_at_rest_ = false;
  std::uint64_t stops_ = 0;  ///< that stopped_at_rest_ takes into account
  std::vector<std::string> warnings_;
};

}  // namespace steadyhand

#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/session/live/live_settings.hpp"
#include "steadyhand/session/live/live_taps.hpp"

namespace steadyhand {

class ControlStage;
class PlanningStage;
struct Links;

/// A live session's stages and what joins them, without the threads that run them: requests of operators,
/// snapshots, and the writer's work. LiveSession runs it on threads. Nothing moves before the operator engages.
class Session {
 public:
  static constexpr Time kWriterPeriod = std::chrono::milliseconds(10);  ///< of drain() and refresh()

  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Lines for people about what could not be had, or failed, or is in the arm at start. Any thread.
  /// @param from index of the first
  std::vector<std::string> warnings(std::size_t from = 0) const;

  /// The operator's hand. One thread at a time.
  void feed(const OperatorSample& sample);
  /// Another hand from now on: the arm disengages until it is engaged again. Any thread.
  void release_hand();
  /// The glass is full again, at the level that it has; the arm continues. Any thread.
  void refill();
  /// The arm stops, and waits for a reset. Any thread.
  void ask_stop();
  /// Resets the present stop or fault; later ones stay.
  void ask_reset();
  /// Supervisor::halts and whether the arm is stopped, or about to be, as control saw it last. Any thread.
  std::uint64_t halts() const;
  bool is_halted() const;  ///< the same
  /// A part of the program cannot continue: the arm stops for good. Any thread. @param why static text
  void fail(const char* why, const char* details) noexcept;
  /// Weights, scale, yaw; one thread at a time. @pre 0 <= settings.planner < planners()
  void set(const OperatorSettings& settings);

  /// Obstacles from now on. At the next cycle the followed plan is checked again; if it would touch one, the arm takes
  /// the shortest stop instead. Any thread. Fails, and changes nothing, where obstacles_of does, with the reason.
  /// @param at session's clock: when moving objects are at their positions
  Status set_cell(const Cell& cell, Time at);
  /// The same as it is at a time, once the session has started. Any thread.
  Cell cell(Time at) const;
  /// A cell as it was set.
  struct CellSet {
    Cell cell;              ///< as it was at that time
    Time at;                ///< session's clock
    std::uint64_t version;  ///< how often one has been set
  };
  CellSet cell_set() const;  ///< the last. Any thread
  /// Makes a new cell of the present one; of those who change it so, one at a time. Any thread. Fails, and changes
  /// nothing, where the change or set_cell does.
  Status change_cell(const std::function<Result<Cell>(Cell)>& change, Time at);
  /// The arm as it is commanded to be at a time near now, after set_position. Any thread. Fails before it has
  /// reported its position.
  Result<Kinematics> arm_at(Time at) const;
  /// @{ Attaches this object to the tool at its present pose, or releases it there. Any
  /// thread. Fails, and changes nothing, as attach() and detach() of robot/cell.hpp do.
  /// @param at session's clock, now
  Status attach(const std::string& object, Time at);
  Status detach(const std::string& object, Time at);
  /// @}

  /// Planning steps a second from here on, Hz; 0: the rate that this machine sustains now. Any thread. Fails, and
  /// changes nothing, on a rate at which supervision would take the planner for late, or beyond the arm's.
  Status set_planner_rate(double rate_hz);

  /// One look at the session, any thread.
  SessionSnapshot snapshot() const;
  /// The arm is stationary, after every requested stop so far or by a fault. Any thread.
  bool stopped_at_rest() const;

  /// What is solved, with all of the limits.
  const Ocp& ocp() const;
  /// How many there are for OperatorSettings::planner to choose among. Any thread.
  int planners() const { return 1 + static_cast<int>(settings_.planning.more.size()); }
  /// Planning steps a second, Hz, as they are asked for or sustained now.
  double planner_rate_hz() const;

 protected:
  /// The settings for this model and arm; how fast the machine plans is measured where they do not say a rate. Fails on
  /// settings out of range, with the reason.
  static Result<LiveSettings> resolve(const LiveSettings& settings, const RobotModel& model, const Arm& arm,
                                      const Clock& clock);
  /// @param settings resolved. Model, arm and clock must outlive it.
  Session(const RobotModel& model, const LiveSettings& settings, Arm& arm, Clock& clock);
  ~Session();
  /// Makes the planner's stage. Once. Fails as PlanningStage::make.
  Status make_planning();

  /// Starts the taps. Once, before any of the following.
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
  LiveSummary summarize();             ///< what it came to so far
  void warn(const std::string& line);  ///< adds to warnings(). Any thread

  /// @{ What it was made of, and its stages.
  const RobotModel* model_;
  LiveSettings settings_;
  Arm* arm_;
  Clock* clock_;
  std::unique_ptr<Links> links_;
  std::unique_ptr<ControlStage> control_;
  std::unique_ptr<PlanningStage> planning_;
  std::atomic<bool> control_failed_{false};
  LiveTaps taps_;
  /// @}

 private:
  void see_cell();
  void count(const SupervisionChange& change);
  /// Hz, at which supervision does not take the planner for late.
  double slowest_rate() const;

  struct State;
  std::unique_ptr<State> state_;
};

/// The threads of a live session and what joins them: planner (its own rate), control (paced by the arm) and a writer
/// that serves taps, monitor and snapshots. Nothing moves before the operator engages.
class LiveSession : public Session {
 public:
  /// Model, arm and clock must outlive it. Takes some 100 ms. Fails on settings out of range, with the reason.
  static Result<std::unique_ptr<LiveSession>> make(const RobotModel& model, const LiveSettings& settings, Arm& arm,
                                                   Clock& clock);
  ~LiveSession();

  /// Starts the threads. Once; warnings() are complete once they run.
  void start(LiveTaps taps = {});
  /// Brings the arm to rest, waits for that (2 s at most), ends the threads.
  LiveSummary finish();
  bool is_running() const;  ///< from start() to finish()

 private:
  struct Threads;
  LiveSession(const RobotModel& model, const LiveSettings& settings, Arm& arm, Clock& clock);
  void run_control();
  void plan_on();
  template <typename Work>
  bool goes_well(const char* otherwise, const Work& work);
  void run_planner();
  void run_writer();

  std::unique_ptr<Threads> threads_;
};

}  // namespace steadyhand

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

/// The stages of a live session and their connections, without threads: requests of operators, snapshots, and the
/// writer's work. LiveSession runs it on threads. Nothing moves before the operator engages.
class Session {
 public:
  static constexpr Time kWriterPeriod = std::chrono::milliseconds(10);  ///< between calls of drain() and refresh()

  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Warnings for people: unavailable features, failures, obstacles that overlap the arm at the start. Any thread.
  /// @param from index of the first warning
  std::vector<std::string> warnings(std::size_t from = 0) const;

  /// Adds a sample of the operator's hand. One thread at a time.
  void feed(const OperatorSample& sample);
  /// Later samples are of another hand: the arm disengages until that hand engages it. Any thread.
  void release_hand();
  /// Refills the glasses to their present level; the arm continues. Any thread.
  void refill();
  /// Stops the arm, which then waits for a reset. Any thread.
  void ask_stop();
  /// Resets the present stop or fault, not later ones.
  void ask_reset();
  /// Supervisor::halts and whether the arm is stopped, or about to be, as control saw it last. Any thread.
  std::uint64_t halts() const;
  bool is_halted() const;  ///< the same
  /// A part of the program cannot continue: the arm stops for good. Any thread. @param why static text
  void fail(const char* why, const char* details) noexcept;
  /// Weights, scale, yaw; one thread at a time. @pre 0 <= settings.planner < planners()
  void set(const OperatorSettings& settings);

  /// Sets the obstacles. At the next cycle the followed plan is checked again; if it would touch one, the arm takes
  /// the shortest stop instead. Any thread. Fails, and changes nothing, if obstacles_of fails, with its reason.
  /// @param at session's clock: when moving objects are at their positions
  Status set_cell(const Cell& cell, Time at);
  /// The cell at a given time, once the session has started. Any thread.
  Cell cell(Time at) const;
  /// A cell as it was set.
  struct CellSet {
    Cell cell;              ///< as it was at that time
    Time at;                ///< session's clock
    std::uint64_t version;  ///< number of cells set so far
  };
  CellSet cell_set() const;  ///< the last one set. Any thread
  /// Makes a new cell from the present one; concurrent changes run one after another. Any thread. Fails, and changes
  /// nothing, if the change or set_cell fails.
  Status change_cell(const std::function<Result<Cell>(Cell)>& change, Time at);
  /// The commanded arm at a time near now, after set_position. Any thread. Fails before the arm has reported its
  /// position.
  Result<Kinematics> arm_at(Time at) const;
  /// @{ Attaches this object to a tool (its index) at its present pose, or releases it there. Any
  /// thread. Fails, and changes nothing, as attach() and detach() of robot/cell.hpp do.
  /// @param at session's clock, now
  Status attach(const std::string& object, Time at, int tool = 0);
  Status detach(const std::string& object, Time at);
  /// @}

  /// Planning steps a second from here on, Hz; 0: the rate that this machine sustains now. Any thread. Fails, and
  /// changes nothing, on a rate at which supervision would find the planner late, or above the arm's rate.
  Status set_planner_rate(double rate_hz);

  /// A snapshot of the session. Any thread.
  SessionSnapshot snapshot() const;
  /// The arm is stationary, after every requested stop so far or by a fault. Any thread.
  bool stopped_at_rest() const;

  /// The problem that is solved, with the full limits.
  const Ocp& ocp() const;
  /// Number of planners to choose from by OperatorSettings::planner. Any thread.
  int planners() const { return 1 + static_cast<int>(settings_.planning.more.size()); }
  /// Planning steps a second, Hz, as requested or as sustained now.
  double planner_rate_hz() const;

 protected:
  /// The settings for this model and arm. If they have no rate, the planning speed of the machine is measured. Fails on
  /// settings out of range, with the reason.
  static Result<LiveSettings> resolve(const LiveSettings& settings, const RobotModel& model, const Arm& arm,
                                      const Clock& clock);
  /// @param settings resolved. Model, arm and clock must outlive it.
  Session(const RobotModel& model, const LiveSettings& settings, Arm& arm, Clock& clock);
  ~Session();
  /// Makes the planner's stage. Call it once. Fails as PlanningStage::make does.
  Status make_planning();

  /// Starts the taps. Call it once, before the functions below.
  void begin(LiveTaps taps);
  /// Waits for one cycle of the arm and runs it. Control thread.
  void control_cycle();
  /// Runs one planning step. Planner's thread. @returns its duration
  Time plan();
  /// s, PlanningSettings::look_ahead for planning steps at this rate (Hz).
  double look_ahead_at(double rate) const;
  /// Passes on the data since the last call. Writer thread, as the next two.
  void drain();
  /// Updates the snapshot.
  void refresh();
  LiveSummary summarize();             ///< summary so far
  void warn(const std::string& line);  ///< adds to warnings(). Any thread

  /// @{ Its parts and stages.
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
  void refresh_tool(int t, ToolSnapshot& tool) const;
  void count(const SupervisionChange& change);
  /// Hz, lowest rate at which supervision does not find the planner late.
  double slowest_rate() const;

  struct State;
  std::unique_ptr<State> state_;
};

/// A live session on threads: planner (its own rate), control (paced by the arm), and a writer that serves taps,
/// monitor and snapshots. Nothing moves before the operator engages.
class LiveSession : public Session {
 public:
  /// Model, arm and clock must outlive it. Takes about 100 ms. Fails on settings out of range, with the reason.
  static Result<std::unique_ptr<LiveSession>> make(const RobotModel& model, const LiveSettings& settings, Arm& arm,
                                                   Clock& clock);
  ~LiveSession();

  /// Starts the threads. Call it once; after it warnings() are complete.
  void start(LiveTaps taps = {});
  /// Stops the arm, waits until it is stationary (2 s at most), and ends the threads.
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

#pragma once

#include <algorithm>
#include <functional>
#include <memory>

#include "steadyhand/session/live/live_session.hpp"

namespace steadyhand {

/// A clock that advances only in sleep_until(), and while something is timed.
class SteppedClock final : public Clock {
 public:
  /// @param wall any monotonic clock, for timing; empty: nothing is timed
  explicit SteppedClock(std::function<Time()> wall) : wall_(std::move(wall)) {}
  Time now() const override { return runs_ ? at_ + (wall_() - since_) : at_; }
  void sleep_until(Time deadline) override { at_ = std::max(at_, deadline); }
  /// True: from now on the wall clock's time is added. False: no longer.
  void run(bool on) {
    runs_ = on && wall_;
    if (runs_) since_ = wall_();
  }

 private:
  std::function<Time()> wall_;
  Time at_{0}, since_{0};
  bool runs_ = false;
};

/// A live session on one thread: control, planner and writer take turns in the order of their times.
class OneThreadSession : public Session {
 public:
  /// Model, arm and clock must outlive it; the arm must be simulated and use this clock. Fails as LiveSession::make
  /// does.
  static Result<std::unique_ptr<OneThreadSession>> make(const RobotModel& model, const LiveSettings& settings, Arm& arm,
                                                        SteppedClock& clock);
  /// Call once, before step().
  void start(LiveTaps taps = {});
  /// Time of the arm's next cycle, session's clock.
  Time next_cycle() const { return clock_->now() + cycle_; }
  /// Runs that cycle, and everything due by then.
  void step();
  /// Summary of the session so far.
  LiveSummary summary() { return summarize(); }

 private:
  OneThreadSession(const RobotModel& model, const LiveSettings& settings, Arm& arm, SteppedClock& clock);

  SteppedClock* stepped_clock_;
  Time cycle_, next_plan_{0}, next_look_{0};
  double rate_;  ///< Hz, the current rate of planning
};

}  // namespace steadyhand

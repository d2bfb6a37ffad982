#pragma once

#include <thread>

#include "steadyhand/session/live/realtime.hpp"
#include "steadyhand/session/live/session.hpp"

namespace steadyhand {

/// The threads of a live session and what joins them: planner (its own rate), control (paced by the arm) and a writer
/// that serves taps, monitor and snapshots. Nothing moves before the operator's hand grips.
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
  bool is_running() const { return running_; }

 private:
  using Session::Session;
  void run_control();
  void plan_on();
  template <typename Work>
  bool goes_well(const char* otherwise, const Work& work);
  void run_planner();
  void run_writer();

  std::optional<AwakeProcessors> awake_;
  std::atomic<bool> running_{false}, draining_{false};
  std::thread control_thread_, planner_thread_, writer_thread_;
};

}  // namespace steadyhand

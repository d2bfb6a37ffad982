#include "steadyhand/session/live/one_thread_session.hpp"

#include "steadyhand/session/live/planning_stage.hpp"

namespace steadyhand {

namespace {

/// Until the next planning step, at most: less than half of what supervision waits for a plan.
constexpr Time kLongestWait = std::chrono::milliseconds(100);

}  // namespace

Result<std::unique_ptr<OneThreadSession>> OneThreadSession::make(const RobotModel& model, const LiveSettings& settings,
                                                                 Arm& arm, SteppedClock& clock) {
  clock.run(true);  // how fast this machine plans may be measured
  const Result<LiveSettings> resolved = resolve(settings, model, arm, clock);
  clock.run(false);
  if (!resolved) return resolved.error();
  std::unique_ptr<OneThreadSession> session(new OneThreadSession(model, *resolved, arm, clock));
  if (Status s = session->make_planning(); !s) return s.error();
  return session;
}

OneThreadSession::OneThreadSession(const RobotModel& model, const LiveSettings& settings, Arm& arm, SteppedClock& clock)
    : Session(model, settings, arm, clock),
      stepped_clock_(&clock),
      cycle_(from_seconds(settings.planning.cycle)),
      rate_(settings.planner_rate_hz) {}

void OneThreadSession::start(LiveTaps taps) {
  begin(std::move(taps));
  next_plan_ = next_look_ = clock_->now();
}

void OneThreadSession::step() {
  control_cycle();
  const Time now = clock_->now();
  if (const double asked = planner_rate_hz(); asked != rate_) {
    rate_ = asked;
    next_plan_ = now;
    planning_->set_look_ahead(look_ahead_at(rate_), settings_.time_budget);
  }
  if (now >= next_plan_) {
    stepped_clock_->run(true);
    const Time took = plan();
    stepped_clock_->run(false);
    const Time period = from_seconds(1.0 / rate_);
    next_plan_ += period;
    // Control cycles and messages get the thread as long again: a device that became slow keeps its clock.
    if (took > period) next_plan_ = std::max(next_plan_, now + std::min(2 * took, kLongestWait));
  }
  if (now < next_look_) return;
  drain();
  refresh();
  if (taps_.look) taps_.look(snapshot());
  next_look_ += kWriterPeriod;
}

}  // namespace steadyhand

#include "steadyhand/session/live/live_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <thread>

#include "steadyhand/session/live/links.hpp"
#include "steadyhand/session/live/planning_stage.hpp"
#include "steadyhand/session/live/realtime_threads.hpp"

namespace steadyhand {

namespace {

constexpr Time kWakeSlack = std::chrono::microseconds(300);  ///< how late the planner's thread may wake up
constexpr Time kRestWithin = std::chrono::seconds(2);

}  // namespace

struct LiveSession::Threads {
  std::optional<AwakeProcessors> awake;
  std::atomic<bool> running{false}, draining{false};
  std::thread control, planner, writer;
};

Result<std::unique_ptr<LiveSession>> LiveSession::make(const RobotModel& model, const LiveSettings& settings, Arm& arm,
                                                       Clock& clock) {
  const Result<LiveSettings> resolved = resolve(settings, model, arm, clock);
  if (!resolved) return resolved.error();
  std::unique_ptr<LiveSession> session(new LiveSession(model, *resolved, arm, clock));
  if (Status s = session->make_planning(); !s) return s.error();
  return session;
}

LiveSession::LiveSession(const RobotModel& model, const LiveSettings& settings, Arm& arm, Clock& clock)
    : Session(model, settings, arm, clock), threads_(std::make_unique<Threads>()) {}

LiveSession::~LiveSession() {
  if (threads_->running) (void)finish();
}

void LiveSession::start(LiveTaps taps) {
  if (settings_.realtime) {
    if (const std::string why = lock_memory(); !why.empty()) warn(why);
    if (const std::string& why = threads_->awake.emplace().refused(); !why.empty()) warn(why);
  }
  begin(std::move(taps));
  threads_->running = threads_->draining = true;
  threads_->writer = std::thread([this] { run_writer(); });
  threads_->planner = std::thread([this] { run_planner(); });
  threads_->control = std::thread([this] { run_control(); });
}

bool LiveSession::is_running() const { return threads_->running; }

/// Turns an exception of the work into a fault of the session. True if there is none.
template <typename Work>
bool LiveSession::goes_well(const char* otherwise, const Work& work) {
  try {
    work();
    return true;
  } catch (const std::exception& error) {
    fail(otherwise, error.what());
  } catch (...) {
    fail(otherwise, "of unknown kind");
  }
  return false;
}

void LiveSession::run_control() {
  name_thread("control");
  if (settings_.realtime) {
    if (const std::string why = make_realtime(kControlPriority); !why.empty()) warn("control: " + why);
  }
  const bool well = goes_well("the control loop failed: restart the program", [&] {
    while (threads_->running.load(std::memory_order_relaxed)) control_cycle();
  });
  if (well) return;
  control_failed_ = true;  // no more commands: an arm without commands stops by itself
  links_->asked.halted = true;
}

void LiveSession::run_planner() {
  name_thread("planner");
  if (settings_.realtime) {
    if (const std::string why = make_realtime(kPlannerPriority); !why.empty()) warn("planner: " + why);
  }
  // The planner's data may be inconsistent after an exception, so the planner does not continue.
  (void)goes_well("the planner failed: restart the program", [this] { plan_on(); });
}

void LiveSession::plan_on() {
  double rate = settings_.planner_rate_hz;
  Time period = from_seconds(1.0 / rate), next = clock_->now();
  const Time cycle = from_seconds(settings_.planning.cycle);
  double look_ahead = settings_.planning.look_ahead;
  while (threads_->running.load(std::memory_order_relaxed)) {
    if (const double asked = planner_rate_hz(); asked != rate) {
      rate = asked;
      period = from_seconds(1.0 / rate);
      next = clock_->now();
      look_ahead = look_ahead_at(rate);
      planning_->set_look_ahead(look_ahead, settings_.time_budget);
    }
    // Plan just in time for a control cycle, where the plan can begin: an earlier start would use older samples of the
    // hand.
    const Time too_late = (next - planning_->control_time() + from_seconds(look_ahead) + kWakeSlack) % cycle;
    clock_->sleep_until(next - (too_late < Time(0) ? too_late + cycle : too_late));
    (void)plan();
    next += period;
    if (const Time end = clock_->now(); end > next) next += (end - next) / period * period;  // skip, never catch up
  }
}

void LiveSession::run_writer() {
  name_thread("writer");
  Time next = clock_->now();
  bool last = false;
  while (!last) {
    last = !threads_->draining;
    const bool well = goes_well("the recording failed: restart the program", [&] {
      drain();
      refresh();
      if (taps_.look) taps_.look(snapshot());
    });
    if (!well) taps_ = {};  // stop recording; data for the page and the summary is still collected
    next = std::max(next + kWriterPeriod, clock_->now());
    if (!last) clock_->sleep_until(next);
  }
}

LiveSummary LiveSession::finish() {
  ask_stop();
  const Time until = clock_->now() + kRestWithin;
  while (!stopped_at_rest() && clock_->now() < until) clock_->sleep_until(clock_->now() + kWriterPeriod);
  threads_->running = false;
  threads_->control.join();
  threads_->planner.join();
  threads_->draining = false;
  threads_->writer.join();
  threads_->awake.reset();

  return summarize();
}

}  // namespace steadyhand

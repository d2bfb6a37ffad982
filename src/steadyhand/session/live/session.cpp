#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "steadyhand/core/mutex.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/session/live/control_stage.hpp"
#include "steadyhand/session/live/links.hpp"
#include "steadyhand/session/live/live_session.hpp"
#include "steadyhand/session/live/monitor.hpp"
#include "steadyhand/session/live/planning_stage.hpp"
#include "steadyhand/session/live/sustained_rate.hpp"

namespace steadyhand {

namespace {

constexpr double kLatePeriods = 4.0;  ///< periods without a plan before supervision may call the planner late

/// s, the longest look-ahead that still lets the planner keep its rate (Hz) on an arm with this cycle (s).
double longest_look_ahead(double cycle, double rate) { return std::max(cycle, 1.0 / rate - cycle); }

/// s, PlanningSettings::look_ahead for this rate (Hz).
double look_ahead_for(const LiveSettings& settings, double cycle, double rate) {
  if (settings.look_ahead > 0.0) return std::min(settings.look_ahead, longest_look_ahead(cycle, rate));
  return PlanningSettings::default_look_ahead(1.0 / rate);
}

}  // namespace

/// Data that only the writer's thread uses, and data shared under a lock.
struct Session::State {
  State(const RobotModel& model, const LiveSettings& settings, const Arm& arm, double slowest_rate)
      : chosen_rate_hz(settings.adapt_rate ? 0.0 : settings.planner_rate_hz),
        sustained_rate_hz(settings.planner_rate_hz),
        rate_keeper(settings.planner_rate_hz, slowest_rate, arm.info().rate_hz),
        monitor(model, settings.glass),
        arm_kinematics(model),
        cell(settings.cell) {}

  std::atomic<double> chosen_rate_hz;  ///< 0: not set
  std::atomic<double> sustained_rate_hz;
  RateKeeper rate_keeper;  ///< used by the planner's thread

  // ---- of the writer thread
  Monitor monitor;
  PerTool<std::uint64_t> refills{};  ///< Links::refills handled so far
  Kinematics arm_kinematics;
  ControlView control_view;
  PlannerView planner_view;
  LiveSummary summary;
  Time started{0};
  PerTool<bool> engaged{};  ///< tools that follow
  Time engaged_since{0};    ///< since when any does

  mutable Mutex mutex;  ///< guards the members below; never taken by control or planner
  Mutex changes;        ///< serializes changes of the cell
  Cell cell;
  Time cell_at{0};
  std::optional<Obstacles> fresh_obstacles;  ///< the new cell's obstacles, not yet read by the writer
  std::uint64_t world = 0;                   ///< number of versions of the cell so far
  SessionSnapshot snapshot;
  bool stopped_at_rest = false;
  std::uint64_t stops = 0;  ///< stops included in stopped_at_rest
  std::vector<std::string> warnings;
};

Result<LiveSettings> Session::resolve(const LiveSettings& settings, const RobotModel& model, const Arm& arm,
                                      const Clock& clock) {
  LiveSettings resolved = settings;
  const double fastest = arm.info().rate_hz;
  double& rate = resolved.planner_rate_hz;
  if (rate == 0.0) {
    const Result<double> planning_us = measure_planning_us(model, settings.planning, clock);
    if (!planning_us) return planning_us.error();
    rate = sustained_rate(fastest, *planning_us);
    resolved.adapt_rate = true;
  }
  if (!(rate >= 4.0) || rate > fastest) {
    return Error{fmt::format("planner's rate is {} Hz; it must be from 4 to {} Hz, the arm's rate", rate, fastest)};
  }
  double& late_after = resolved.control.supervisor.planner_late_after;
  late_after = std::max(late_after, kLatePeriods / rate);
  const double cycle = 1.0 / fastest;
  if (!(settings.look_ahead >= 0.0) || settings.look_ahead > longest_look_ahead(cycle, rate)) {
    return Error{
        fmt::format("planner.look_ahead is {} s; it must be from 0 to {} s, its period less a cycle of the arm",
                    settings.look_ahead, longest_look_ahead(cycle, rate))};
  }
  resolved.planning.look_ahead = look_ahead_for(settings, cycle, rate);
  if (settings.time_budget) resolved.planning.planner.budget.time_us = 1e6 * resolved.planning.look_ahead;
  resolved.planning.cycle = cycle;
  Result<Obstacles> obstacles = obstacles_of(settings.cell, model);
  if (!obstacles) return obstacles.error();
  resolved.planning.planner.obstacles = resolved.control.obstacles = *obstacles;
  return resolved;
}

Session::Session(const RobotModel& model, const LiveSettings& settings, Arm& arm, Clock& clock)
    : model_(&model),
      settings_(settings),
      arm_(&arm),
      clock_(&clock),
      links_(std::make_unique<Links>()),
      state_(std::make_unique<State>(model, settings, arm, slowest_rate())) {
  settings_.control.arm_delay = arm.info().delay;
  settings_.control.gripper = arm.info().gripper;
  settings_.control.check.command_rate_hz = arm.info().rate_hz;
  control_ = std::make_unique<ControlStage>(model, settings_.control, *links_);
}

Session::~Session() = default;

Status Session::make_planning() {
  auto stage = PlanningStage::make(*model_, settings_.planning, *links_, *clock_);
  if (!stage) return stage.error();
  planning_ = std::move(*stage);
  return Done{};
}

void Session::feed(const OperatorSample& sample) { links_->samples.push({sample, links_->holder}); }
void Session::release_hand() { ++links_->holder; }
void Session::refill() {
  for (int t = 0; t < model_->tool_count(); ++t) ++links_->refills[t];
}
void Session::ask_stop() { links_->asked.stop(); }
void Session::ask_reset() { links_->asked.reset(); }
std::uint64_t Session::halts() const { return links_->asked.halts; }
bool Session::is_halted() const { return links_->asked.halted; }
void Session::set(const OperatorSettings& settings) { links_->settings.write(settings); }
const Ocp& Session::ocp() const { return planning_->ocp(); }

double Session::planner_rate_hz() const {
  const double chosen = state_->chosen_rate_hz;
  return chosen > 0.0 ? chosen : state_->sustained_rate_hz.load();
}

void Session::begin(LiveTaps taps) {
  taps_ = std::move(taps);
  state_->started = clock_->now();
  (void)set_cell(state_->cell, state_->started);
}

Time Session::plan() {
  const Time before = clock_->now();
  const bool planned = planning_->step(before);
  const Time now = clock_->now(), took = now - before;
  if (planned && state_->chosen_rate_hz == 0.0 && state_->rate_keeper.take(1e6 * to_seconds(took), now)) {
    state_->sustained_rate_hz = state_->rate_keeper.rate_hz();
  }
  return took;
}

double Session::look_ahead_at(double rate) const { return look_ahead_for(settings_, settings_.planning.cycle, rate); }

void Session::fail(const char* why, const char* details) noexcept {
  if (links_->failure.exchange(why) == why) return;
  try {
    warn(fmt::format("{} ({})", why, details));
  } catch (const std::exception&) {  // no memory for the text
  }
}

void Session::warn(const std::string& line) {
  const Lock lock(state_->mutex);
  state_->warnings.push_back(line);
}

std::vector<std::string> Session::warnings(std::size_t from) const {
  const Lock lock(state_->mutex);
  return {state_->warnings.begin() + static_cast<std::ptrdiff_t>(std::min(from, state_->warnings.size())),
          state_->warnings.end()};
}

void Session::control_cycle() {
  const ArmState state = arm_->receive();
  links_->wake_us.add(1e6 * to_seconds(clock_->now() - state.joints.stamp.made));
  const ControlStage::Output& output = control_->step(state);
  if (output.restart_arm) arm_->restart();
  if (output.follows != nullptr) arm_->follow(*output.follows);
  arm_->send(output.command);
}

namespace {

template <typename T, typename Use>
void empty(SpscRing<T>& ring, const std::function<void(const T&)>& tap, const Use& use) {
  T value;
  while (ring.pop(value)) {
    use(value);
    if (tap) tap(value);
  }
}

}  // namespace

void Session::drain() {
  const auto nothing = [](const auto&) {};
  TapRings& rings = links_->taps;
  empty(rings.samples, taps_.sample, nothing);
  empty(rings.targets, taps_.target, nothing);
  empty(rings.settings, taps_.settings, [&](const AppliedSettings& applied) {
    state_->summary.spilled = state_->summary.spilled || state_->monitor.spilled();
    if (applied.settings.fill) state_->monitor.fill(*applied.settings.fill);
  });
  for (int t = 0; t < model_->tool_count(); ++t) {
    const std::uint64_t refills = links_->refills[t];
    if (std::exchange(state_->refills[t], refills) == refills) continue;
    state_->summary.spilled = state_->summary.spilled || state_->monitor.spilled();
    state_->monitor.reset_liquid(t);
  }
  empty(rings.steps, taps_.step, nothing);
  see_cell();
  TappedCommand tapped;
  while (rings.commands.pop(tapped)) {
    state_->monitor.update(tapped.command, tapped.anew);
    if (taps_.command) taps_.command(tapped.command);
  }
  empty(rings.states, taps_.state, [&](const JointState& state) {
    state_->monitor.update(state);
    if (state_->monitor.result().states > 1) return;
    for (const std::string& line : state_->monitor.overlaps()) warn(line + " at start; move the arm or the object");
  });
  empty(rings.changes, taps_.change, [&](const SupervisionChange& change) { count(change); });
}

/// Passes a new cell on before the commands that depend on it.
void Session::see_cell() {
  std::optional<Obstacles> obstacles;
  Cell cell;
  {
    const Lock lock(state_->mutex);
    if (!state_->fresh_obstacles) return;
    obstacles = std::exchange(state_->fresh_obstacles, std::nullopt);
    cell = state_->cell;
  }
  if (taps_.cell) taps_.cell(obstacles->time, cell);
  std::vector<std::string> names;
  for (const CellObject& object : cell.objects) names.push_back(object.name);
  state_->monitor.set_obstacles(*obstacles, std::move(names));
}

void Session::count(const SupervisionChange& change) {
  PerTool<bool>& engaged = state_->engaged;
  const bool engaged_before = std::ranges::find(engaged, true) != engaged.end();
  engaged[change.tool] = change.to == SupervisionState::kEngaged;
  const bool any_engaged = std::ranges::find(engaged, true) != engaged.end();
  if (engaged_before && !any_engaged) state_->summary.engaged += to_seconds(change.at - state_->engaged_since);
  if (!engaged_before && any_engaged) state_->engaged_since = change.at;
  if (change.to == SupervisionState::kEngaged) ++state_->summary.engagements;
  const bool of_the_arm = change.to == SupervisionState::kStopping || change.to == SupervisionState::kFault;
  if (of_the_arm && change.tool > 0) return;  // counted with the first tool
  const bool held = change.to == SupervisionState::kHolding || change.to == SupervisionState::kStopping ||
                    change.to == SupervisionState::kFault;
  if (!held) return;
  const auto same = [&](const auto& entry) { return entry.first == change.reason; };
  const auto found = std::find_if(state_->summary.holds.begin(), state_->summary.holds.end(), same);
  if (found != state_->summary.holds.end()) {
    ++found->second;
  } else {
    state_->summary.holds.emplace_back(change.reason, 1);
  }
}

void Session::refresh() {
  (void)links_->control_view.read(state_->control_view);
  (void)links_->planner_view.read(state_->planner_view);

  SessionSnapshot s;
  s.now = state_->control_view.now;
  const auto supervision = [this](const auto& hand, auto& of) {
    const bool failed = control_failed_;
    of.state = failed ? SupervisionState::kFault : hand.state;
    of.reason = failed ? std::string_view(links_->failure.load()) : hand.reason;
    of.cause = hand.cause;
    if (failed) of.cause.code = ReasonCode::kFailed;
  };
  supervision(state_->control_view, s);
  s.constraint = state_->planner_view.constraint;
  s.measured = state_->control_view.measured;
  s.command = state_->control_view.command;
  s.tool_count = model_->tool_count();
  for (int t = 0; t < s.tool_count; ++t) {
    supervision(state_->control_view.hands[t], s.tools[t]);
    refresh_tool(t, s.tools[t]);
  }
  const NearestPair nearest = nearest_pair(state_->monitor.arm(), state_->monitor.obstacles());
  s.clearance = nearest.gap;
  s.nearest = {nearest.first, nearest.second};
  const Plan& plan = state_->planner_view.plan;
  const int nodes = plan.joints > 0 ? std::min(plan.intervals + 1, kMaxHorizon + 1) : 0;
  Kinematics& arm = state_->arm_kinematics;
  for (int k = 0; k < nodes; ++k) {
    arm.set_position(plan.x[k].head(plan.joints));
    for (int t = 0; t < s.tool_count; ++t) s.tools[t].path[k] = {arm.p(t), Quaternion(arm.R(t))};
  }
  for (int t = 0; t < s.tool_count; ++t) s.tools[t].path_nodes = nodes;
  s.solve_us = links_->solve_us.summary();
  s.latency_us = links_->latency_us.summary();
  s.wake_us = links_->wake_us.summary();
  s.plans = state_->control_view.plans;
  s.cycles = state_->control_view.cycles;
  s.missed_deadlines = state_->control_view.missed_deadlines;
  s.rejected_plans = state_->control_view.rejected_plans + state_->planner_view.failed;
  s.samples = state_->planner_view.samples;
  s.planner_rate_hz = planner_rate_hz();
  s.planner_rate_automatic = state_->chosen_rate_hz == 0.0;

  const Lock lock(state_->mutex);
  state_->snapshot = s;
  state_->stopped_at_rest =
      state_->control_view.at_rest && (s.state == SupervisionState::kStopping || s.state == SupervisionState::kFault);
  state_->stops = state_->control_view.stops;
}

/// What is known of a tool, besides its state and its path.
void Session::refresh_tool(int t, ToolSnapshot& tool) const {
  const PlannerView& planner = state_->planner_view;
  const Monitor& monitor = state_->monitor;
  const bool leads = tool.state == SupervisionState::kEngaged || tool.state == SupervisionState::kHolding;
  tool.target = planner.targets[t];
  tool.X_base_tool = {monitor.arm().p(t), Quaternion(monitor.arm().R(t))};
  tool.local_acceleration = monitor.local_acceleration(t);
  tool.tracking_error = leads ? planner.tracking_error[t] : std::numeric_limits<double>::quiet_NaN();
  if (!leads) tool.target.X_base_tool = tool.X_base_tool;  // the next grip starts there
  tool.gripper = state_->control_view.measured.gripper[t];
  tool.gripper_command = state_->control_view.command.gripper[t];
  tool.predicted = tool.state == SupervisionState::kEngaged ? planner.reference.nodes : 0;
  tool.prediction = planner.reference.tools[t];
  tool.liquid = monitor.liquid(t);
}

Status Session::set_cell(const Cell& cell, Time at) {
  Result<Obstacles> obstacles = obstacles_of(cell, *model_);
  if (!obstacles) return obstacles.error();
  const Lock lock(state_->mutex);
  obstacles->time = at;
  obstacles->version = ++state_->world;
  links_->obstacles_to_control.write(*obstacles);
  links_->obstacles_to_plan.write(*obstacles);
  state_->cell = cell;
  state_->cell_at = at;
  state_->fresh_obstacles = *obstacles;
  return Done{};
}

Session::CellSet Session::cell_set() const {
  const Lock lock(state_->mutex);
  return {state_->cell, state_->cell_at, state_->world};
}

Status Session::change_cell(const std::function<Result<Cell>(Cell)>& change, Time at) {
  const Lock lock(state_->changes);
  const Result<Cell> changed = change(cell(at));
  return changed ? set_cell(*changed, at) : Status(changed.error());
}

Result<Kinematics> Session::arm_at(Time at) const {
  const JointCommand command = snapshot().command;
  if (command.q.size() != model_->dof()) return Error{"the arm has not reported its position yet"};
  Kinematics arm(*model_);
  arm.set_position(command.q + to_seconds(at - command.stamp.made) * command.dq);
  return arm;
}

Status Session::attach(const std::string& object, Time at, int tool) {
  const Result<Kinematics> arm = arm_at(at);
  if (!arm) return arm.error();
  return change_cell([&](Cell cell) { return steadyhand::attach(std::move(cell), object, *arm, tool); }, at);
}

Status Session::detach(const std::string& object, Time at) {
  const Result<Kinematics> arm = arm_at(at);
  if (!arm) return arm.error();
  return change_cell([&](Cell cell) { return steadyhand::detach(std::move(cell), object, *arm); }, at);
}

Cell Session::cell(Time at) const {
  const Lock lock(state_->mutex);
  return cell_after(state_->cell, to_seconds(at - state_->cell_at));
}

double Session::slowest_rate() const { return kLatePeriods / settings_.control.supervisor.planner_late_after; }

Status Session::set_planner_rate(double rate_hz) {
  const double slowest = slowest_rate();
  const double fastest = settings_.control.check.command_rate_hz;
  if (rate_hz != 0.0 && (!(rate_hz >= slowest) || rate_hz > fastest)) {
    return Error{
        fmt::format("rate is {} Hz; it must be from {:.0f} to {:.0f} Hz, or 0: as many as the machine sustains",
                    rate_hz, slowest, fastest)};
  }
  state_->chosen_rate_hz = rate_hz;
  return Done{};
}

SessionSnapshot Session::snapshot() const {
  const Lock lock(state_->mutex);
  return state_->snapshot;
}

bool Session::stopped_at_rest() const {
  const Lock lock(state_->mutex);
  return state_->stopped_at_rest && state_->stops == links_->asked.stops;
}

LiveSummary Session::summarize() {
  LiveSummary& s = state_->summary;
  s.duration = to_seconds(clock_->now() - state_->started);
  s.samples = state_->planner_view.samples;
  s.dropped_samples = state_->planner_view.dropped_samples;
  s.plans = state_->control_view.plans;
  s.failed_plans = state_->planner_view.failed;
  s.late_plans = state_->control_view.rejected_plans;
  s.cycles = state_->control_view.cycles;
  s.missed_deadlines = state_->control_view.missed_deadlines;
  const TapRings& rings = links_->taps;
  s.tap_drops = rings.samples.dropped() + rings.targets.dropped() + rings.settings.dropped() + rings.steps.dropped() +
                rings.commands.dropped() + rings.states.dropped() + rings.changes.dropped();
  s.latency_us = links_->latency_us.summary();
  s.solve_us = links_->solve_us.summary();
  s.wake_us = links_->wake_us.summary();
  s.monitor = state_->monitor.result();
  s.spilled = s.spilled || state_->monitor.spilled();
  return s;
}

}  // namespace steadyhand

#include "steadyhand/session/live/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace steadyhand {

namespace {

constexpr double kLatePeriods = 4.0;  ///< of the planner without a plan, before supervision may call it late

/// s, the longest look-ahead that leaves the planner its rate (Hz) on an arm with this cycle (s).
double longest_look_ahead(double cycle, double rate) { return std::max(cycle, 1.0 / rate - cycle); }

/// s, PlanningSettings::look_ahead for this rate (Hz).
double look_ahead_for(const LiveSettings& settings, double cycle, double rate) {
  if (settings.look_ahead > 0.0) return std::min(settings.look_ahead, longest_look_ahead(cycle, rate));
  return PlanningSettings::default_look_ahead(1.0 / rate);
}

}  // namespace

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
      chosen_rate_hz_(settings.adapt_rate ? 0.0 : settings.planner_rate_hz),
      sustained_rate_hz_(settings.planner_rate_hz),
      rate_keeper_(settings.planner_rate_hz, slowest_rate(), arm.info().rate_hz),
      monitor_(model, settings.glass),
      arm_kinematics_(model),
      cell_(settings.cell) {
  settings_.control.arm_delay = arm.info().delay;
  settings_.control.gripper = arm.info().gripper;
  settings_.control.check.command_rate_hz = arm.info().rate_hz;
  control_ = std::make_unique<ControlStage>(model, settings_.control, *links_);
}

Status Session::make_planning() {
  auto stage = PlanningStage::make(*model_, settings_.planning, *links_, *clock_);
  if (!stage) return stage.error();
  planning_ = std::move(*stage);
  return Done{};
}

void Session::begin(LiveTaps taps) {
  taps_ = std::move(taps);
  started_ = clock_->now();
  (void)set_cell(cell_, started_);
}

Time Session::plan() {
  const Time before = clock_->now();
  const bool planned = planning_->step(before);
  const Time now = clock_->now(), took = now - before;
  if (planned && chosen_rate_hz_ == 0.0 && rate_keeper_.take(1e6 * to_seconds(took), now)) {
    sustained_rate_hz_ = rate_keeper_.rate_hz();
  }
  return took;
}

double Session::look_ahead_at(double rate) const { return look_ahead_for(settings_, settings_.planning.cycle, rate); }

void Session::fail(const char* why, const char* details) noexcept {
  if (links_->failure.exchange(why) == why) return;
  try {
    warn(fmt::format("{} ({})", why, details));
  } catch (const std::exception&) {  // no memory for the words
  }
}

void Session::warn(const std::string& line) {
  const Lock lock(mutex_);
  warnings_.push_back(line);
}

std::vector<std::string> Session::warnings(std::size_t from) const {
  const Lock lock(mutex_);
  return {warnings_.begin() + static_cast<std::ptrdiff_t>(std::min(from, warnings_.size())), warnings_.end()};
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
    summary_.spilled = summary_.spilled || monitor_.liquid().spilled;
    if (applied.settings.fill) monitor_.fill(*applied.settings.fill);
  });
  if (const std::uint64_t refills = links_->refills; refills != refills_) {
    refills_ = refills;
    summary_.spilled = summary_.spilled || monitor_.liquid().spilled;
    monitor_.reset_liquid();
  }
  empty(rings.steps, taps_.step, nothing);
  see_cell();
  TappedCommand tapped;
  while (rings.commands.pop(tapped)) {
    monitor_.update(tapped.command, tapped.anew);
    if (taps_.command) taps_.command(tapped.command);
  }
  empty(rings.states, taps_.state, [&](const JointState& state) {
    monitor_.update(state);
    if (monitor_.result().states > 1) return;
    for (const std::string& line : monitor_.overlaps()) warn(line + " at start; move the arm or the object");
  });
  empty(rings.changes, taps_.change, [&](const SupervisionChange& change) { count(change); });
}

/// A cell that is new is told before the commands that know it.
void Session::see_cell() {
  std::optional<Obstacles> obstacles;
  Cell cell;
  {
    const Lock lock(mutex_);
    if (!fresh_obstacles_) return;
    obstacles = std::exchange(fresh_obstacles_, std::nullopt);
    cell = cell_;
  }
  if (taps_.cell) taps_.cell(obstacles->time, cell);
  std::vector<std::string> names;
  for (const CellObject& object : cell.objects) names.push_back(object.name);
  monitor_.set_obstacles(*obstacles, std::move(names));
}

void Session::count(const SupervisionChange& change) {
  if (change.from == SupervisionState::kEngaged) summary_.engaged += to_seconds(change.at - engaged_since_);
  if (change.to == SupervisionState::kEngaged) {
    engaged_since_ = change.at;
    ++summary_.engagements;
  }
  const bool held = change.to == SupervisionState::kHolding || change.to == SupervisionState::kStopping ||
                    change.to == SupervisionState::kFault;
  if (!held) return;
  const auto same = [&](const auto& entry) { return entry.first == change.reason; };
  const auto found = std::find_if(summary_.holds.begin(), summary_.holds.end(), same);
  if (found != summary_.holds.end()) {
    ++found->second;
  } else {
    summary_.holds.emplace_back(change.reason, 1);
  }
}

void Session::refresh() {
  (void)links_->control_view.read(control_view_);
  (void)links_->planner_view.read(planner_view_);

  SessionSnapshot s;
  s.now = control_view_.now;
  s.state = control_view_.state;
  s.reason = control_view_.reason;
  s.cause = control_view_.cause;
  if (control_failed_) {
    s.state = SupervisionState::kFault;
    s.reason = links_->failure.load();
    s.cause.code = ReasonCode::kFailed;
  }
  s.constraint = planner_view_.constraint;
  s.target = planner_view_.target;
  s.measured = control_view_.measured;
  s.command = control_view_.command;
  s.X_base_tool = {monitor_.arm().p(), Quaternion(monitor_.arm().R())};
  s.local_acceleration = monitor_.local_acceleration();
  s.tracking_error = planner_view_.tracking_error;
  if (s.state != SupervisionState::kEngaged && s.state != SupervisionState::kHolding) {
    s.target.X_base_tool = s.X_base_tool;  // the next grip begins there
    s.tracking_error = std::numeric_limits<double>::quiet_NaN();
  }
  const NearestPair nearest = nearest_pair(monitor_.arm(), monitor_.obstacles());
  s.clearance = nearest.gap;
  s.nearest = {nearest.first, nearest.second};
  const Plan& plan = planner_view_.plan;
  s.path_nodes = plan.joints > 0 ? std::min(plan.intervals + 1, kMaxHorizon + 1) : 0;
  for (int k = 0; k < s.path_nodes; ++k) {
    arm_kinematics_.set_position(plan.x[k].head(plan.joints));
    s.path[k] = {arm_kinematics_.p(), Quaternion(arm_kinematics_.R())};
  }
  s.prediction = planner_view_.reference;
  s.liquid = monitor_.liquid();
  s.solve_us = links_->solve_us.summary();
  s.latency_us = links_->latency_us.summary();
  s.wake_us = links_->wake_us.summary();
  s.plans = control_view_.plans;
  s.cycles = control_view_.cycles;
  s.missed_deadlines = control_view_.missed_deadlines;
  s.rejected_plans = control_view_.rejected_plans + planner_view_.failed;
  s.samples = planner_view_.samples;
  s.planner_rate_hz = planner_rate_hz();
  s.planner_rate_automatic = chosen_rate_hz_ == 0.0;

  const Lock lock(mutex_);
  snapshot_ = s;
  stopped_at_rest_ =
      control_view_.at_rest && (s.state == SupervisionState::kStopping || s.state == SupervisionState::kFault);
  stops_ = control_view_.stops;
}

Status Session::set_cell(const Cell& cell, Time at) {
  Result<Obstacles> obstacles = obstacles_of(cell, *model_);
  if (!obstacles) return obstacles.error();
  const Lock lock(mutex_);
  obstacles->time = at;
  obstacles->version = ++world_;
  links_->obstacles_to_control.write(*obstacles);
  links_->obstacles_to_plan.write(*obstacles);
  cell_ = cell;
  cell_at_ = at;
  fresh_obstacles_ = *obstacles;
  return Done{};
}

Session::CellSet Session::cell_set() const {
  const Lock lock(mutex_);
  return {cell_, cell_at_, world_};
}

Status Session::change_cell(const std::function<Result<Cell>(Cell)>& change, Time at) {
  const Lock lock(changes_);
  const Result<Cell> changed = change(cell(at));
  return changed ? set_cell(*changed, at) : Status(changed.error());
}

Result<Kinematics> Session::arm_at(Time at) const {
  const JointCommand command = snapshot().command;
  if (command.q.size() != model_->dof()) return Error{"the arm has not said yet where it is"};
  Kinematics arm(*model_);
  arm.set_position(command.q + to_seconds(at - command.stamp.made) * command.dq);
  return arm;
}

Status Session::attach(const std::string& object, Time at) {
  const Result<Kinematics> arm = arm_at(at);
  if (!arm) return arm.error();
  return change_cell([&](Cell cell) { return steadyhand::attach(std::move(cell), object, *arm); }, at);
}

Status Session::detach(const std::string& object, Time at) {
  const Result<Kinematics> arm = arm_at(at);
  if (!arm) return arm.error();
  return change_cell([&](Cell cell) { return steadyhand::detach(std::move(cell), object, *arm); }, at);
}

Cell Session::cell(Time at) const {
  const Lock lock(mutex_);
  return cell_after(cell_, to_seconds(at - cell_at_));
}

double Session::slowest_rate() const { return kLatePeriods / settings_.control.supervisor.planner_late_after; }

Status Session::set_planner_rate(double rate_hz) {
  const double slowest = slowest_rate();
  const double fastest = settings_.control.check.command_rate_hz;
  if (rate_hz != 0.0 && (!(rate_hz >= slowest) || rate_hz > fastest)) {
    return Error{fmt::format("rate is {} Hz; it must be from {:.0f} to {:.0f} Hz, or 0: what this machine sustains",
                             rate_hz, slowest, fastest)};
  }
  chosen_rate_hz_ = rate_hz;
  return Done{};
}

SessionSnapshot Session::snapshot() const {
  const Lock lock(mutex_);
  return snapshot_;
}

bool Session::stopped_at_rest() const {
  const Lock lock(mutex_);
  return stopped_at_rest_ && stops_ == links_->asked.stops;
}

LiveSummary Session::summarize() {
  LiveSummary& s = summary_;
  s.duration = to_seconds(clock_->now() - started_);
  s.samples = planner_view_.samples;
  s.dropped_samples = planner_view_.dropped_samples;
  s.plans = control_view_.plans;
  s.failed_plans = planner_view_.failed;
  s.late_plans = control_view_.rejected_plans;
  s.cycles = control_view_.cycles;
  s.missed_deadlines = control_view_.missed_deadlines;
  const TapRings& rings = links_->taps;
  s.tap_drops = rings.samples.dropped() + rings.targets.dropped() + rings.settings.dropped() + rings.steps.dropped() +
                rings.commands.dropped() + rings.states.dropped() + rings.changes.dropped();
  s.latency_us = links_->latency_us.summary();
  s.solve_us = links_->solve_us.summary();
  s.wake_us = links_->wake_us.summary();
  s.monitor = monitor_.result();
  s.spilled = s.spilled || monitor_.liquid().spilled;
  return s;
}

}  // namespace steadyhand

#include "steadyhand/planning/plan/planner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <ranges>
#include <utility>

#include "steadyhand/geometry/robot/model_check.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"
#include "steadyhand/planning/plan/level_stop.hpp"
#include "steadyhand/planning/plan/liquid_estimate.hpp"
#include "steadyhand/planning/plan/obstacle_rows.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "steadyhand/planning/plan/warm_start.hpp"

namespace steadyhand {

namespace {

/// Why there are no such plans, or Done.
Status check_settings(const PlannerSettings& settings) {
  constexpr double kLargestTolerance = 0.1, kLongestBudget = 1e9, kFastest = 1e5;  // us; Hz
  const PlanCheckSettings& check = settings.check;
  const struct {
    const char* key;
    double value, least, most;
    bool open;  ///< the least itself is outside
  } numbers[] = {{"tolerance", settings.tolerance, 0.0, kLargestTolerance, true},
                 {"budget.time_us", settings.budget.time_us, 0.0, kLongestBudget, false},
                 {"check.command_rate_hz", check.command_rate_hz, 0.0, kFastest, true},
                 {"check.tolerance", check.tolerance, 0.0, kLargestTolerance, false},
                 {"clearance", settings.clearance, 0.0, kMostClearance, false},
                 {"check.tool_speed_max", check.tool_speed_max, 0.0, 1e9, false},
                 {"check.elbow_speed_max", check.elbow_speed_max, 0.0, 1e9, false}};
  for (const auto& [key, value, least, most, open] : numbers) {
    if ((open ? value > least : value >= least) && value <= most) continue;
    return Error{fmt::format("{} is {}; it must be {} {}, to {}", key, value, open ? "above" : "from", least, most)};
  }
  if (settings.budget.iterations && *settings.budget.iterations < 1)
    return Error{fmt::format("budget.iterations is {}; it must be at least 1", *settings.budget.iterations)};
  return Done{};
}

/// Whether a solver may rely on what a constraint says of its rows.
Status check_rows(const Constraint& constraint, int dof, int all) {
  const auto refuse = [&](const std::string& reason) {
    return Error{fmt::format("constraints: '{}' {}", constraint.name(), reason)};
  };
  if (constraint.rows() < 0) return refuse(fmt::format("has {} rows; it must have 0 or more", constraint.rows()));
  const int entries = constraint.nodes() == Nodes::kStates ? 2 * dof : 3 * dof;
  for (int row = 0; row < constraint.rows(); ++row) {
    const Bounds bounds = constraint.bounds(row);
    if (!(bounds.lower <= bounds.upper)) {
      return refuse(fmt::format("keeps row {} from {} to {}; the lower bound must not be above the upper one", row,
                                bounds.lower, bounds.upper));
    }
    if (const int entry = constraint.entry(row); entry < -1 || entry >= entries) {
      return refuse(
          fmt::format("calls row {} entry {} of z; the entries are 0 to {}, and -1 is none", row, entry, entries - 1));
    }
    if (const EntryRange range = constraint.support(row, dof); range.first < 0 || range.first > range.last ||
                                                               range.last > all ||
                                                               (range.first < 3 * dof && range.last > 3 * dof)) {
      return refuse(
          fmt::format("has row {} depend on entries {} to {} of z; they must lie from 0 to {}, or from "
                      "there to {}",
                      row, range.first, range.last, 3 * dof, all));
    }
    if (const double price = constraint.price(row); !(price > 0.0)) {
      return refuse(fmt::format("has a price of {} in row {}; it must be above 0, and infinite for none", price, row));
    }
    if (std::isfinite(constraint.price(row)) && std::isfinite(bounds.lower) && std::isfinite(bounds.upper))
      return refuse(fmt::format("has a price in row {}, which has two bounds; such a row has one", row));
    if (std::isnan(constraint.activation_margin(row)))
      return refuse(fmt::format("has an activation margin of nan in row {}; it must be a number", row));
  }
  return Done{};
}

/// rad (m): with constant acceleration between them a joint goes no further than this beyond the further of two nodes.
JointVector margin_between_nodes(const RobotModel& model, const OcpSettings& ocp) {
  constexpr double kMost = 0.1;  // share of the range
  const JointVector bulge = ocp.acceleration_scale * ocp.dt * ocp.dt / 8.0 * model.acceleration_max;
  return bulge.cwiseMin(kMost * (model.position_max - model.position_min));
}

/// The problem, of which every part may be the caller's own.
Result<Ocp> make_ocp(const RobotModel& model, const OcpSettings& settings) {
  if (Status s = Ocp::check(settings); !s) return s.error();
  if (const auto size = settings.position_margin.size(); size != 0 && size != model.dof()) {
    return Error{fmt::format("position_margin has {} entries; it must have one for each of {} joints, or none", size,
                             model.dof())};
  }
  try {
    Ocp ocp(model, settings);
    for (const auto& constraint : ocp.constraints())
      if (Status s = check_rows(*constraint, ocp.dof(), ocp.entries()); !s) return s.error();
    return ocp;
  } catch (const std::exception& exception) {
    return Error{fmt::format("constraints: one cannot be made: {}", exception.what())};
  }
}

/// Index of the objective that damps the joints, or how many there are.
std::size_t find_damping(const Objectives& objectives) {
  const std::string name = make_velocity_objective()->name();
  const auto found = std::find_if(objectives.begin(), objectives.end(),
                                  [&](const auto& objective) { return objective && objective->name() == name; });
  return static_cast<std::size_t>(found - objectives.begin());
}

Status add_damping(Objectives& objectives) {
  if (find_damping(objectives) < objectives.size()) return Done{};
  const std::shared_ptr<const Objective> damping = make_velocity_objective();
  if (objectives.size() >= kMaxObjectives) {
    return Error{fmt::format("{} objectives without '{}', which the planner adds; it takes {} others at most",
                             objectives.size(), damping->name(), kMaxObjectives - 1)};
  }
  objectives.push_back(damping);
  return Done{};
}

/// The largest weight of a tool: its share of the weights, or all of them if they are not shared out.
double of_tool(const JointVector& weights, int tool, int tools) {
  const Eigen::Index each = weights.size() % tools == 0 ? weights.size() / tools : 0;
  return each > 0 ? weights.segment(each * tool, each).maxCoeff() : weights.maxCoeff();
}

/// Limits the distance of the reference from the tool to where the gradient of `position` equals the price of a wave
/// over the rim. Beyond that, spilling would cost less than the distance, and a far reference would make the arm too
/// fast to stop within the horizon.
void draw_near(const JointVector& q, Kinematics& arm, const Ocp& ocp, OcpInstance& instance) {
  arm.set_position(q);
  for (int t = 0; t < ocp.tool_count(); ++t) {
    if (!instance.liquid[t].counts) continue;
    double weight = 0.0;
    for (std::size_t i = 0; i < ocp.objectives().size(); ++i)
      if (ocp.objectives()[i]->name() == "position") weight = of_tool(instance.weights[i], t, ocp.tool_count());
    if (!(weight > 0.0)) continue;
    const double most = ocp.liquid()->price / (2.0 * weight);  // m: the cost's gradient there is the price
    for (int k = 0; k < instance.reference.nodes; ++k) {
      Vector3& p = instance.reference.tools[t].p[k];
      if (const double away = (p - arm.p(t)).norm(); away > most) p = arm.p(t) + most / away * (p - arm.p(t));
    }
  }
}

}  // namespace

Planner::Planner(const RobotModel& model, Ocp ocp, const PlannerSettings& settings)
    : settings_(settings),
      ocp_(std::move(ocp)),
      kinematics_(model),
      warm_start_(std::make_unique<WarmStart>(ocp_)),
      obstacle_rows_(std::make_unique<ObstacleRows>(ocp_)),
      evaluation_(ocp_) {
  solution_.prepare(ocp_);
  damping_ = find_damping(ocp_.objectives());
  instance_.near.resize(ocp_.obstacle_rows());
  kinematics_.set_position(model.home);
  settings_.clearance = std::clamp(0.25 * steadyhand::clearance(kinematics_), 0.0, settings_.clearance);
  liquids_.resize(ocp_.liquid() ? ocp_.tool_count() : 0);
  for (int t = 0; t < std::ssize(liquids_); ++t) {
    liquids_[t].estimate = std::make_unique<LiquidEstimate>(model, *ocp_.liquid(), t);
    (void)set_glass(ocp_.liquid()->glass, t);
  }
}

Planner::~Planner() = default;

Result<std::unique_ptr<Planner>> Planner::make(const RobotModel& model, const OcpSettings& ocp,
                                               const PlannerSettings& settings) {
  if (Status s = check(model); !s) return s.error();
  if (Status s = check_settings(settings); !s) return s.error();
  OcpSettings problem_settings = ocp;
  if (ocp.position_margin.size() == 0) problem_settings.position_margin = margin_between_nodes(model, ocp);
  if (settings.obstacles.count > 0 && ocp.obstacle_rows == 0) problem_settings.obstacle_rows = kUsualObstacleRows;
  if (Status s = add_damping(problem_settings.objectives); !s) return s.error();
  Result<Ocp> problem = make_ocp(model, problem_settings);
  if (!problem) return problem.error();
  std::unique_ptr<Planner> planner(new Planner(model, *std::move(problem), settings));
  auto solver = make_solver(settings.solver, planner->ocp_, settings.tolerance);
  if (!solver) return solver.error();
  planner->solver_ = std::move(*solver);
  auto weights = planner->ocp_.weights(ocp.weights);
  if (!weights) return weights.error();
  planner->set_weights(*weights);
  if (Status s = planner->set_obstacles(settings.obstacles); !s) return s.error();
  planner->velocity_max_ = ocp.velocity_scale * model.velocity_max;
  planner->reset(model.home, Time(0));
  return planner;
}

void Planner::set_weights(std::span<const JointVector> weights) {
  constexpr double kShare = 1e-6;  // share of the largest weight; below it the solver may not reach its tolerance
  instance_.weights.assign(weights.begin(), weights.end());
  double least = kLeastDamping;
  for (const JointVector& weight : weights) {
    if (weight.size() > 0) least = std::max(least, kShare * weight.maxCoeff());
  }
  if (damping_ < weights.size()) instance_.weights[damping_] = weights[damping_].cwiseMax(least);
}

void Planner::reset(const JointVector& q, Time now) {
  for (auto& [estimate, known] : liquids_) {
    const bool stands = plan_.joints > 0 && (sample(plan_, now).q - q).lpNorm<Eigen::Infinity>() < 1e-9;
    known = {stands ? estimate->at(plan_, known.state, known.at, now) : estimate->at_rest(q), now};
  }
  stand(q, now, plan_);
  fault_ = PlanFault::kNone;
  more_clearance_ = 0.0;
  warm_start_->reset(now);
}

void Planner::continue_from(const Planner& before) {
  plan_ = before.plan_;
  fault_ = PlanFault::kNone;
  more_clearance_ = 0.0;
  warm_start_->reset(plan_.start);
  const bool knows = !before.liquids_.empty();
  for (std::size_t t = 0; t < liquids_.size(); ++t) {
    const SloshState rest = liquids_[t].estimate->at_rest(plan_.x[0].head(plan_.joints));
    liquids_[t].known = {knows ? before.liquids_[t].known.state : rest,
                         knows ? before.liquids_[t].known.at : plan_.start};
  }
}

Status Planner::set_glass(const GlassSettings& glass, int tool) {
  if (liquids_.empty()) return Error{"the problem knows no liquid"};
  if (tool < 0 || tool >= std::ssize(liquids_))
    return Error{fmt::format("a glass for tool {}; the tools are 0 to {}", tool, liquids_.size() - 1)};
  LiquidSettings settings = *ocp_.liquid();
  settings.glass = glass;
  if (Status s = check(settings); !s) return s.error();
  liquids_[tool].estimate->set_glass(glass);
  LiquidInstance& liquid = instance_.liquid[tool];
  liquid.glass = glass;
  liquid.model = SloshModel(glass, ocp_.dt(), settings.frequencies);
  liquid.room = std::max(0.25 * glass.freeboard(), glass.freeboard() - settings.margin);
  return Done{};
}

void Planner::set_given(JointSet joints) { instance_.given = joints & (JointSet().set() >> (kMaxJoints - ocp_.dof())); }

Status Planner::set_obstacles(const Obstacles& obstacles) {
  if (Status s = check(obstacles); !s) return s.error();
  if (obstacles.count > 0 && ocp_.obstacle_rows() == 0) {
    return Error{fmt::format("{} obstacles for a problem whose obstacle_rows is 0", obstacles.count)};
  }
  for (const Obstacle& obstacle : obstacles.all()) {
    if (obstacle.tool < 0 || obstacle.tool >= ocp_.tool_count())
      return Error{fmt::format("an obstacle is carried by tool {}; the tools are 0 to {}", obstacle.tool,
                               ocp_.tool_count() - 1)};
  }
  settings_.obstacles = obstacles;
  return Done{};
}

const Plan& Planner::update(const Reference& reference) {
  const JointCommand now = sample(plan_, reference.start);
  instance_.x0.resize(2 * ocp_.dof());
  instance_.x0 << now.q, now.dq;
  for (int j = 0; j < ocp_.dof(); ++j) {
    double& speed = instance_.x0[ocp_.dof() + j];
    if (instance_.given[j] && std::abs(speed) < kStill) speed = 0.0;
  }
  instance_.u_followed = sample(plan_, reference.start - Time(1)).ddq;
  instance_.reference = reference;
  for (std::size_t t = 0; t < liquids_.size(); ++t) {
    auto& [estimate, known] = liquids_[t];
    known = {estimate->at(plan_, known.state, known.at, reference.start), reference.start};
    instance_.liquid[t].state = known.state;
  }
  if (!liquids_.empty()) draw_near(now.q, kinematics_, ocp_, instance_);
  set_clearance(reference.start);
  warm_start_->shift(instance_.x0, reference.start);
  warm_start_->stop(instance_.given);
  obstacle_rows_->choose(settings_.obstacles, reference.start, kinematics_, *warm_start_, instance_);
  try {
    solver_->solve(instance_, warm_start_->guess(), warm_start_->multipliers(), settings_.budget, solution_);
  } catch (...) {  // a third-party solver failed: the arm continues on the checked plan
    solution_.status = SolveStatus::kInvalid;
    solution_.iterations = 0;
  }

  // The stop after the solution's last node is not part of the problem: it may need to start earlier.
  fault_ = PlanFault::kNotFinite;
  // If there was no time for an iteration, a feasible solution is only the guess: nothing was planned. An infeasible
  // solution may pass the check: an arm cannot move out of the way of an obstacle at once.
  const bool improved = solution_.iterations > 0 &&
                        (solution_.status == SolveStatus::kFeasible || solution_.status == SolveStatus::kInfeasible);
  if (solution_.status == SolveStatus::kSolved || improved) {
    find_plan(reference);
  }
  if (fault_ == PlanFault::kNone) {
    plan_ = candidate_;
    warm_start_->keep(solution_, reference.start);
  } else {
    plan_.origin = PlanOrigin::kPrevious;
  }
  return plan_;
}

const Trajectory& Planner::guess() const { return warm_start_->guess(); }

SolveFigures Planner::figures() {
  SolveFigures figures{solution_.objective, {}, solution_.iterations, solution_.time_us};
  evaluation_.set_instance(instance_);
  evaluation_.set_trajectory(solution_.trajectory);
  const int count = static_cast<int>(std::min(ocp_.objectives().size(), figures.shares.size()));
  for (int i = 0; i < count; ++i) figures.shares[i] = evaluation_.objective_share(i);
  return figures;
}

/// A solution may cut a corner between its nodes, or be so fast that no stop after it is free. The next solutions would
/// have the same fault, and the arm would stop although the path is free. Bodies are therefore kept further apart until
/// a solution passes the check.
void Planner::set_clearance(Time now) {
  constexpr double kFirst = 1e-3, kLeast = 1e-5;  // m
  constexpr double kForgotten = 0.2;              // s, after which it is less by the factor e
  double& more = more_clearance_;
  if (fault_ == PlanFault::kSelfCollision || fault_ == PlanFault::kObstacle) {
    more = std::min(std::max(kFirst, 2.0 * more), kMostClearance);
  } else {
    more *= std::exp(-std::max(0.0, to_seconds(now - plan_.start)) / kForgotten);
    if (more < kLeast) more = 0.0;
  }
  instance_.clearance = std::min(settings_.clearance + more, kMostClearance);
}

/// Sets candidate_ to the longest part of the solution after which a stop passes the check.
void Planner::find_plan(const Reference& reference) {
  const bool some_count = std::ranges::any_of(instance_.liquid, &LiquidInstance::counts);
  return some_count && !liquids_.empty() ? find_level_plan(reference) : find_any_plan(reference);
}

template <typename F>
Planner::Waves Planner::waves(const F& wave_of) {
  Waves result{0.0, -std::numeric_limits<double>::infinity()};
  for (std::size_t t = 0; t < liquids_.size(); ++t) {
    const LiquidInstance& liquid = instance_.liquid[t];
    if (!liquid.counts) continue;
    const double wave = wave_of(*liquids_[t].estimate, liquid.state);
    result.highest = std::max(result.highest, wave);
    result.over = std::max(result.over, wave - liquid.glass.freeboard());
  }
  return result;
}

/// An even stop continues along the path; a hard stop is the shortest, for where that path is not free.
void Planner::find_any_plan(const Reference& reference) {
  for (const Braking braking : {Braking::kEven, Braking::kHard}) {
    for (int intervals = ocp_.horizon(); intervals >= 1 && fault_ != PlanFault::kNone; --intervals) {
      make_plan(reference, intervals);
      make_stop(intervals, braking);
      fault_ = check_candidate();
    }
  }
}

/// The same with a stop that does not spill, or, if there is none, the stop with the lowest wave.
void Planner::find_level_plan(const Reference& reference) {
  constexpr double kEven = 0.0, kPeriods[] = {1.0, 2.0, 3.0, kEven};  // durations of the stop, in periods
  struct {
    int intervals = 0;
    double periods = 0.0;
    Waves waves;
  } least;                      // lowest wave among candidates that pass the check
  double longest_period = 0.0;  // s
  for (const Liquid& liquid : liquids_) longest_period = std::max(longest_period, liquid.estimate->period());
  const auto make = [&](int intervals, double periods) {
    make_plan(reference, intervals);
    if (periods > 0.0)
      return make_level_stop(kinematics_, intervals, periods * longest_period, instance_.given, candidate_);
    make_stop(intervals, Braking::kEven);
    return true;
  };
  const int N = ocp_.horizon();
  make_plan(reference, N);
  candidate_.intervals = N;
  for (std::size_t t = 0; t < liquids_.size(); ++t) liquids_[t].estimate->walk(candidate_, instance_.liquid[t].state);
  for (const int intervals : {N, (N + 1) / 2, 1}) {
    for (const double periods : kPeriods) {
      if (!make(intervals, periods)) continue;
      const Waves now = waves([&](LiquidEstimate& estimate, const SloshState&) {
        return std::max(estimate.walked(intervals), estimate.highest_behind(candidate_, intervals));
      });
      if (least.intervals > 0 && now.over >= least.waves.over) continue;
      fault_ = check_candidate();
      if (fault_ != PlanFault::kNone) continue;
      least = {intervals, periods, now};
      if (now.over > 0.0) continue;
      highest_wave_ = now.highest;
      return;
    }
  }
  // If the followed plan has no lower wave, a wave above the rim is no reason to keep it.
  const double first = waves([&](LiquidEstimate& estimate, const SloshState&) {
                         return estimate.walked(std::max(1, least.intervals));
                       }).over;
  const auto highest_on = [&](const Plan& plan) {
    return waves([&](LiquidEstimate& estimate, const SloshState& state) {
      return estimate.highest(plan, state, reference.start);
    });
  };
  if (first > 0.0 && first > highest_on(plan_).over) {
    fault_ = PlanFault::kSpill;
    return;
  }
  fault_ = PlanFault::kNotFinite;
  if (least.intervals == 0) {
    find_any_plan(reference);
    highest_wave_ = highest_on(candidate_).highest;
    return;
  }
  (void)make(least.intervals, least.periods);
  fault_ = check_candidate();
  highest_wave_ = least.waves.highest;
}

PlanFault Planner::check_candidate() {
  return check_plan(candidate_, instance_.x0, settings_.check, kinematics_, settings_.obstacles);
}

/// The solution's first intervals, still without a stop.
void Planner::make_plan(const Reference& reference, int intervals) {
  const int n = ocp_.dof();
  candidate_.stamp = reference.stamp;
  candidate_.start = reference.start;
  candidate_.velocity_max = velocity_max_;
  candidate_.dt = ocp_.dt();
  candidate_.joints = n;
  candidate_.world = settings_.obstacles.version;
  candidate_.origin = solution_.status == SolveStatus::kSolved ? PlanOrigin::kSolved : PlanOrigin::kFeasible;
  for (int k = 0; k < intervals; ++k) {
    candidate_.x[k] = solution_.trajectory.x[k];
    candidate_.u[k] = solution_.trajectory.u[k];
  }
  candidate_.x[intervals] = solution_.trajectory.x[intervals];
}

/// After the first intervals all joints brake. kEven: all in the time that the slowest to stop needs, except joints
/// that would pass a position limit and brake sooner, and given ones, which continue to brake as they began. kHard:
/// each brakes as hard as it can.
void Planner::make_stop(int intervals, Braking braking) {
  const int n = ocp_.dof();
  const double dt = ocp_.dt();
  const RobotModel& model = ocp_.model();
  const StateVector from = candidate_.x[intervals];
  const JointVector velocity = from.tail(n);
  const JointVector times = velocity.cwiseAbs().cwiseQuotient(model.acceleration_max);  // s, of the hardest braking
  const auto whole = [](double count) { return static_cast<int>(std::ceil(count - 1e-9)); };
  const int stop = std::min(whole(times.maxCoeff() / dt), Plan::kMaxIntervals - intervals);
  candidate_.intervals = intervals + stop;
  JointVector steps(n);  // rad/s, by which a joint's speed falls in an interval
  for (int j = 0; j < n; ++j) {
    steps[j] = braking == Braking::kHard ? model.acceleration_max[j] * dt
               : instance_.given[j]      ? std::abs(candidate_.u[0][j]) * dt
                                         : braking_step(model, j, from[j], from[n + j], stop, dt);
  }
  for (int k = intervals; k < intervals + stop; ++k) {
    const JointVector left = candidate_.x[k].tail(n);
    candidate_.u[k] = -left.cwiseMin(steps).cwiseMax(-steps) / dt;
    candidate_.x[k + 1] = ocp_.next(candidate_.x[k], candidate_.u[k]);
  }
}

}  // namespace steadyhand

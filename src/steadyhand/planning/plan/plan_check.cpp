#include "steadyhand/planning/plan/plan_check.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/core/texts.hpp"
#include "steadyhand/planning/plan/link_gaps.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"

namespace steadyhand {

std::string_view to_string(PlanFault fault) {
  using enum PlanFault;
  static constexpr std::pair<PlanFault, std::string_view> kTexts[] = {
      {kNone, "none"},
      {kNotFinite, "not finite"},
      {kNotAtRest, "does not end at rest"},
      {kDiscontinuous, "discontinuous"},
      {kPosition, "beyond a position limit"},
      {kVelocity, "beyond a velocity limit"},
      {kAcceleration, "beyond an acceleration limit"},
      {kSelfCollision, "in self-collision"},
      {kObstacle, "in contact with an obstacle"},
      {kToolSpeed, "beyond the tool's speed limit"},
      {kElbowSpeed, "beyond the elbow's speed limit"},
      {kSpill, "a wave over the rim"},
  };
  return text_of(kTexts, fault);
}

namespace {

constexpr double kAnySpeed = 1e9;  // m/s

bool beyond(const JointVector& value, const JointVector& lower, const JointVector& upper, double tolerance) {
  return ((value - lower).array() < -tolerance).any() || ((value - upper).array() > tolerance).any();
}

/// Largest speed of the origin of an arm's third joint, m/s. After set_position.
double elbow_speed(const Kinematics& kinematics, const JointVector& dq) {
  double fastest = 0.0;
  for (int t = 0; t < kinematics.tool_count(); ++t) {
    const std::vector<int>& chain = kinematics.chain(t);
    if (chain.size() < 3) continue;
    Vector3 speed = Vector3::Zero();
    for (const int k : {chain[0], chain[1]}) speed += dq[k] * kinematics.dpoint(k, kinematics.origin(chain[2]));
    fastest = std::max(fastest, speed.norm());
  }
  return fastest;
}

/// Of the fastest tool. After set_position.
double tool_speed(const Kinematics& kinematics, const JointVector& dq) {
  double fastest = 0.0;
  for (int t = 0; t < kinematics.tool_count(); ++t) {
    Vector3 speed = Vector3::Zero();
    for (const int k : kinematics.chain(t)) speed += dq[k] * kinematics.dp(k, t);
    fastest = std::max(fastest, speed.norm());
  }
  return fastest;
}

/// Finds the pairs that the plan may bring near from interval `first` on. No point is further from its position at a
/// node than half of its path to the next one.
void find_near(const Plan& plan, int first, const LinkPairs& levers, Kinematics& arm, ObstacleSweep& sweep) {
  const int n = arm.dof();
  LinkLengths stray = LinkLengths::Zero(n + 1);
  for (int k = first; k <= plan.intervals; ++k) {
    arm.set_position(plan.x[k].head(n));
    sweep.pass(arm);
    if (k == plan.intervals) break;
    const JointVector speed = plan.x[k].tail(n).cwiseAbs().cwiseMax(plan.x[k + 1].tail(n).cwiseAbs());
    for (int j = 1; j <= n; ++j) {
      double way = 0.0;
      for (int i = 0; i < j; ++i) way += plan.dt * levers(i, j) * speed[i];  // 0 of joints that do not move it
      stray[j] = std::max(stray[j], 0.5 * way);
    }
  }
  sweep.find((plan.intervals - first) * plan.dt, 0.0, stray);
}

/// Finite numbers, a double integrator's states that continue `before`, limits of the joints, and rest at the end.
PlanFault check_numbers(const Plan& plan, const StateVector& before, const PlanCheckSettings& settings,
                        const RobotModel& model) {
  const int n = model.dof();
  const double dt = plan.dt, tolerance = settings.tolerance;
  if (!(dt > 0.0 && dt < 1e6) || plan.intervals < 0 || plan.intervals > Plan::kMaxIntervals) {
    return PlanFault::kNotFinite;
  }
  for (int k = 0; k <= plan.intervals; ++k) {
    if (plan.x[k].size() != 2 * n || !plan.x[k].allFinite()) return PlanFault::kNotFinite;
    if (k < plan.intervals && (plan.u[k].size() != n || !plan.u[k].allFinite())) return PlanFault::kNotFinite;
  }
  if ((plan.x[0] - before).lpNorm<Eigen::Infinity>() > tolerance) return PlanFault::kDiscontinuous;
  if (plan.x[plan.intervals].tail(n).lpNorm<Eigen::Infinity>() > tolerance) return PlanFault::kNotAtRest;

  // The arm's present state may be outside the limits; the plan must not move further outside.
  const JointVector q0 = plan.x[0].head(n), fastest = model.velocity_max.cwiseMax(plan.x[0].tail(n).cwiseAbs());
  const JointVector lowest = model.position_min.cwiseMin(q0), highest = model.position_max.cwiseMax(q0);
  const int commands = static_cast<int>(std::ceil(dt * settings.command_rate_hz));
  for (int k = 0; k < plan.intervals; ++k) {
    if (beyond(plan.u[k], -model.acceleration_max, model.acceleration_max, tolerance)) return PlanFault::kAcceleration;
    for (int i = 0; i <= commands; ++i) {
      const double s = dt * i / commands;
      const JointVector dq = plan.x[k].tail(n) + s * plan.u[k];
      const JointVector q = plan.x[k].head(n) + s * plan.x[k].tail(n) + (0.5 * s * s) * plan.u[k];
      if (beyond(dq, -fastest, fastest, tolerance)) return PlanFault::kVelocity;
      if (beyond(q, lowest, highest, tolerance)) return PlanFault::kPosition;
      if (i < commands) continue;
      const double jump = std::max((q - plan.x[k + 1].head(n)).lpNorm<Eigen::Infinity>(),
                                   (dq - plan.x[k + 1].tail(n)).lpNorm<Eigen::Infinity>());
      if (jump > tolerance) return PlanFault::kDiscontinuous;
    }
  }
  return PlanFault::kNone;
}

/// The moment `s` (s) after another, with constant acceleration of the joints in between.
Moment after(const Moment& from, const JointVector& acceleration, double s) {
  return {from.t + s, from.q + s * from.dq + (0.5 * s * s) * acceleration, from.dq + s * acceleration, {}};
}

}  // namespace

PlanFault check_way(const Plan& plan, Time from, const PlanCheckSettings& settings, Kinematics& kinematics,
                    const Obstacles& obstacles) {
  const RobotModel& model = kinematics.model();
  const int n = model.dof();
  const double passed = std::max(0.0, to_seconds(from - plan.start));
  if (passed >= plan.intervals * plan.dt) return PlanFault::kNone;
  const int first = std::min(static_cast<int>(passed / plan.dt), plan.intervals - 1);
  const double into = passed - first * plan.dt;

  const LinkPairs reach = levers(model, obstacles);
  ObstacleSweep sweep(model, obstacles, plan.start + from_seconds(passed));
  if (obstacles.count > 0) find_near(plan, first, reach, kinematics, sweep);
  Moment start = after({-into, plan.x[first].head(n), plan.x[first].tail(n), {}}, plan.u[first], into);
  start.t = 0.0;
  kinematics.set_position(start.q);
  if (obstacles.count > 0) sweep.note_entered(kinematics, settings.tolerance);
  start.gaps = gaps(kinematics, sweep, 0.0);
  // A value that is beyond its limit now may return, but not move further beyond it.
  const LinkPairs usual = -(settings.tolerance - start.gaps).max(settings.tolerance);
  LinkPairs smallest = usual;
  const auto cap = [](double most, double now) { return most > 0.0 ? std::max(most, now + 1e-6) : kAnySpeed; };
  const double tool_most = cap(settings.tool_speed_max, tool_speed(kinematics, start.dq));
  const double elbow_most = cap(settings.elbow_speed_max, elbow_speed(kinematics, start.dq));
  GapsBetween gaps_between(kinematics, sweep, reach, smallest, settings.tolerance);
  const bool speeds_count = std::min(tool_most, elbow_most) < kAnySpeed;
  const auto too_fast = [&](const Moment& moment) {
    if (!speeds_count) return PlanFault::kNone;
    kinematics.set_position(moment.q);
    if (tool_speed(kinematics, moment.dq) > tool_most) return PlanFault::kToolSpeed;
    if (elbow_speed(kinematics, moment.dq) > elbow_most) return PlanFault::kElbowSpeed;
    return PlanFault::kNone;
  };
  // An obstacle that approaches the arm may come as near as if the arm braked at once, which is always allowed.
  const auto let_come = [&](const Moment& first_moment, const Moment& middle, const Moment& last_moment) {
    smallest = usual;
    for (const double t : {first_moment.t, middle.t, last_moment.t}) {
      kinematics.set_position(straight_stop_at(model, start.q, start.dq, t));
      const LinkPairs braking = gaps(kinematics, sweep, t);
      for (const ObstacleRow kind : {kMoving, kEnteredMoving}) {
        auto row = smallest.row(row_of(kind, model));
        row = row.min(braking.row(row_of(kind, model)) - settings.tolerance);
      }
    }
  };
  const bool some_move = (sweep.fastest() > 0.0).any();
  Moment node = start;
  for (int k = first; k < plan.intervals; ++k) {
    const double left = k == first ? plan.dt - into : plan.dt;
    Moment middle = after(node, plan.u[k], 0.5 * left);
    Moment next{node.t + left, plan.x[k + 1].head(n), plan.x[k + 1].tail(n), {}};
    const auto fault_on_the_way = [&] {
      PlanFault fault = gaps_between.look(node, middle, plan.u[k]);
      if (fault == PlanFault::kNone) fault = gaps_between.look(middle, next, plan.u[k]);
      if (fault == PlanFault::kNone) fault = too_fast(middle);
      if (fault == PlanFault::kNone) fault = too_fast(next);
      return fault;
    };
    smallest = usual;
    PlanFault fault = fault_on_the_way();
    if (fault == PlanFault::kObstacle && some_move) {
      let_come(node, middle, next);
      fault = fault_on_the_way();
    }
    if (fault != PlanFault::kNone) return fault;
    node = next;
  }
  return PlanFault::kNone;
}

PlanFault check_plan(const Plan& plan, const StateVector& before, const PlanCheckSettings& settings,
                     Kinematics& kinematics, const Obstacles& obstacles) {
  const PlanFault fault = check_numbers(plan, before, settings, kinematics.model());
  return fault != PlanFault::kNone ? fault : check_way(plan, plan.start, settings, kinematics, obstacles);
}

}  // namespace steadyhand

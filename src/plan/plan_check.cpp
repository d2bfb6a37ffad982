#include "plan/plan_check.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

std::string_view to_string(PlanFault fault) {
  switch (fault) {
    case PlanFault::kNone:
      return "none";
    case PlanFault::kNotFinite:
      return "not finite";
    case PlanFault::kNotAtRest:
      return "does not end at rest";
    case PlanFault::kDiscontinuous:
      return "discontinuous";
    case PlanFault::kPosition:
      return "beyond a position limit";
    case PlanFault::kVelocity:
      return "beyond a velocity limit";
    case PlanFault::kAcceleration:
      return "beyond an acceleration limit";
    case PlanFault::kSelfCollision:
      return "in self-collision";
  }
  return "unknown";
}

namespace {

bool beyond(const JointVector& value, const JointVector& lower, const JointVector& upper, double tolerance) {
  return ((value - lower).array() < -tolerance).any() || ((value - upper).array() > tolerance).any();
}

}  // namespace

PlanFault check_plan(const Plan& plan, const StateVector& before, const PlanCheckSettings& settings,
                     Kinematics& kinematics) {
  const RobotModel& model = kinematics.model();
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

  // The state that the arm has now may be outside; what matters is where the plan leads: no further.
  const JointVector q0 = plan.x[0].head(n), fastest = model.velocity_max.cwiseMax(plan.x[0].tail(n).cwiseAbs());
  const JointVector lowest = model.position_min.cwiseMin(q0), highest = model.position_max.cwiseMax(q0);
  kinematics.set_position(q0);
  const double depth = -kinematics.clearance() + tolerance;
  const auto in_collision = [&](Time t, double overlap) {
    kinematics.set_position(sample(plan, t).q);
    return kinematics.clearance() < -std::max(overlap, depth);
  };
  const int commands = static_cast<int>(std::ceil(dt * settings.command_rate_hz));
  for (int k = 0; k < plan.intervals; ++k) {
    const Time begin = plan.start + from_seconds(k * dt);
    if (beyond(plan.u[k], -model.acceleration_max, model.acceleration_max, tolerance)) return PlanFault::kAcceleration;
    for (int i = 0; i <= commands; ++i) {
      const double s = dt * i / commands;
      const JointVector dq = plan.x[k].tail(n) + s * plan.u[k];
      const JointVector q = plan.x[k].head(n) + s * plan.x[k].tail(n) + (0.5 * s * s) * plan.u[k];
      if (beyond(dq, -fastest, fastest, tolerance)) return PlanFault::kVelocity;
      if (beyond(q, lowest, highest, tolerance)) return PlanFault::kPosition;
      if (i == commands) {
        const double jump = std::max((q - plan.x[k + 1].head(n)).lpNorm<Eigen::Infinity>(),
                                     (dq - plan.x[k + 1].tail(n)).lpNorm<Eigen::Infinity>());
        if (jump > tolerance) return PlanFault::kDiscontinuous;
      }
    }
    if (in_collision(begin + from_seconds(0.5 * dt), settings.overlap_between_nodes) ||
        in_collision(begin + from_seconds(dt), tolerance)) {
      return PlanFault::kSelfCollision;
    }
  }
  return PlanFault::kNone;
}

}  // namespace steadyhand

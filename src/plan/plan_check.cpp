#include "plan/plan_check.hpp"

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

  for (int k = 0; k <= plan.intervals; ++k) {
    if (plan.x[k].size() != 2 * n || !plan.x[k].allFinite()) return PlanFault::kNotFinite;
    if (k < plan.intervals && (plan.u[k].size() != n || !plan.u[k].allFinite())) return PlanFault::kNotFinite;
  }
  if ((plan.x[0] - before).lpNorm<Eigen::Infinity>() > tolerance) return PlanFault::kDiscontinuous;
  if (plan.x[plan.intervals].tail(n).lpNorm<Eigen::Infinity>() > tolerance) return PlanFault::kNotAtRest;

  const auto in_collision = [&](Time t, double overlap) {
    kinematics.set_position(sample(plan, t).q);
    return kinematics.clearance() < -overlap;
  };
  const int commands = static_cast<int>(std::ceil(dt * settings.command_rate_hz));
  for (int k = 0; k < plan.intervals; ++k) {
    const Time begin = plan.start + from_seconds(k * dt);
    if (beyond(plan.u[k], -model.acceleration_max, model.acceleration_max, tolerance)) return PlanFault::kAcceleration;
    for (int i = 0; i <= commands; ++i) {
      const double s = dt * i / commands;
      const JointVector dq = plan.x[k].tail(n) + s * plan.u[k];
      const JointVector q = plan.x[k].head(n) + s * plan.x[k].tail(n) + (0.5 * s * s) * plan.u[k];
      // The state that the arm has now may be slightly outside; what matters is where the plan leads.
      if (k + i > 0 && beyond(dq, -model.velocity_max, model.velocity_max, tolerance)) return PlanFault::kVelocity;
      if (k + i > 0 && beyond(q, model.position_min, model.position_max, tolerance)) return PlanFault::kPosition;
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

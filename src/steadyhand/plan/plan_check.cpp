#include "steadyhand/plan/plan_check.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/plan/gaps.hpp"

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
    case PlanFault::kObstacle:
      return "in contact with an obstacle";
    case PlanFault::kToolSpeed:
      return "beyond the tool's speed limit";
    case PlanFault::kElbowSpeed:
      return "beyond the elbow's speed limit";
  }
  return "unknown";
}

namespace {

bool beyond(const JointVector& value, const JointVector& lower, const JointVector& upper, double tolerance) {
  return ((value - lower).array() < -tolerance).any() || ((value - upper).array() > tolerance).any();
}

/// m/s, of the third joint's origin.
double elbow_speed(const RobotModel& model, const JointVector& q, const JointVector& dq) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Vector3 angular = Vector3::Zero(), linear = Vector3::Zero();  // of the joint's frame, in the base
  for (int k = 0; k < std::min(3, model.dof()); ++k) {
    const Joint& joint = model.joints[k];
    const Eigen::Isometry3d next = pose * joint.origin;
    linear += angular.cross(next.translation() - pose.translation());
    const Vector3 axis = next.linear() * joint.axis;
    if (k == 2) return linear.norm();
    (joint.type == JointType::kRevolute ? angular : linear) += dq[k] * axis;
    pose = next * motion(joint, q[k]);
  }
  return 0.0;
}

/// After set_position.
double tool_speed(const Kinematics& kinematics, const JointVector& dq) {
  Vector3 speed = Vector3::Zero();
  for (int k = 0; k < kinematics.dof(); ++k) speed += dq[k] * kinematics.dp(k);
  return speed.norm();
}

/// Leaves what the plan may come near. No point strays further from where it is at a node than half of its way to the
/// next one.
void find_near(const Plan& plan, const LinkPairs& levers, Kinematics& arm, ObstacleSweep& sweep) {
  const int n = arm.dof();
  LinkLengths stray = LinkLengths::Zero();
  for (int k = 0; k <= plan.intervals; ++k) {
    arm.set_position(plan.x[k].head(n));
    sweep.pass(arm);
    if (k == plan.intervals) break;
    const JointVector speed = plan.x[k].tail(n).cwiseAbs().cwiseMax(plan.x[k + 1].tail(n).cwiseAbs());
    for (int j = 1; j <= n; ++j) {
      double way = 0.0;
      for (int i = 0; i < j; ++i) way += plan.dt * levers(i, j) * speed[i];
      stray[j] = std::max(stray[j], 0.5 * way);
    }
  }
  sweep.find(plan.intervals * plan.dt, 0.0, stray);
}

}  // namespace

PlanFault check_plan(const Plan& plan, const StateVector& before, const PlanCheckSettings& settings,
                     Kinematics& kinematics, const Obstacles& obstacles) {
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
  const JointVector dq0 = plan.x[0].tail(n);
  const LinkPairs reach = levers(model);
  ObstacleSweep sweep(model, obstacles, plan.start);
  if (obstacles.count > 0) find_near(plan, reach, kinematics, sweep);
  kinematics.set_position(q0);
  Moment node{0.0, q0, dq0, gaps(kinematics, sweep, 0.0)};
  const LinkPairs smallest = -(tolerance - node.gaps).max(tolerance);
  const auto cap = [](double most, double now) { return most > 0.0 ? std::max(most, now + 1e-6) : 1e9; };
  const double tool_most = cap(settings.tool_speed_max, tool_speed(kinematics, dq0));
  const double elbow_most = cap(settings.elbow_speed_max, elbow_speed(model, q0, dq0));
  const LinkPairs smallest_between = smallest.min(-settings.overlap_between_nodes);
  GapsBetween gaps_between(kinematics, sweep, reach, smallest_between);
  const auto fault_at = [&](Moment& moment, const LinkPairs& least) {
    kinematics.set_position(moment.q);
    moment.gaps = gaps(kinematics, sweep, moment.t);
    if (const PlanFault fault = contact(moment.gaps, least); fault != PlanFault::kNone) return fault;
    if (tool_speed(kinematics, moment.dq) > tool_most) return PlanFault::kToolSpeed;
    if (elbow_speed(model, moment.q, moment.dq) > elbow_most) return PlanFault::kElbowSpeed;
    return PlanFault::kNone;
  };
  const int commands = static_cast<int>(std::ceil(dt * settings.command_rate_hz));
  for (int k = 0; k < plan.intervals; ++k) {
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
    const double half = 0.5 * dt;
    Moment middle{
        node.t + half, node.q + half * node.dq + (0.5 * half * half) * plan.u[k], node.dq + half * plan.u[k], {}};
    Moment next{(k + 1) * dt, plan.x[k + 1].head(n), plan.x[k + 1].tail(n), {}};
    PlanFault fault = fault_at(middle, smallest_between);
    if (fault == PlanFault::kNone) fault = fault_at(next, smallest);
    if (fault == PlanFault::kNone) fault = gaps_between.look(node, middle, plan.u[k]);
    if (fault == PlanFault::kNone) fault = gaps_between.look(middle, next, plan.u[k]);
    if (fault != PlanFault::kNone) return fault;
    node = next;
  }
  return PlanFault::kNone;
}

}  // namespace steadyhand

#include "steadyhand/planning/plan/active_constraint.hpp"

#include <algorithm>
#include <cmath>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/planning/plan/obstacle_sweep.hpp"

namespace steadyhand {

namespace {

/// How near counts as touching: solvers stop a little inside.
constexpr double kGap = 1e-3;           // m, beyond the clearance of bodies, and of the reach
constexpr double kPosition = 2e-3;      // rad (m)
constexpr double kShareOfLimit = 0.99;  // of velocity and acceleration

/// The joint that uses most of its limit, if it uses that much.
ActiveConstraint at_limit(ConstraintKind kind, const JointVector& value, const JointVector& limit) {
  int joint = 0;
  const double most = value.cwiseAbs().cwiseQuotient(limit).maxCoeff(&joint);
  return most >= kShareOfLimit ? ActiveConstraint{kind, joint, -1} : ActiveConstraint{};
}

ActiveConstraint touching_pair(const Kinematics& arm, const Obstacles& obstacles, double clearance) {
  const NearestPair nearest = nearest_pair(arm, obstacles);
  if (nearest.gap < clearance + kGap) return {ConstraintKind::kSelfCollision, nearest.first, nearest.second};
  return {};
}

/// A body and an obstacle that touch at a node.
ActiveConstraint touching_obstacle(const Plan& plan, int nodes, const Obstacles& obstacles, double clearance,
                                   Kinematics& arm) {
  ActiveConstraint found;
  if (obstacles.count == 0) return found;
  ObstacleSweep sweep(arm.model(), obstacles, plan.start);
  for (int k = 1; k <= nodes; ++k) {
    arm.set_position(plan.x[k].head(arm.dof()));
    sweep.pass(arm);
  }
  sweep.find(nodes * plan.dt, clearance + kGap, LinkLengths::Zero(arm.dof() + 1));
  for (int k = 1; k <= nodes && found.kind == ConstraintKind::kNone; ++k) {
    arm.set_position(plan.x[k].head(arm.dof()));
    sweep.for_each_near([&](int body, int obstacle) {
      const Solid part = solid(arm, obstacles, body);
      const Placed there = sweep.placed(obstacle, k * plan.dt);
      if (distance(sweep.shape(obstacle), there, part.shape, part.at) < clearance + kGap) {
        found = {ConstraintKind::kObstacle, body, obstacle};
      }
    });
  }
  return found;
}

ActiveConstraint at_position_limit(const RobotModel& model, const JointVector& q) {
  for (int i = 0; i < q.size(); ++i) {
    if (q[i] < model.position_min[i] + kPosition || q[i] > model.position_max[i] - kPosition) {
      return {ConstraintKind::kPosition, i, -1};
    }
  }
  return {};
}

}  // namespace

ActiveConstraint active_constraint(const Plan& plan, int nodes, const OcpInstance& instance,
                                   std::span<const Reach> reaches, Kinematics& kinematics, const Obstacles& obstacles) {
  const Reference& reference = instance.reference;
  const RobotModel& model = kinematics.model();
  const int n = model.dof(), last = std::min(nodes, plan.intervals);
  for (std::size_t t = 0; t < reaches.size(); ++t) {
    for (int k = 0; k < reference.nodes; ++k) {
      if ((reference.tools[t].p[k] - reaches[t].center).norm() > reaches[t].radius - kGap)
        return {ConstraintKind::kReach, -1, -1};
    }
  }
  ActiveConstraint pair, position, velocity, acceleration;
  for (int k = 1; k <= last; ++k) {
    const JointVector q = plan.x[k].head(n), dq = plan.x[k].tail(n);
    kinematics.set_position(q);
    if (pair.kind == ConstraintKind::kNone) pair = touching_pair(kinematics, obstacles, instance.clearance);
    if (position.kind == ConstraintKind::kNone) position = at_position_limit(model, q);
    if (velocity.kind == ConstraintKind::kNone) velocity = at_limit(ConstraintKind::kVelocity, dq, model.velocity_max);
    if (acceleration.kind == ConstraintKind::kNone) {
      acceleration = at_limit(ConstraintKind::kAcceleration, plan.u[k - 1], model.acceleration_max);
    }
  }
  for (const ActiveConstraint& found :
       {pair, touching_obstacle(plan, last, obstacles, instance.clearance, kinematics), position, velocity}) {
    if (found.kind != ConstraintKind::kNone) return found;
  }
  return acceleration;
}

}  // namespace steadyhand

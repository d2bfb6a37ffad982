#include "steadyhand/planning/plan/level_stop.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace steadyhand {

namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxJoints>;

/// Jacobian of the tool, base frame: linear, then angular. Call set_position before.
Jacobian jacobian(const Kinematics& arm) {
  Jacobian J(6, arm.dof());
  for (int i = 0; i < arm.dof(); ++i) J.col(i) << arm.dp(i), arm.axis(i);
  return J;
}

/// Smallest joint velocities that approximate a twist; damped, because the arm may be stretched out (singular).
JointVector velocities(const Jacobian& J, const Vector6& twist) {
  constexpr double kDamping = 0.02;
  Eigen::Matrix<double, 6, 6> A = J * J.transpose();
  A.diagonal().array() += kDamping * kDamping;
  return J.transpose() * A.llt().solve(twist);
}

}  // namespace

bool make_level_stop(Kinematics& arm, int first, double duration, Plan& plan) {
  const int n = plan.joints, count = std::max(1, static_cast<int>(std::ceil(duration / plan.dt - 1e-9)));
  if (first + count > Plan::kMaxIntervals) return false;
  const double dt = plan.dt;
  arm.set_position(plan.x[first].head(n));
  const JointVector dq0 = plan.x[first].tail(n);
  const Jacobian J = jacobian(arm);
  const Vector6 twist = J * dq0;
  // Tilt of the tool from the vertical as axis times angle; its rate; the rotation about the vertical.
  const Vector3 axis = arm.R().col(2), about = Vector3::UnitZ().cross(axis);
  const double sine = about.norm();
  const Vector3 lean = sine > 1e-9 ? Vector3(std::atan2(sine, axis.z()) / sine * about) : Vector3::Zero();
  Vector3 leaning = twist.tail<3>();
  leaning.z() = 0.0;
  const JointVector rest = dq0 - velocities(J, twist);  // null-space motion: the tool does not move
  for (int k = 0; k < count; ++k) {
    const double s = (k + 1.0) / count, share = k + 1 < count ? (1.0 - s) * (1.0 - s) * (1.0 + 2.0 * s) : 0.0;
    const StateVector& x = plan.x[first + k];
    const JointVector q = x.head(n), dq = x.tail(n);
    JointVector next = dq;
    for (int round = 0; round < 2 && share > 0.0; ++round) {
      arm.set_position(q + 0.5 * dt * (dq + next));
      Vector6 now = share * twist;  // the tilt goes from its angle and rate to zero
      now.segment<2>(3) = ((s * s - s) * 6.0 / (count * dt) * lean + (1.0 - 4.0 * s + 3.0 * s * s) * leaning).head<2>();
      next = velocities(jacobian(arm), now) + share * rest;
    }
    if (share == 0.0) next.setZero();
    plan.u[first + k] = (next - dq) / dt;
    StateVector& to = plan.x[first + k + 1];
    to.resize(2 * n);
    to << q + 0.5 * dt * (dq + next), next;
  }
  plan.intervals = first + count;
  return true;
}

}  // namespace steadyhand

#include "steadyhand/planning/plan/level_stop.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace steadyhand {

namespace {

constexpr int kMaxRows = 6 * kMaxTools;
/// Of each tool in the base frame: linear, then angular velocity.
using Twists = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxRows, 1>;
using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxJoints>;

/// Jacobian of the tools. Call set_position before.
Jacobian jacobian(const Kinematics& arm) {
  Jacobian J = Jacobian::Zero(6 * arm.tool_count(), arm.dof());
  for (int t = 0; t < arm.tool_count(); ++t) {
    for (const int i : arm.chain(t)) J.col(i).segment<6>(6 * t) << arm.dp(i, t), arm.axis(i);
  }
  return J;
}

/// Smallest joint velocities that approximate twists; damped, because an arm may be stretched out (singular).
JointVector velocities(const Jacobian& J, const Twists& twist) {
  constexpr double kDamping = 0.02;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxRows> A = J * J.transpose();
  A.diagonal().array() += kDamping * kDamping;
  return J.transpose() * A.llt().solve(twist);
}

/// Twists that these joints cause, whose columns are 0 from then on.
Twists moved_by(JointSet joints, const JointVector& dq, Jacobian& J) {
  Twists twist = Twists::Zero(J.rows());
  for (int j = 0; j < J.cols(); ++j) {
    if (!joints[j]) continue;
    twist += dq[j] * J.col(j);
    J.col(j).setZero();
  }
  return twist;
}

}  // namespace

bool make_level_stop(Kinematics& arm, int first, double duration, JointSet given, Plan& plan) {
  const int n = plan.joints, count = std::max(1, static_cast<int>(std::ceil(duration / plan.dt - 1e-9)));
  if (first + count > Plan::kMaxIntervals) return false;
  const double dt = plan.dt;
  arm.set_position(plan.x[first].head(n));
  const JointVector dq0 = plan.x[first].tail(n);
  Jacobian J = jacobian(arm);
  const Twists twist = J * dq0;
  const Twists by_others = twist - moved_by(given, dq0, J);
  std::array<Eigen::Vector2d, kMaxTools> leans;  // tilt of each tool from the vertical as axis times angle
  for (int t = 0; t < arm.tool_count(); ++t) {
    const Vector3 axis = arm.R(t).col(2), about = Vector3::UnitZ().cross(axis);
    const double sine = about.norm();
    leans[t] =
        sine > 1e-9 ? Eigen::Vector2d(std::atan2(sine, axis.z()) / sine * about.head<2>()) : Eigen::Vector2d::Zero();
  }
  const JointVector rest = dq0 - velocities(J, by_others);  // null-space motion: the tools do not move
  for (int k = 0; k < count; ++k) {
    const double s = (k + 1.0) / count, share = k + 1 < count ? (1.0 - s) * (1.0 - s) * (1.0 + 2.0 * s) : 0.0;
    const StateVector& x = plan.x[first + k];
    const JointVector q = x.head(n), dq = x.tail(n);
    JointVector next = dq;
    for (int j = 0; j < n; ++j) {
      const double step = given[j] ? dt * std::abs(plan.u[0][j]) : 0.0;
      next[j] -= std::clamp(dq[j], -step, step);
    }
    const JointVector braked = next;
    for (int round = 0; round < 2 && share > 0.0; ++round) {
      arm.set_position(q + 0.5 * dt * (dq + next));
      Twists now = share * twist;  // the tilt goes from its angle and rate to zero
      for (int t = 0; t < arm.tool_count(); ++t) {
        const int tilt = 6 * t + 3;
        now.segment<2>(tilt) =
            (s * s - s) * 6.0 / (count * dt) * leans[t] + (1.0 - 4.0 * s + 3.0 * s * s) * twist.segment<2>(tilt);
      }
      Jacobian J_now = jacobian(arm);
      now -= moved_by(given, braked, J_now);
      next = velocities(J_now, now) + share * rest;
      for (int j = 0; j < n; ++j)
        if (given[j]) next[j] = braked[j];
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

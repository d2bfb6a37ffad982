#pragma once

#include <string_view>

#include "ocp/term.hpp"

namespace steadyhand {

/// Gradient of r' diag(weight) r by z, r = a_local - g: 2 J' force with force = diag(weight) r.
inline void add_local_acceleration_gradient(const Kinematics& arm, const Vector3& force, NodeGradient& gradient) {
  const int n = arm.dof();
  for (int i = 0; i < n; ++i) {
    gradient[i] += 2.0 * force.dot(arm.dy_dq(i));
    gradient[n + i] += 2.0 * force.dot(arm.dy_dv(i));
    gradient[2 * n + i] += 2.0 * force.dot(arm.dy_ddq(i));
  }
}

/// The part 2 J' diag(weight) J of the Hessian of r' diag(weight) r by z.
inline void add_local_acceleration_gauss_newton(const Kinematics& arm, const Vector3& weight, NodeHessian& hessian) {
  const int n = arm.dof();
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 3 * kMaxJoints> J(3, 3 * n);
  for (int i = 0; i < n; ++i) {
    J.col(i) = arm.dy_dq(i);
    J.col(n + i) = arm.dy_dv(i);
    J.col(2 * n + i) = arm.dy_ddq(i);
  }
  hessian.noalias() += J.transpose().lazyProduct((2.0 * weight).asDiagonal() * J);
}

/// All of it: 2 J' diag(weight) J + 2 sum_m weight_m r_m d2 a_m.
inline void add_local_acceleration_hessian(const Kinematics& arm, const Vector3& weight, const Vector3& residual,
                                           NodeHessian& hessian) {
  add_local_acceleration_gauss_newton(arm, weight, hessian);
  arm.add_local_acceleration_hessian(2.0 * weight.cwiseProduct(residual), hessian);
}

/// w r' diag(axes) r, r = a_local - g: how far what the liquid feels is from rest, along some axes of the glass.
class LiquidObjective : public Objective {
 public:
  std::string_view name() const final { return name_; }
  Nodes nodes() const final { return Nodes::kIntervals; }
  int weight_count(int /*dof*/) const final { return 1; }

  double value(const Node& node, const JointVector& weight) const final {
    return weight[0] * residual(node).squaredNorm();
  }

  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const final {
    add_local_acceleration_gradient(node.arm, weight[0] * residual(node), gradient);
  }

  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const final {
    add_local_acceleration_hessian(node.arm, weight[0] * axes_, residual(node), hessian);
  }

  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const final {
    add_local_acceleration_gauss_newton(node.arm, weight[0] * axes_, hessian);
  }

 protected:
  /// @param axes 1 for those that count, 0 for the others
  LiquidObjective(std::string_view name, const Vector3& axes) : name_(name), axes_(axes) {}

 private:
  Vector3 residual(const Node& node) const { return axes_.cwiseProduct(node.arm.local_acceleration() - kGravity); }

  std::string_view name_;
  Vector3 axes_;
};

}  // namespace steadyhand

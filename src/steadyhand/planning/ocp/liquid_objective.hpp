#pragma once

#include <array>

#include "steadyhand/planning/ocp/term.hpp"

namespace steadyhand {

/// w |r|^2 with r = a_local - g along some axes of the glass: how far the specific force on the liquid is from that at
/// rest.
template <int... axes>
class LiquidObjective : public ObjectiveFor<LiquidObjective<axes...>> {
 public:
  Nodes nodes() const final { return Nodes::kIntervals; }
  int weight_count(int /*dof*/) const final { return 1; }
  bool quadratic_in_input() const final { return true; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    return weight[0] * residual(node).squaredNorm();
  }

  /// 2 w J' r
  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const int n = node.arm.dof();
    const Vector3Of<S> force = 2.0 * weight[0] * residual(node);
    const auto along = [&](const Vector3Of<S>& dy) { return (S(0.0) + ... + S(force[axes] * dy[axes])); };
    for (int i = 0; i < n; ++i) {
      gradient[i] += along(node.arm.dy_dq(i));
      gradient[n + i] += along(node.arm.dy_dv(i));
      gradient[2 * n + i] += along(node.arm.dy_ddq(i));
    }
  }

  /// 2 w (J' J + sum r_m d2 a_m)
  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    convex_hessian_at(node, weight, hessian);
    node.arm.add_local_acceleration_hessian(2.0 * weight[0] * residual(node), hessian);
  }

  /// 2 w J' J
  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const int n = node.arm.dof();
    std::array<const Vector3Of<S>*, 3 * kMaxJoints> J;
    for (int i = 0; i < n; ++i) {
      J[i] = &node.arm.dy_dq(i);
      J[n + i] = &node.arm.dy_dv(i);
      J[2 * n + i] = &node.arm.dy_ddq(i);
    }
    for (int j = 0; j < 3 * n; ++j) {
      const Vector3Of<S> weighted = (2.0 * weight[0]) * *J[j];
      for (int i = 0; i <= j; ++i) hessian(i, j) += (S(0.0) + ... + S(weighted[axes] * (*J[i])[axes]));
    }
  }

 protected:
  using ObjectiveFor<LiquidObjective<axes...>>::ObjectiveFor;

 private:
  template <typename S>
  static Vector3Of<S> residual(const NodeOf<S>& node) {
    Vector3Of<S> result = Vector3Of<S>::Zero();
    ((result[axes] = node.arm.local_acceleration()[axes] - kGravity[axes]), ...);
    return result;
  }
};

}  // namespace steadyhand

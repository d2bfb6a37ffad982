#pragma once

#include <array>
#include <utility>

#include "steadyhand/planning/ocp/term.hpp"

namespace steadyhand {

/// w |r|^2 with r = a_local - g along some axes of the glass: how far the specific force on the liquid is from that at
/// rest.
template <int... axes>
class LiquidObjective : public ObjectiveFor<LiquidObjective<axes...>> {
 public:
  Nodes nodes() const final { return Nodes::kIntervals; }
  bool quadratic_in_input() const final { return true; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    S sum(0.0);
    for (int t = 0; t < node.arm.tool_count(); ++t) sum += weight[t] * residual(node, t).squaredNorm();
    return sum;
  }

  /// 2 w J' r
  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const int n = node.arm.dof();
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      const Vector3Of<S> force = 2.0 * weight[t] * residual(node, t);
      const auto along = [&](const Vector3Of<S>& dy) { return (S(0.0) + ... + S(force[axes] * dy[axes])); };
      for (const int i : node.arm.chain(t)) {
        gradient[i] += along(node.arm.dy_dq(i, t));
        gradient[n + i] += along(node.arm.dy_dv(i, t));
        gradient[2 * n + i] += along(node.arm.dy_ddq(i, t));
      }
    }
  }

  /// 2 w (J' J + sum r_m d2 a_m)
  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    convex_hessian_at(node, weight, hessian);
    for (int t = 0; t < node.arm.tool_count(); ++t)
      node.arm.add_local_acceleration_hessian(2.0 * weight[t] * residual(node, t), hessian, t);
  }

  /// 2 w J' J
  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const int n = node.arm.dof();
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      std::array<std::pair<int, const Vector3Of<S>*>, 3 * kMaxJoints> J;  // entries of z, in their order
      auto end = J.begin();
      for (const int i : node.arm.chain(t)) *end++ = {i, &node.arm.dy_dq(i, t)};
      for (const int i : node.arm.chain(t)) *end++ = {n + i, &node.arm.dy_dv(i, t)};
      for (const int i : node.arm.chain(t)) *end++ = {2 * n + i, &node.arm.dy_ddq(i, t)};
      for (auto b = J.begin(); b != end; ++b) {
        const Vector3Of<S> weighted = (2.0 * weight[t]) * *b->second;
        for (auto a = J.begin(); a <= b; ++a)
          hessian(a->first, b->first) += (S(0.0) + ... + S(weighted[axes] * (*a->second)[axes]));
      }
    }
  }

 protected:
  using ObjectiveFor<LiquidObjective<axes...>>::ObjectiveFor;

 private:
  template <typename S>
  static Vector3Of<S> residual(const NodeOf<S>& node, int tool) {
    Vector3Of<S> result = Vector3Of<S>::Zero();
    ((result[axes] = node.arm.local_acceleration(tool)[axes] - kGravity[axes]), ...);
    return result;
  }
};

}  // namespace steadyhand

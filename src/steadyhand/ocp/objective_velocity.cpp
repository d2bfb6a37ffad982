#include "steadyhand/ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Velocity final : public ObjectiveFor<Velocity> {
 public:
  std::string_view name() const override { return "velocity"; }
  Nodes nodes() const override { return Nodes::kStates; }
  int weight_count(int dof) const override { return dof; }
  bool needs_motion() const override { return false; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    return node.dq.cwiseProduct(node.dq).dot(weight);
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const int n = node.arm.dof();
    for (int i = 0; i < n; ++i) gradient[n + i] += 2.0 * weight[i] * node.dq[i];
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const int n = node.arm.dof();
    for (int i = 0; i < n; ++i) hessian(n + i, n + i) += 2.0 * weight[i];
  }

  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    hessian_at(node, weight, hessian);
  }
};

}  // namespace

std::unique_ptr<Objective> make_velocity_objective() { return std::make_unique<Velocity>(); }

}  // namespace steadyhand

#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Velocity final : public ObjectiveFor<Velocity> {
 public:
  Velocity()
      : ObjectiveFor({.name = "velocity",
                      .label = "Joint speed",
                      .unit = "s/rad^2",
                      .weights = {1, WeightCount::Of::kJoint},
                      .range = {1e-3, 100.0, true},
                      .offered = false,
                      .at_rest_min = kAtRest,
                      .at_rest_max = kAtRest}) {}
  Nodes nodes() const override { return Nodes::kStates; }
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

 private:
  static constexpr double kAtRest = 40.0;  ///< slows the arm while it stops
};

}  // namespace

std::shared_ptr<const Objective> make_velocity_objective() { return std::make_shared<Velocity>(); }

}  // namespace steadyhand

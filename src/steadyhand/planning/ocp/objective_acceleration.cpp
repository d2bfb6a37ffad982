#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Acceleration final : public ObjectiveFor<Acceleration> {
 public:
  Acceleration()
      : ObjectiveFor({.name = "acceleration",
                      .label = "Joint acceleration",
                      .unit = "s^3/rad^2",
                      .weights = {1, WeightCount::Of::kJoint},
                      .range = {1e-4, 10.0, true},
                      .offered = false}) {}
  Nodes nodes() const override { return Nodes::kIntervals; }
  bool needs_motion() const override { return false; }
  bool quadratic_in_input() const override { return true; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    return node.u.cwiseProduct(node.u).dot(weight);
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const int n = node.arm.dof();
    for (int i = 0; i < n; ++i) gradient[2 * n + i] += 2.0 * weight[i] * node.u[i];
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const int n = node.arm.dof();
    for (int i = 0; i < n; ++i) hessian(2 * n + i, 2 * n + i) += 2.0 * weight[i];
  }

  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    hessian_at(node, weight, hessian);
  }
};

}  // namespace

std::shared_ptr<const Objective> make_acceleration_objective() { return std::make_shared<Acceleration>(); }

}  // namespace steadyhand

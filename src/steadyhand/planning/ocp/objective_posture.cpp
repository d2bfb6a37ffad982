#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// Towards the robot's home: sets the free motion of an arm with more joints than the task needs.
class Posture final : public ObjectiveFor<Posture> {
 public:
  Posture()
      : ObjectiveFor({.name = "posture",
                      .label = "Posture",
                      .unit = "1/(rad^2 s)",
                      .weights = {1, WeightCount::Of::kJoint},
                      .range = {1e-3, 100.0, true},
                      .at_rest_max = 0.0}) {}
  Nodes nodes() const override { return Nodes::kStates; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    S sum(0.0);
    for (int i = 0; i < node.arm.dof(); ++i) sum += weight[i] * off<S>(node, i) * off<S>(node, i);
    return sum;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    for (int i = 0; i < node.arm.dof(); ++i) gradient[i] += 2.0 * weight[i] * off<S>(node, i);
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    for (int i = 0; i < node.arm.dof(); ++i) hessian(i, i) += 2.0 * weight[i];
  }

  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    hessian_at(node, weight, hessian);
  }

 private:
  template <typename S>
  static S off(const NodeOf<S>& node, int joint) {
    return node.arm.q()[joint] - node.arm.model().home[joint];
  }
};

}  // namespace

std::shared_ptr<const Objective> make_posture_objective() { return std::make_shared<Posture>(); }

}  // namespace steadyhand

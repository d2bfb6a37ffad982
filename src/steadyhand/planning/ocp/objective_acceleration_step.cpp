#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// The step from the arm's present acceleration to the first one of the plan: a jolt for the drives. The arm follows
/// each plan from its first interval, so in closed loop every step that the arm makes is part of the cost.
class AccelerationStep final : public ObjectiveFor<AccelerationStep> {
 public:
  AccelerationStep()
      : ObjectiveFor({.name = "acceleration_step",
                      .label = "Step of the acceleration",
                      .unit = "s^3/rad^2",
                      .weights = {1, WeightCount::Of::kJoint},
                      .range = {1e-4, 10.0, true},
                      .offered = false}) {}
  Nodes nodes() const override { return Nodes::kIntervals; }
  bool needs_motion() const override { return false; }
  bool quadratic_in_input() const override { return true; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    S sum(0.0);
    for (int i = 0; i < node.arm.dof(); ++i) sum += weight[i] * step<S>(node, i) * step<S>(node, i);
    return first(node) * sum;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const int n = node.arm.dof();
    for (int i = 0; i < n; ++i) gradient[2 * n + i] += 2.0 * first(node) * weight[i] * step<S>(node, i);
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const int n = node.arm.dof();
    for (int i = 0; i < n; ++i) hessian(2 * n + i, 2 * n + i) += 2.0 * first(node) * weight[i];
  }

  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    hessian_at(node, weight, hessian);
  }

 private:
  /// 1 at node 0, else 0.
  template <typename S>
  static S first(const NodeOf<S>& node) {
    return select(node.time > S(0.0), S(0.0), S(1.0));
  }
  template <typename S>
  static S step(const NodeOf<S>& node, int joint) {
    const bool known = node.u_followed != nullptr && node.u_followed->size() > 0;
    return node.u[joint] - (known ? (*node.u_followed)[joint] : 0.0);
  }
};

}  // namespace

std::shared_ptr<const Objective> make_acceleration_step_objective() { return std::make_shared<AccelerationStep>(); }

}  // namespace steadyhand

#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Position final : public ObjectiveFor<Position> {
 public:
  Position()
      : ObjectiveFor({.name = "position",
                      .label = "Position",
                      .unit = "1/(m^2 s)",
                      .range = {1.0, 1e4, true},
                      .offered = false,
                      .at_rest_max = 0.0}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  int weight_count(int /*dof*/) const override { return 3; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    const Vector3Of<S> error = node.arm.p() - node.p_ref;
    return error.cwiseProduct(error).dot(weight);
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const Vector3Of<S> force = twice_weighted<S>(node.arm.p() - node.p_ref, weight);
    for (int i = 0; i < node.arm.dof(); ++i) gradient[i] += force.dot(node.arm.dp(i));
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const auto& arm = node.arm;
    const Vector3Of<S> force = twice_weighted<S>(arm.p() - node.p_ref, weight);
    convex_hessian_at(node, weight, hessian);
    for (int i = 0; i < arm.dof(); ++i) {
      const Vector3Of<S> turned = force.cross(arm.axis(i));  // force . (z_i x dp_j) = (force x z_i) . dp_j
      for (int j = i; j < arm.dof(); ++j) hessian(i, j) += turned.dot(arm.dp(j));
    }
  }

  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    for (int j = 0; j < node.arm.dof(); ++j) {
      const Vector3Of<S> weighted = twice_weighted<S>(node.arm.dp(j), weight);
      for (int i = 0; i <= j; ++i) hessian(i, j) += weighted.dot(node.arm.dp(i));
    }
  }

 private:
  template <typename S>
  static Vector3Of<S> twice_weighted(const Vector3Of<S>& v, const JointVectorOf<S>& weight) {
    return (2.0 * v).cwiseProduct(weight);
  }
};

}  // namespace

std::shared_ptr<const Objective> make_position_objective() { return std::make_shared<Position>(); }

}  // namespace steadyhand

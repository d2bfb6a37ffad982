#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Position final : public ObjectiveFor<Position> {
 public:
  Position()
      : ObjectiveFor({.name = "position",
                      .label = "Position",
                      .unit = "1/(m^2 s)",
                      .weights = {3, WeightCount::Of::kTool},
                      .range = {1.0, 1e4, true},
                      .offered = false,
                      .at_rest_max = 0.0}) {}
  Nodes nodes() const override { return Nodes::kStates; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    S sum(0.0);
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      const Vector3Of<S> e = error(node, t);
      sum += e.cwiseProduct(e).dot(weight.template segment<3>(3 * t));
    }
    return sum;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      const Vector3Of<S> force = twice_weighted<S>(error(node, t), weight, t);
      for (const int i : node.arm.chain(t)) gradient[i] += force.dot(node.arm.dp(i, t));
    }
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const auto& arm = node.arm;
    convex_hessian_at(node, weight, hessian);
    for (int t = 0; t < arm.tool_count(); ++t) {
      const Vector3Of<S> force = twice_weighted<S>(error(node, t), weight, t);
      for (const int j : arm.chain(t)) {
        const Vector3Of<S> turned = arm.dp(j, t).cross(force);  // force . (z_i x dp_j) = (dp_j x force) . z_i
        for (const int i : arm.chain(t)) {
          if (i > j) break;
          hessian(i, j) += turned.dot(arm.axis(i));
        }
      }
    }
  }

  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      for (const int j : node.arm.chain(t)) {
        const Vector3Of<S> weighted = twice_weighted<S>(node.arm.dp(j, t), weight, t);
        for (const int i : node.arm.chain(t)) {
          if (i > j) break;
          hessian(i, j) += weighted.dot(node.arm.dp(i, t));
        }
      }
    }
  }

 private:
  template <typename S>
  static Vector3Of<S> error(const NodeOf<S>& node, int tool) {
    return node.arm.p(tool) - node.reference[tool].p;
  }
  template <typename S>
  static Vector3Of<S> twice_weighted(const Vector3Of<S>& v, const JointVectorOf<S>& weight, int tool) {
    return (2.0 * v).cwiseProduct(weight.template segment<3>(3 * tool));
  }
};

}  // namespace

std::shared_ptr<const Objective> make_position_objective() { return std::make_shared<Position>(); }

}  // namespace steadyhand

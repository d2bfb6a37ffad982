#include "ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Position final : public Objective {
 public:
  std::string_view name() const override { return "position"; }
  Nodes nodes() const override { return Nodes::kStates; }
  int weight_count(int /*dof*/) const override { return 3; }

  double value(const Node& node, const JointVector& weight) const override {
    const Vector3 error = node.arm.p() - node.p_ref;
    return error.cwiseAbs2().dot(weight);
  }

  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    const Vector3 force = 2.0 * (node.arm.p() - node.p_ref).cwiseProduct(weight);
    for (int i = 0; i < node.arm.dof(); ++i) gradient[i] += force.dot(node.arm.dp(i));
  }

  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    const Kinematics& arm = node.arm;
    const Vector3 force = 2.0 * (arm.p() - node.p_ref).cwiseProduct(weight);
    for (int j = 0; j < arm.dof(); ++j) {
      const Vector3 weighted = 2.0 * arm.dp(j).cwiseProduct(weight);
      for (int i = 0; i < arm.dof(); ++i) hessian(i, j) += weighted.dot(arm.dp(i)) + force.dot(arm.ddp(i, j));
    }
  }

  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    const Kinematics& arm = node.arm;
    for (int j = 0; j < arm.dof(); ++j) {
      const Vector3 weighted = 2.0 * arm.dp(j).cwiseProduct(weight);
      for (int i = 0; i < arm.dof(); ++i) hessian(i, j) += weighted.dot(arm.dp(i));
    }
  }
};

}  // namespace

std::unique_ptr<Objective> make_position_objective() { return std::make_unique<Position>(); }

}  // namespace steadyhand

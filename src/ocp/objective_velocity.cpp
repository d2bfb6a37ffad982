#include "ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Velocity final : public Objective {
 public:
  std::string_view name() const override { return "velocity"; }
  Nodes nodes() const override { return Nodes::kStates; }
  int weight_count(int dof) const override { return dof; }

  double value(const Node& node, const JointVector& weight) const override { return node.dq.cwiseAbs2().dot(weight); }

  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    const int n = node.arm.dof();
    gradient.segment(n, n) += 2.0 * weight.cwiseProduct(node.dq);
  }

  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    const int n = node.arm.dof();
    hessian.diagonal().segment(n, n) += 2.0 * weight;
  }

  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    add_hessian(node, weight, hessian);
  }
};

}  // namespace

std::unique_ptr<Objective> make_velocity_objective() { return std::make_unique<Velocity>(); }

}  // namespace steadyhand

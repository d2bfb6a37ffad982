#include "ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Acceleration final : public Objective {
 public:
  std::string_view name() const override { return "acceleration"; }
  Nodes nodes() const override { return Nodes::kIntervals; }
  int weight_count(int dof) const override { return dof; }

  double value(const Node& node, const JointVector& weight) const override { return node.u.cwiseAbs2().dot(weight); }

  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    gradient.tail(node.arm.dof()) += 2.0 * weight.cwiseProduct(node.u);
  }

  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    hessian.diagonal().tail(node.arm.dof()) += 2.0 * weight;
  }

  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    add_hessian(node, weight, hessian);
  }
};

}  // namespace

std::unique_ptr<Objective> make_acceleration_objective() { return std::make_unique<Acceleration>(); }

}  // namespace steadyhand

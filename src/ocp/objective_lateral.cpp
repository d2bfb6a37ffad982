#include "ocp/liquid.hpp"
#include "ocp/objectives.hpp"

namespace steadyhand {
namespace {

class Lateral final : public Objective {
 public:
  std::string_view name() const override { return "lateral"; }
  Nodes nodes() const override { return Nodes::kIntervals; }
  int weight_count(int /*dof*/) const override { return 1; }

  double value(const Node& node, const JointVector& weight) const override {
    return weight[0] * residual(node).squaredNorm();
  }

  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    add_local_acceleration_gradient(node.arm, weight[0] * residual(node), gradient);
  }

  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    add_local_acceleration_hessian(node.arm, weight[0] * Vector3(1.0, 1.0, 0.0), residual(node), hessian);
  }

  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    add_local_acceleration_gauss_newton(node.arm, weight[0] * Vector3(1.0, 1.0, 0.0), hessian);
  }

 private:
  static Vector3 residual(const Node& node) {
    const Vector3& a = node.arm.local_acceleration();
    return {a.x(), a.y(), 0.0};
  }
};

}  // namespace

std::unique_ptr<Objective> make_lateral_objective() { return std::make_unique<Lateral>(); }

}  // namespace steadyhand

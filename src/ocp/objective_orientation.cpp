#include "ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// With M = R R_ref' the cost is w (6 - 2 tr M), and turning joint i changes M by [z_i]x M:
///   tr([a]x M) = -a . axial(M),   tr([a]x [b]x M) = a' M b - (a . b) tr M.
class Orientation final : public Objective {
 public:
  std::string_view name() const override { return "orientation"; }
  Nodes nodes() const override { return Nodes::kStates; }
  int weight_count(int /*dof*/) const override { return 1; }

  double value(const Node& node, const JointVector& weight) const override {
    return weight[0] * (node.arm.R() - node.R_ref).squaredNorm();  // = ||I - M||_F^2, without its cancellation
  }

  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    const Matrix3 M = node.arm.R() * node.R_ref.transpose();
    const Vector3 axial(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
    for (int i = 0; i < node.arm.dof(); ++i) gradient[i] += 2.0 * weight[0] * axial.dot(node.arm.axis(i));
  }

  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    const Kinematics& arm = node.arm;
    const Matrix3 M = arm.R() * node.R_ref.transpose();
    for (int j = 0; j < arm.dof(); ++j) {
      for (int i = 0; i <= j; ++i) {  // joint i stands before joint j: d2M = [z_i]x [z_j]x M
        const double trace = arm.axis(i).dot(M * arm.axis(j)) - arm.axis(i).dot(arm.axis(j)) * M.trace();
        hessian(i, j) -= 2.0 * weight[0] * trace;
        if (i != j) hessian(j, i) -= 2.0 * weight[0] * trace;
      }
    }
  }

  /// Gauss-Newton on the nine entries of R - R_ref: <[z_i]x R, [z_j]x R> = 2 z_i . z_j.
  void add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    const Kinematics& arm = node.arm;
    for (int j = 0; j < arm.dof(); ++j) {
      for (int i = 0; i < arm.dof(); ++i) hessian(i, j) += 4.0 * weight[0] * arm.axis(i).dot(arm.axis(j));
    }
  }
};

}  // namespace

std::unique_ptr<Objective> make_orientation_objective() { return std::make_unique<Orientation>(); }

}  // namespace steadyhand

#include "steadyhand/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// With M = R R_ref' the cost is w (6 - 2 tr M), and turning joint i changes M by [z_i]x M:
///   tr([a]x M) = -a . axial(M),   tr([a]x [b]x M) = a' M b - (a . b) tr M.
class Orientation final : public ObjectiveFor<Orientation> {
 public:
  Orientation()
      : ObjectiveFor({.name = "orientation",
                      .label = "Orientation",
                      .unit = "1/s",
                      .range = {0.1, 1e3, true},
                      .offered = false,
                      .at_rest_min = kAtRest,
                      .at_rest_max = kAtRest}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  int weight_count(int /*dof*/) const override { return 1; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    const Matrix3Of<S> error = node.arm.R() - node.R_ref;  // ||error||_F = ||I - M||_F, without its cancellation
    return weight[0] * error.cwiseProduct(error).sum();
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const Matrix3Of<S> M = node.arm.R() * node.R_ref.transpose();
    const Vector3Of<S> axial(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
    const Vector3Of<S> torque = (2.0 * weight[0]) * axial;
    for (int i = 0; i < node.arm.dof(); ++i) gradient[i] += torque.dot(node.arm.axis(i));
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const Matrix3Of<S> M = node.arm.R() * node.R_ref.transpose();
    Matrix3Of<S> second = M;
    second.diagonal() -= Vector3Of<S>::Constant(M.trace());
    for (int j = 0; j < node.arm.dof(); ++j) {
      const Vector3Of<S> turned = (-2.0 * weight[0]) * (second * node.arm.axis(j));
      // Joint i stands before joint j: d2M = [z_i]x [z_j]x M.
      for (int i = 0; i <= j; ++i) hessian(i, j) += node.arm.axis(i).dot(turned);
    }
  }

  /// Gauss-Newton on the nine entries of R - R_ref: <[z_i]x R, [z_j]x R> = 2 z_i . z_j.
  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    for (int j = 0; j < node.arm.dof(); ++j) {
      for (int i = 0; i <= j; ++i) hessian(i, j) += 4.0 * weight[0] * node.arm.axis(i).dot(node.arm.axis(j));
    }
  }

 private:
  static constexpr double kAtRest = 50.0;  ///< rights the glass as the arm comes to rest
};

}  // namespace

std::shared_ptr<const Objective> make_orientation_objective() { return std::make_shared<Orientation>(); }

}  // namespace steadyhand

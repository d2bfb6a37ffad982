#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {
namespace {

/// The cost is sum_c w_c ||r_c - t_c||^2 over the tool's axes r_c, the columns of R, and the reference's, t_c. With
/// W = diag(w) and M = R W R_ref' that is 2 tr W - 2 tr M, and turning joint i changes M by [z_i]x M:
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
  int weight_count(int /*dof*/) const override { return 3; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    const Matrix3Of<S> error = node.arm.R() - node.R_ref;  // without the cancellation of 2 tr W - 2 tr M
    S sum(0.0);
    for (int c = 0; c < 3; ++c) sum += weight[c] * error.col(c).dot(error.col(c));
    return sum;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    const Matrix3Of<S> M = weighted<S>(node.arm.R(), weight) * node.R_ref.transpose();
    const Vector3Of<S> torque = 2.0 * Vector3Of<S>(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
    for (int i = 0; i < node.arm.dof(); ++i) gradient[i] += torque.dot(node.arm.axis(i));
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    Matrix3Of<S> second = weighted<S>(node.arm.R(), weight) * node.R_ref.transpose();  // M
    second.diagonal() -= Vector3Of<S>::Constant(second.trace());
    for (int j = 0; j < node.arm.dof(); ++j) {
      const Vector3Of<S> turned = -2.0 * (second * node.arm.axis(j));
      // Joint i is before joint j: d2M = [z_i]x [z_j]x M.
      for (int i = 0; i <= j; ++i) hessian(i, j) += node.arm.axis(i).dot(turned);
    }
  }

  /// Gauss-Newton on the columns of R - R_ref: sum_c w_c (z_i x r_c) . (z_j x r_c) = z_i' (tr W I - R W R') z_j.
  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    const Matrix3Of<S> outer = weighted<S>(node.arm.R(), weight) * node.arm.R().transpose();
    const S trace = weight[0] + weight[1] + weight[2];
    for (int j = 0; j < node.arm.dof(); ++j) {
      const Vector3Of<S> turned = 2.0 * (trace * node.arm.axis(j) - outer * node.arm.axis(j));
      for (int i = 0; i <= j; ++i) hessian(i, j) += node.arm.axis(i).dot(turned);
    }
  }

 private:
  template <typename S>
  static Matrix3Of<S> weighted(const Matrix3Of<S>& R, const JointVectorOf<S>& weight) {
    Matrix3Of<S> result = R;
    for (int c = 0; c < 3; ++c) result.col(c) *= weight[c];
    return result;
  }

  static constexpr double kAtRest = 50.0;  ///< turns the glass upright while the arm stops
};

}  // namespace

std::shared_ptr<const Objective> make_orientation_objective() { return std::make_shared<Orientation>(); }

}  // namespace steadyhand

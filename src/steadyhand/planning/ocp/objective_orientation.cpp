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
                      .weights = {3, WeightCount::Of::kTool},
                      .range = {0.1, 1e3, true},
                      .offered = false,
                      .at_rest_min = kAtRest,
                      .at_rest_max = kAtRest}) {}
  Nodes nodes() const override { return Nodes::kStates; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    S sum(0.0);
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      const Matrix3Of<S> error = node.arm.R(t) - node.reference[t].R;  // without the cancellation of 2 tr W - 2 tr M
      for (int c = 0; c < 3; ++c) sum += weight[3 * t + c] * error.col(c).dot(error.col(c));
    }
    return sum;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      const Matrix3Of<S> M = weighted<S>(node.arm.R(t), weight, t) * node.reference[t].R.transpose();
      const Vector3Of<S> torque = 2.0 * Vector3Of<S>(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
      for (const int i : node.arm.chain(t)) gradient[i] += torque.dot(node.arm.axis(i));
    }
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      Matrix3Of<S> second = weighted<S>(node.arm.R(t), weight, t) * node.reference[t].R.transpose();  // M
      second.diagonal() -= Vector3Of<S>::Constant(second.trace());
      // Joint i is before joint j: d2M = [z_i]x [z_j]x M.
      add_along_axes<S>(node, t, [&](const Vector3Of<S>& z) { return Vector3Of<S>(-2.0 * (second * z)); }, hessian);
    }
  }

  /// Gauss-Newton on the columns of R - R_ref: sum_c w_c (z_i x r_c) . (z_j x r_c) = z_i' (tr W I - R W R') z_j.
  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      const Matrix3Of<S> outer = weighted<S>(node.arm.R(t), weight, t) * node.arm.R(t).transpose();
      const S trace = weight[3 * t] + weight[3 * t + 1] + weight[3 * t + 2];
      add_along_axes<S>(
          node, t, [&](const Vector3Of<S>& z) { return Vector3Of<S>(2.0 * (trace * z - outer * z)); }, hessian);
    }
  }

 private:
  template <typename S>
  static Matrix3Of<S> weighted(const Matrix3Of<S>& R, const JointVectorOf<S>& weight, int tool) {
    Matrix3Of<S> result = R;
    for (int c = 0; c < 3; ++c) result.col(c) *= weight[3 * tool + c];
    return result;
  }
  /// hessian(i, j) += z_i . product(z_j) over the tool's joints.
  template <typename S, typename F>
  static void add_along_axes(const NodeOf<S>& node, int tool, const F& product, NodeHessianOf<S>& hessian) {
    for (const int j : node.arm.chain(tool)) {
      const Vector3Of<S> turned = product(node.arm.axis(j));
      for (const int i : node.arm.chain(tool)) {
        if (i > j) break;
        hessian(i, j) += node.arm.axis(i).dot(turned);
      }
    }
  }

  static constexpr double kAtRest = 50.0;  ///< turns the glass upright while the arm stops
};

}  // namespace

std::shared_ptr<const Objective> make_orientation_objective() { return std::make_shared<Orientation>(); }

}  // namespace steadyhand

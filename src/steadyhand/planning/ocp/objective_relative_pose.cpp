#include <algorithm>
#include <array>
#include <span>

#include "steadyhand/planning/ocp/objectives.hpp"
#include "steadyhand/planning/ocp/relative_motion.hpp"

namespace steadyhand {
namespace {

/// w_p |p_1 - p|^2 + w_R ||R_1 - R||_F^2, with p and R where the second tool would be, fixed to the first as
/// OcpInstance::held says: both hold one thing. Only joints on the way from one tool to the other change it; with their
/// signs they move the second like a serial arm whose base is the first. 0 for a robot with one tool.
class RelativePose final : public ObjectiveFor<RelativePose> {
 public:
  RelativePose()
      : ObjectiveFor({.name = "relative_pose",
                      .label = "Relative pose of the tools",
                      .unit = "1/(m^2 s), 1/s",
                      .weights = {2},
                      .range = {1.0, 1e6, true},
                      .offered = false,
                      .ties_tools = true}) {}
  Nodes nodes() const override { return Nodes::kStates; }

  template <typename S>
  S value_at(const NodeOf<S>& node, const JointVectorOf<S>& weight) const {
    if (node.arm.tool_count() < 2) return S(0.0);
    const Matrix3Of<S> turned = node.arm.R(1) - R_held(node);
    return weight[0] * error(node).squaredNorm() + weight[1] * turned.cwiseProduct(turned).sum();
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeGradientOf<S>& gradient) const {
    if (node.arm.tool_count() < 2) return;
    const Matrix3Of<S> M = node.arm.R(1) * R_held(node).transpose();
    const Vector3Of<S> force = 2.0 * weight[0] * error(node);
    const Vector3Of<S> torque = 2.0 * weight[1] * Vector3Of<S>(M(2, 1) - M(1, 2), M(0, 2) - M(2, 0), M(1, 0) - M(0, 1));
    for (const auto& [k, sign] : Way(node.arm)) {
      gradient[k] += sign * (force.dot(node.arm.dpoint(k, node.arm.p(1))) + torque.dot(node.arm.axis(k)));
    }
  }

  /// With joint a before b on the way, J_b = dp_1: d2|e|^2 = 2 (J_a . J_b + e . (z_a x J_b)); of M as for one tool
  /// (docs/explanation/formulation.md).
  template <typename S>
  void hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    if (node.arm.tool_count() < 2) return;
    Matrix3Of<S> second = node.arm.R(1) * R_held(node).transpose();
    second.diagonal() -= Vector3Of<S>::Constant(second.trace());
    const Vector3Of<S> e = error(node);
    add(node, hessian, [&](const Vector3Of<S>& J, const Vector3Of<S>& axis, const SignedJoint& before) {
      const Vector3Of<S>& z = node.arm.axis(before.joint);
      const Vector3Of<S> J_before = node.arm.dpoint(before.joint, node.arm.p(1));
      return 2.0 * before.sign * (weight[0] * (J_before.dot(J) + z.dot(J.cross(e))) - weight[1] * z.dot(second * axis));
    });
  }

  /// Gauss-Newton on error and columns of R_1.
  template <typename S>
  void convex_hessian_at(const NodeOf<S>& node, const JointVectorOf<S>& weight, NodeHessianOf<S>& hessian) const {
    if (node.arm.tool_count() < 2) return;
    add(node, hessian, [&](const Vector3Of<S>& J, const Vector3Of<S>& axis, const SignedJoint& before) {
      const Vector3Of<S> J_before = node.arm.dpoint(before.joint, node.arm.p(1));
      return 2.0 * before.sign *
             (weight[0] * J_before.dot(J) + 2.0 * weight[1] * node.arm.axis(before.joint).dot(axis));
    });
  }

 private:
  /// Joints on the way from the first tool to the second, as way_between(); without allocation.
  class Way {
   public:
    template <typename Scalar>
    explicit Way(const KinematicsOf<Scalar>& arm) {
      const std::vector<int>&first = arm.chain(0), &second = arm.chain(1);
      const auto [end, begin] = std::mismatch(first.begin(), first.end(), second.begin(), second.end());
      for (auto k = first.end(); k != end;) joints_[count_++] = {*--k, -1.0};
      for (auto k = begin; k != second.end(); ++k) joints_[count_++] = {*k, 1.0};
    }
    const SignedJoint* begin() const { return joints_.data(); }
    const SignedJoint* end() const { return joints_.data() + count_; }

   private:
    std::array<SignedJoint, kMaxJoints> joints_;
    int count_ = 0;
  };

  template <typename S>
  static Matrix3Of<S> R_held(const NodeOf<S>& node) {
    Matrix3Of<S> held;
    for (int i = 0; i < 9; ++i) held.data()[i] = node.held->R.data()[i];
    return node.arm.R(0) * held;
  }
  template <typename S>
  static Vector3Of<S> error(const NodeOf<S>& node) {
    const Vector3Of<S> held(node.held->p.x(), node.held->p.y(), node.held->p.z());
    return node.arm.p(1) - node.arm.p(0) - node.arm.R(0) * held;
  }
  /// Adds part(J_b, z_b, a), with the sign of b in its vectors, for all joints a before b on the way, and b itself.
  template <typename S, typename F>
  static void add(const NodeOf<S>& node, NodeHessianOf<S>& hessian, const F& part) {
    const Way way(node.arm);
    for (const SignedJoint& b : way) {
      const Vector3Of<S> J = b.sign * node.arm.dpoint(b.joint, node.arm.p(1)), axis = b.sign * node.arm.axis(b.joint);
      for (const SignedJoint* a = way.begin(); a <= &b; ++a)
        upper_entry(hessian, a->joint, b.joint) += part(J, axis, *a);
    }
  }
};

}  // namespace

std::shared_ptr<const Objective> make_relative_pose_objective() { return std::make_shared<RelativePose>(); }

}  // namespace steadyhand

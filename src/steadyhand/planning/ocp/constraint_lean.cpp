#include <cmath>
#include <limits>

#include "steadyhand/planning/ocp/constraints.hpp"

namespace steadyhand {
namespace {

/// A row for each tool: the cosine of the angle between the glass's axis and the vertical, a_z with a = R e_z, at least
/// that of the largest lean. The liquid's model alone would let a glass swing over its head like a bucket.
class Lean final : public ConstraintFor<Lean> {
 public:
  Lean(const RobotModel& model, const LiquidSettings& settings)
      : ConstraintFor({"lean", "Lean of the glass", "1"}),
        tools_(model.tool_count()),
        least_(std::cos(settings.lean_max)),
        price_(kPriceOfHeight * settings.price * settings.glass.radius) {}

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return tools_; }
  Bounds bounds(int /*row*/) const override { return {least_, std::numeric_limits<double>::infinity()}; }
  EntryRange support(int /*row*/, int dof) const override { return {0, dof}; }
  double price(int /*row*/) const override { return price_; }
  double activation_margin(int /*row*/) const override { return kNear; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    return node.liquid[row].counts ? node.arm.R(row)(2, 2) : S(kFar);
  }

  /// da/dq_m = axis_m x a
  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    if (!node.liquid[row].counts) return;
    const Vector3Of<S> a = node.arm.R(row).col(2);
    for (const int m : node.arm.chain(row)) {
      if (turns(node, m)) gradient[m] += scale * node.arm.axis(m).cross(a)[2];
    }
  }

  /// d2a / dq_l dq_m = axis_l x (axis_m x a), l <= m
  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    if (!node.liquid[row].counts) return;
    const Vector3Of<S> a = node.arm.R(row).col(2);
    for (const int m : node.arm.chain(row)) {
      if (!turns(node, m)) continue;
      const Vector3Of<S> turned = node.arm.axis(m).cross(a);
      for (const int l : node.arm.chain(row)) {
        if (l > m) break;
        hessian(l, m) += scale * node.arm.axis(l).cross(turned)[2];
      }
    }
  }

 private:
  static constexpr double kPriceOfHeight = 10.0;  ///< a lean costs more than the wave that it causes at rest
  static constexpr double kNear = 0.1, kFar = 10.0;

  template <typename S>
  static bool turns(const NodeOf<S>& node, int joint) {
    return node.arm.model().joints[joint].type == JointType::kRevolute;
  }

  int tools_;
  double least_, price_;
};

}  // namespace

std::shared_ptr<const Constraint> make_lean(const RobotModel& model, const OcpSettings& settings) {
  return settings.liquid ? std::make_shared<Lean>(model, *settings.liquid) : nullptr;
}

}  // namespace steadyhand

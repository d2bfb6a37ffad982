#include <cmath>

#include "steadyhand/planning/ocp/constraints.hpp"

namespace steadyhand {
namespace {

using std::abs;

/// Keeps the stopping position of each joint at the largest allowed deceleration, q + dq |dq| / (2 a), inside the
/// position limits. Without it a plan may move so fast towards a limit, at its end or at a node, that the joint can no
/// longer stop. While dq keeps its sign and u its bounds, the value moves with dq, so a bound at the nodes also holds
/// between them.
class Stopping final : public ConstraintFor<Stopping> {
 public:
  Stopping(const RobotModel& model, const OcpSettings& settings)
      : ConstraintFor({"stopping", "Room to stop", "rad"}),
        lower_(model.position_min + settings.position_margin),
        upper_(model.position_max - settings.position_margin),
        curvature_((settings.acceleration_scale * model.acceleration_max).cwiseInverse()) {}

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return static_cast<int>(lower_.size()); }
  Bounds bounds(int row) const override { return {lower_[row], upper_[row]}; }
  EntryRange support(int row, int dof) const override { return {row, dof + row + 1}; }
  JointSet joints(int row, int /*dof*/, const NearObstacles& /*near*/) const override { return JointSet().set(row); }
  double activation_margin(int row) const override { return kNear * (upper_[row] - lower_[row]); }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    return node.arm.q()[row] + (0.5 * curvature_[row]) * node.dq[row] * abs(node.dq[row]);
  }
  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    gradient[row] += scale;
    gradient[rows() + row] += scale * curvature_[row] * abs(node.dq[row]);
  }
  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    const int i = rows() + row;
    hessian(i, i) += scale * select(node.dq[row] < 0.0, S(-curvature_[row]), S(curvature_[row]));
  }

 private:
  static constexpr double kNear = 0.1;  ///< share of the range

  JointVector lower_, upper_, curvature_;  ///< rad, rad, s^2/rad (m)
};

}  // namespace

std::shared_ptr<const Constraint> make_stopping(const RobotModel& model, const OcpSettings& settings) {
  return settings.position_margin.size() > 0 ? std::make_shared<Stopping>(model, settings) : nullptr;
}

}  // namespace steadyhand

#include <array>
#include <limits>

#include "steadyhand/ocp/constraints.hpp"

namespace steadyhand {
namespace {

/// Joints up to the first sphere's link carry both spheres, so only those between the two links change their distance
/// d: with c_j behind joint m, d(|d|^2)/dq_m = 2 d . dc_j/dq_m where d = c_j - c_i.
class SelfCollision final : public ConstraintFor<SelfCollision> {
 public:
  explicit SelfCollision(const RobotModel& model)
      : ConstraintFor({"self_collision", "Distance to itself", "m^2"}), model_(&model) {}

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return static_cast<int>(model_->pairs.size()); }
  Bounds bounds(int row) const override {
    const auto [i, j] = model_->pairs[row];
    const double radii = model_->spheres[i].radius + model_->spheres[j].radius;
    return {radii * radii, std::numeric_limits<double>::infinity()};
  }

  EntryRange support(int row, int /*dof*/) const override {
    const auto [i, j] = model_->pairs[row];
    return {model_->spheres[i].link, model_->spheres[j].link};
  }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    return node.arm.squared_distance(model_->pairs[row]);
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    const auto [i, j] = model_->pairs[row];
    const auto& arm = node.arm;
    const Vector3Of<S> twice = (2.0 * scale) * (arm.sphere(j) - arm.sphere(i));
    for (int m = model_->spheres[i].link; m < model_->spheres[j].link; ++m) {
      gradient[m] += twice.dot(arm.dpoint(m, arm.sphere(j)));
    }
  }

  /// With l before m: 2 dc_l . dc_m + 2 d . (z_l x dc_m) = 2 dc_m . (dc_l + d x z_l).
  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    const auto [i, j] = model_->pairs[row];
    const auto& arm = node.arm;
    const Vector3Of<S> d = arm.sphere(j) - arm.sphere(i);
    const int first = model_->spheres[i].link, last = model_->spheres[j].link;
    std::array<Vector3Of<S>, kMaxJoints> dc;
    for (int m = first; m < last; ++m) dc[m] = arm.dpoint(m, arm.sphere(j));
    for (int l = first; l < last; ++l) {
      const Vector3Of<S> turned = (2.0 * scale) * (dc[l] + d.cross(arm.axis(l)));
      for (int m = l; m < last; ++m) hessian(l, m) += turned.dot(dc[m]);
    }
  }

  /// (radii + clearance)^2 - radii^2
  double activation_margin(int row) const override {
    const auto [i, j] = model_->pairs[row];
    return (2.0 * (model_->spheres[i].radius + model_->spheres[j].radius) + kWatchedClearance) * kWatchedClearance;
  }

 private:
  static constexpr double kWatchedClearance =
      0.03;  // m; few pairs come nearer, and those that do are found at the check

  const RobotModel* model_;
};

}  // namespace

std::shared_ptr<const Constraint> make_self_collision(const RobotModel& model, const OcpSettings& /*settings*/) {
  return std::make_shared<SelfCollision>(model);
}

}  // namespace steadyhand

#include <limits>

#include "ocp/constraints.hpp"

namespace steadyhand {
namespace {

/// Joints up to the first sphere's link carry both spheres, so only those between the two links change their distance
/// d: with c_j behind joint m, d(|d|^2)/dq_m = 2 d . dc_j/dq_m where d = c_j - c_i.
class SelfCollision final : public Constraint {
 public:
  explicit SelfCollision(const RobotModel& model) : model_(&model) {}

  std::string_view name() const override { return "self_collision"; }
  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return static_cast<int>(model_->pairs.size()); }
  Bounds bounds(int row) const override {
    const auto [i, j] = model_->pairs[row];
    const double radii = model_->spheres[i].radius + model_->spheres[j].radius;
    return {radii * radii, std::numeric_limits<double>::infinity()};
  }

  double value(const Node& node, int row) const override { return node.arm.squared_distance(model_->pairs[row]); }

  void add_gradient(const Node& node, int row, double scale, NodeGradient& gradient) const override {
    const auto [i, j] = model_->pairs[row];
    const Kinematics& arm = node.arm;
    const Vector3 twice = 2.0 * scale * (arm.sphere(j) - arm.sphere(i));
    for (int m = model_->spheres[i].link; m < model_->spheres[j].link; ++m) {
      gradient[m] += twice.dot(arm.dpoint(m, arm.sphere(j)));
    }
  }

  void add_hessian(const Node& node, int row, double scale, NodeHessian& hessian) const override {
    const auto [i, j] = model_->pairs[row];
    const Kinematics& arm = node.arm;
    const Vector3 twice = 2.0 * scale * (arm.sphere(j) - arm.sphere(i));
    const int first = model_->spheres[i].link, last = model_->spheres[j].link;
    for (int m = first; m < last; ++m) {
      const Vector3 dc_m = arm.dpoint(m, arm.sphere(j));
      for (int l = first; l <= m; ++l) {  // joint l stands before joint m
        const double value = 2.0 * scale * dc_m.dot(arm.dpoint(l, arm.sphere(j))) + twice.dot(arm.axis(l).cross(dc_m));
        hessian(l, m) += value;
        if (l != m) hessian(m, l) += value;
      }
    }
  }

  /// (radii + clearance)^2 - radii^2
  double watch_margin(int row) const override {
    const auto [i, j] = model_->pairs[row];
    return (2.0 * (model_->spheres[i].radius + model_->spheres[j].radius) + kWatchedClearance) * kWatchedClearance;
  }

 private:
  static constexpr double kWatchedClearance =
      0.03;  // m; few pairs come nearer, and those that do are found at the check

  const RobotModel* model_;
};

}  // namespace

std::unique_ptr<Constraint> make_self_collision(const RobotModel& model) {
  return std::make_unique<SelfCollision>(model);
}

}  // namespace steadyhand

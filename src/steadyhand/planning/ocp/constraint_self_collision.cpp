#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/planning/ocp/constraints.hpp"

namespace steadyhand {
namespace {

/// Each row is the distance of a pair of bodies, or ProximityOf::value between round bodies. Joints up to the first
/// body's link carry both, so only those between the two links change their distance: they move the second body
/// relative to the first.
class SelfCollision final : public ConstraintFor<SelfCollision> {
 public:
  explicit SelfCollision(const RobotModel& model)
      : ConstraintFor({"self_collision", "Distance to itself", "m"}), model_(&model) {
    for (const auto& [i, j] : model.pairs) {
      const Body &first = model.bodies[i], &second = model.bodies[j];
      const bool spheres = first.shape.kind == ShapeKind::kSphere && second.shape.kind == ShapeKind::kSphere;
      const double radii = first.shape.radius + second.shape.radius;
      rows_.push_back({i, j, {first.link, second.link}, spheres, radii, 0.5 / radii});
      const auto extent = [](const Shape& shape) { return shape.core.norm() + shape.radius; };  // a cylinder's box, too
      const double apart = extent(first.shape) + extent(second.shape) + kNear + kMostClearance;
      const int r = static_cast<int>(balls_.size());
      if (groups_.empty() || groups_.back().first != i || r - groups_.back().begin == kAtOnce)
        groups_.push_back({i, r, r});
      groups_.back().end = r + 1;
      balls_.push_back({apart * apart, j});
    }
  }

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return static_cast<int>(rows_.size()); }
  Bounds bounds(int /*row*/) const override { return {0.0, std::numeric_limits<double>::infinity()}; }

  EntryRange support(int row, int /*dof*/) const override { return rows_[row].between; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    const auto& [i, j, between, spheres, radii, scale] = rows_[row];
    if (spheres)
      return ((node.arm.body(j).p - node.arm.body(i).p).squaredNorm() - radii * radii) * scale - node.clearance;
    return proximity_value(model_->bodies[i].shape, node.arm.body(i), model_->bodies[j].shape, node.arm.body(j)) -
           node.clearance;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    const auto [first, last] = rows_[row].between;
    if (rows_[row].spheres) {
      const Vector3Of<S> slope = scale * sphere_gradient(node, row);
      for (int m = first; m < last; ++m) gradient[m] += slope.dot(node.arm.dpoint(m, second(node, row)));
      return;
    }
    const ProximityOf<S> near = proximity_at(node, row);
    const Vector3Of<S> slope = scale * near.gradient;
    for (int m = first; m < last; ++m) gradient[m] += slope.dot(node.arm.dpoint(m, near.point));
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    const auto [first, last] = rows_[row].between;
    if (rows_[row].spheres) {
      const S curvature = scale / rows_[row].radii;
      const Vector3Of<S> slope = scale * sphere_gradient(node, row);
      std::array<Vector3Of<S>, kMaxJoints> dc;
      for (int m = first; m < last; ++m) dc[m] = node.arm.dpoint(m, second(node, row));
      for (int l = first; l < last; ++l) {  // with l before m: dc_l . dc_m / R + slope . (z_l x dc_m)
        const Vector3Of<S> turned = curvature * dc[l] + slope.cross(node.arm.axis(l));
        for (int m = l; m < last; ++m) hessian(l, m) += turned.dot(dc[m]);
      }
      return;
    }
    const ProximityOf<S> near = proximity_at(node, row);
    std::array<MovedOf<S>, kMaxJoints> moved;
    for (int m = first; m < last; ++m) moved[m] = {near, node.arm.axis(m), node.arm.dpoint(m, near.point)};
    for (int m = first; m < last; ++m) {
      for (int l = first; l <= m; ++l) hessian(l, m) += scale * second_derivative(near, moved[l], moved[m]);
    }
  }

  /// A pair is near if the balls around its bodies are, for any clearance, and then if the bodies are. Most pairs are
  /// not near, so several pairs of one body are checked at once.
  void find_near(const NodeBatch& nodes, Lanes acts, char* near) const override {
    for (const Group& group : groups_) {
      const Vector3Of<Lanes> p = nodes.arm.body(group.first).p;
      const auto beyond = [&](const Balls& balls) {
        return (nodes.arm.body(balls.second).p - p).squaredNorm() - balls.apart_squared;
      };
      Lanes least = std::numeric_limits<double>::infinity();
      for (int r = group.begin; r < group.end; ++r) least = min(beyond(balls_[r]), least);
      if (!any(select(acts > 0.0, least, 0.0) < 0.0)) continue;
      for (int r = group.begin; r < group.end; ++r) {
        if (!any(select(acts > 0.0, beyond(balls_[r]), 0.0) < 0.0)) continue;
        if (any(select(acts > 0.0, value_at<Lanes>(nodes, r) - activation_margin(r), 0.0) < 0.0)) near[r] = 1;
      }
    }
  }

  double activation_margin(int row) const override {
    const auto [i, j] = model_->pairs[row];
    const bool round = model_->bodies[i].shape.is_round() && model_->bodies[j].shape.is_round();
    return round ? kNear + 0.5 * kNear * kNear / rows_[row].radii : kNear;  // the value at that distance
  }

  /// Joint m moves only the second body relative to the first, and no point of it by more than its distance
  /// from the joint.
  JointVector levers() const override {
    const int n = model_->dof();
    JointVector result = JointVector::Zero(n);
    for (const Row& row : rows_) {
      const Body& body = model_->bodies[row.second];
      double distance = body.origin.translation().norm() + body.shape.core.norm();  // of points of its core
      for (int m = row.between.last - 1; m >= row.between.first; --m) {
        const Joint& joint = model_->joints[m];
        const bool turns = joint.type == JointType::kRevolute;
        result[m] = std::max(result[m], (turns ? distance : 1.0) / kNear);
        distance += joint.origin.translation().norm();
        if (!turns) distance += std::max(std::abs(model_->position_min[m]), std::abs(model_->position_max[m]));
      }
    }
    return result;
  }

 private:
  static constexpr double kNear = 0.03;  // m; few pairs come nearer, and those that do are found at the check

  /// m, the second body's centre.
  template <typename S>
  const Vector3Of<S>& second(const NodeOf<S>& node, int row) const {
    return node.arm.body(rows_[row].second).p;
  }
  /// Derivative of the value by the centre of the second sphere, for a pair of spheres.
  template <typename S>
  Vector3Of<S> sphere_gradient(const NodeOf<S>& node, int row) const {
    return (second(node, row) - node.arm.body(rows_[row].first).p) / S(rows_[row].radii);
  }
  template <typename S>
  ProximityOf<S> proximity_at(const NodeOf<S>& node, int row) const {
    const auto [i, j] = model_->pairs[row];
    return proximity(model_->bodies[i].shape, node.arm.body(i), model_->bodies[j].shape, node.arm.body(j));
  }

  /// The data of a pair that are read most often: an arm may have hundreds of pairs of spheres.
  struct Row {
    int first, second;   ///< bodies
    EntryRange between;  ///< joints between their links
    bool spheres;        ///< both are
    double radii;        ///< m, their sum
    double scale;        ///< 1/m, 1 / (2 radii): hundreds of divisions would take a microsecond
  };

  /// The spheres around a pair.
  struct Balls {
    double apart_squared;  ///< m^2, of centres from which on the pair is not near
    int second;
  };
  /// Rows begin .. end - 1, whose first body is the same.
  struct Group {
    int first, begin, end;
  };
  static constexpr int kAtOnce = 12;

  const RobotModel* model_;
  std::vector<Row> rows_;
  std::vector<Balls> balls_;
  std::vector<Group> groups_;
};

}  // namespace

std::shared_ptr<const Constraint> make_self_collision(const RobotModel& model, const OcpSettings& /*settings*/) {
  return std::make_shared<SelfCollision>(model);
}

}  // namespace steadyhand

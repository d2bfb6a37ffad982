#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <ranges>
#include <vector>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/planning/ocp/constraints.hpp"
#include "steadyhand/planning/ocp/relative_motion.hpp"

namespace steadyhand {
namespace {

/// Each row is the distance of a pair of bodies, or ProximityOf::value between round bodies. Joints that carry both do
/// not change it; those on the way from the first body's link to the second's do, and for them the second moves like
/// the end of a serial arm whose base is the first (way_between).
class SelfCollision final : public ConstraintFor<SelfCollision> {
 public:
  explicit SelfCollision(const RobotModel& model)
      : ConstraintFor({"self_collision", "Distance to itself", "m"}), model_(&model) {
    for (const auto& [i, j] : model.pairs) {
      const Body &first = model.bodies[i], &second = model.bodies[j];
      const bool spheres = first.shape.kind == ShapeKind::kSphere && second.shape.kind == ShapeKind::kSphere;
      const double radii = first.shape.radius + second.shape.radius;
      rows_.push_back({i, j, way(first.link, second.link), spheres, radii, 0.5 / radii});
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

  EntryRange support(int row, int /*dof*/) const override { return ways_[rows_[row].way].support; }
  JointSet joints(int row, int /*dof*/, const NearObstacles& /*near*/) const override {
    return joints_of(ways_[rows_[row].way].joints);
  }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    const auto& [i, j, way, spheres, radii, scale] = rows_[row];
    if (spheres)
      return ((node.arm.body(j).p - node.arm.body(i).p).squaredNorm() - radii * radii) * scale - node.clearance;
    return proximity_value(model_->bodies[i].shape, node.arm.body(i), model_->bodies[j].shape, node.arm.body(j)) -
           node.clearance;
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    if (rows_[row].spheres) {
      const Vector3Of<S> slope = scale * sphere_gradient(node, row);
      for (const auto& [m, sign] : joints(row)) gradient[m] += sign * slope.dot(node.arm.dpoint(m, second(node, row)));
      return;
    }
    const ProximityOf<S> near = proximity_at(node, row);
    const Vector3Of<S> slope = scale * near.gradient;
    for (const auto& [m, sign] : joints(row)) gradient[m] += sign * slope.dot(node.arm.dpoint(m, near.point));
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    const std::vector<SignedJoint>& way = joints(row);
    if (rows_[row].spheres) {
      const S curvature = scale / rows_[row].radii;
      const Vector3Of<S> slope = scale * sphere_gradient(node, row);
      std::array<Vector3Of<S>, kMaxJoints> dc;
      for (const auto& [m, sign] : way) dc[m] = sign * node.arm.dpoint(m, second(node, row));
      for (auto l = way.begin(); l != way.end(); ++l) {  // with l before m: dc_l . dc_m / R + slope . (z_l x dc_m)
        const Vector3Of<S> turned = curvature * dc[l->joint] + l->sign * slope.cross(node.arm.axis(l->joint));
        for (auto m = l; m != way.end(); ++m) upper_entry(hessian, l->joint, m->joint) += turned.dot(dc[m->joint]);
      }
      return;
    }
    add_second_derivatives(node, proximity_at(node, row), way, scale, hessian);
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

  /// Joint m moves only one body relative to the other, and no point of it by more than its distance from the joint.
  JointVector levers() const override {
    const int n = model_->dof();
    JointVector result = JointVector::Zero(n);
    const auto lengthen = [&](const Body& body, const auto& joints) {  // from the body's link towards the base
      double distance = body.origin.translation().norm() + body.shape.core.norm();  // of points of its core
      for (const SignedJoint& each : joints) {
        const int m = each.joint;
        const Joint& joint = model_->joints[m];
        const bool turns = joint.type == JointType::kRevolute;
        result[m] = std::max(result[m], (turns ? distance : 1.0) / kNear);
        distance += joint.origin.translation().norm();
        if (!turns) distance += std::max(std::abs(model_->position_min[m]), std::abs(model_->position_max[m]));
      }
    };
    for (int r = 0; r < rows(); ++r) {
      const std::vector<SignedJoint>& way = joints(r);
      const auto down = std::find_if(way.begin(), way.end(), [](const SignedJoint& each) { return each.sign > 0.0; });
      lengthen(model_->bodies[rows_[r].first], std::ranges::subrange(way.begin(), down));
      lengthen(model_->bodies[rows_[r].second], std::views::reverse(std::ranges::subrange(down, way.end())));
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

  const std::vector<SignedJoint>& joints(int row) const { return ways_[rows_[row].way].joints; }
  /// Index in ways_ of the way between two links.
  int way(int first, int last) {
    const auto found = std::find_if(ways_.begin(), ways_.end(),
                                    [&](const Way& way) { return way.first == first && way.last == last; });
    const int index = static_cast<int>(found - ways_.begin());
    if (found != ways_.end()) return index;
    Way& made = ways_.emplace_back(Way{first, last, way_between(*model_, first, last), {0, 0}});
    const auto [least, most] =
        std::ranges::minmax_element(made.joints, {}, [](const SignedJoint& each) { return each.joint; });
    if (!made.joints.empty()) made.support = {least->joint, most->joint + 1};
    return index;
  }

  /// From one link to another.
  struct Way {
    int first, last;
    std::vector<SignedJoint> joints;
    EntryRange support;
  };
  /// The data of a pair that are read most often: an arm may have hundreds of pairs of spheres.
  struct Row {
    int first, second;  ///< bodies
    int way;            ///< between their links
    bool spheres;       ///< both are
    double radii;       ///< m, their sum
    double scale;       ///< 1/m, 1 / (2 radii): hundreds of divisions would take a microsecond
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
  std::vector<Way> ways_;
  std::vector<Row> rows_;
  std::vector<Balls> balls_;
  std::vector<Group> groups_;
};

}  // namespace

std::shared_ptr<const Constraint> make_self_collision(const RobotModel& model, const OcpSettings& /*settings*/) {
  return std::make_shared<SelfCollision>(model);
}

}  // namespace steadyhand

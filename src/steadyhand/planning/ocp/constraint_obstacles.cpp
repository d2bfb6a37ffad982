#include <limits>
#include <utility>
#include <vector>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/ocp/constraints.hpp"
#include "steadyhand/planning/ocp/relative_motion.hpp"

namespace steadyhand {
namespace {

/// Each row is the distance between a body and an obstacle, or ProximityOf::value between round shapes. The instance
/// lists the pairs. An obstacle moves at its velocity to the node's time; the joints up to the body's link move the
/// body. Objects that a tool carries move with it; with a body of the arm, or an object that another tool carries, they
/// are treated like a pair of bodies.
class ObstacleClearance final : public ConstraintFor<ObstacleClearance> {
 public:
  ObstacleClearance(const RobotModel& model, int rows)
      : ConstraintFor({"obstacles", "Distance to obstacles", "m"}), model_(&model), rows_(rows) {
    for (int link = 0; link <= model.dof(); ++link) {
      std::vector<std::vector<SignedJoint>>& to_tools = ways_.emplace_back();
      for (const Tool& tool : model.tools) to_tools.push_back(way_between(model, link, tool.link));
      from_base_.push_back(way_between(model, 0, link));
    }
  }

  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return rows_; }
  Bounds bounds(int /*row*/) const override { return {0.0, std::numeric_limits<double>::infinity()}; }
  EntryRange support(int /*row*/, int dof) const override { return {0, dof}; }
  JointSet joints(int row, int /*dof*/, const NearObstacles& near) const override {
    return near[row].body < 0 ? JointSet() : joints_of(joints(near[row]));
  }
  double activation_margin(int /*row*/) const override { return kNear; }

  template <typename S>
  S value_at(const NodeOf<S>& node, int row) const {
    const NearObstacle& near = node.near[row];
    if (near.body < 0) return S(kFar);
    const auto [other, at] = seen_from(node, near);
    const auto [shape, there] = moved(node, near);
    return near.depth - node.clearance + proximity_value(other, at, shape, there);
  }

  template <typename S>
  void gradient_at(const NodeOf<S>& node, int row, S scale, NodeGradientOf<S>& gradient) const {
    if (node.near[row].body < 0) return;
    const ProximityOf<S> near = proximity_at(node, row);
    const Vector3Of<S> slope = scale * near.gradient;
    for (const auto& [m, sign] : joints(node.near[row]))
      gradient[m] += sign * slope.dot(node.arm.dpoint(m, near.point));
  }

  template <typename S>
  void hessian_at(const NodeOf<S>& node, int row, S scale, NodeHessianOf<S>& hessian) const {
    if (node.near[row].body < 0) return;
    const ProximityOf<S> near = proximity_at(node, row);
    add_second_derivatives(node, near, joints(node.near[row]), scale, hessian);
  }

 private:
  static constexpr double kNear = 0.03;  // m, as for pairs of the arm's own bodies
  static constexpr double kFar = 1.0;    // m, of a row that is not used

  /// Joints that move one relative to the other.
  const std::vector<SignedJoint>& joints(const NearObstacle& near) const {
    const bool of_arm = near.body < kMaxBodies;
    if (!of_arm && !near.obstacle.carried) return ways_[0][near.carried.tool];
    const int link = of_arm ? model_->bodies[near.body].link : model_->tools[near.carried.tool].link;
    return near.obstacle.carried ? ways_[link][near.obstacle.tool] : from_base_[link];
  }
  template <typename S>
  ProximityOf<S> proximity_at(const NodeOf<S>& node, int row) const {
    const NearObstacle& near = node.near[row];
    const auto [other, at] = seen_from(node, near);
    const auto [shape, there] = moved(node, near);
    return proximity(other, at, shape, there);
  }
  template <typename S>
  std::pair<Shape, PlacedOf<S>> seen_from(const NodeOf<S>& node, const NearObstacle& near) const {
    if (near.obstacle.carried && near.body < kMaxBodies)
      return {model_->bodies[near.body].shape, node.arm.body(near.body)};
    if (near.obstacle.carried) return {near.carried.shape, placed_on_tool(node.arm, near.carried)};
    return {near.obstacle.shape, placed_after(near.obstacle, node.time)};
  }
  /// The moving solid of the row: the whole, or a corner.
  template <typename S>
  std::pair<Shape, PlacedOf<S>> moved(const NodeOf<S>& node, const NearObstacle& near) const {
    const Obstacle* carried = near.obstacle.carried     ? &near.obstacle
                              : near.body >= kMaxBodies ? &near.carried
                                                        : nullptr;
    const Shape& shape = carried != nullptr ? carried->shape : model_->bodies[near.body].shape;
    const PlacedOf<S> there = carried != nullptr ? placed_on_tool(node.arm, *carried) : node.arm.body(near.body);
    if (near.corner < 0) return {shape, there};
    return {Shape::sphere(shape.radius), at_corner(shape, there, near.corner)};
  }

  const RobotModel* model_;
  int rows_;
  std::vector<std::vector<std::vector<SignedJoint>>> ways_;  ///< from a link to a tool
  std::vector<std::vector<SignedJoint>> from_base_;          ///< to a link
};

}  // namespace

std::shared_ptr<const Constraint> make_obstacles(const RobotModel& model, const OcpSettings& settings) {
  if (settings.obstacle_rows == 0) return nullptr;
  return std::make_shared<ObstacleClearance>(model, settings.obstacle_rows);
}

}  // namespace steadyhand

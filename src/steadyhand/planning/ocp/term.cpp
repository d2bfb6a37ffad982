#include "steadyhand/planning/ocp/term.hpp"

#include <Eigen/Eigenvalues>

namespace steadyhand {

void Objective::add_convex_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const {
  const int size = 3 * node.arm.dof();
  NodeHessian exact = NodeHessian::Zero(size, size);
  add_hessian(node, weight, exact);
  const Eigen::SelfAdjointEigenSolver<NodeHessian> eigen(exact.transpose());  // which reads the lower triangle
  for (int i = 0; i < size; ++i) {
    const auto v = eigen.eigenvectors().col(i);
    if (eigen.eigenvalues()[i] > 0.0) hessian.noalias() += eigen.eigenvalues()[i] * v.lazyProduct(v.transpose());
  }
}

namespace {

template <typename Batch>
auto lane_of(const Batch& batch, int lane) {
  return batch.unaryExpr([lane](const Lanes& all) { return all[lane]; });
}

/// Calls f(node, lane) with each node of the batch by itself.
template <typename F>
void for_each_lane(const NodeBatch& nodes, const F& f) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const JointVector q = lane_of(nodes.arm.q(), lane), dq = lane_of(nodes.dq, lane), u = lane_of(nodes.u, lane);
    std::array<ReferencePoseOf<double>, kMaxTools> reference;
    for (int t = 0; t < nodes.arm.tool_count(); ++t)
      reference[t] = {lane_of(nodes.reference[t].p, lane), lane_of(nodes.reference[t].R, lane)};
    nodes.scratch.set_position(q);
    nodes.scratch.set_motion(dq, u);
    const double time = nodes.time[lane];
    f(Node{nodes.scratch, dq, u, reference.data(), time, nodes.near}, lane);
  }
}

template <typename Lane, typename Batch>
void add_lane(const Lane& what, int lane, Batch& to) {
  for (int i = 0; i < what.size(); ++i) {
    Lanes& all = to.data()[i];
    all.set(lane, all[lane] + what.data()[i]);
  }
}

/// Adds what `add(node, lane, result)` adds for each lane.
template <typename Single, typename Batch, typename Add>
void add_by_lane(const NodeBatch& nodes, Batch& to, const Add& add) {
  for_each_lane(nodes, [&](const Node& node, int lane) {
    Single one = Single::Zero(to.rows(), to.cols());
    add(node, lane, one);
    add_lane(one, lane, to);
  });
}

}  // namespace

JointSet Constraint::joints(int row, int dof, const NearObstacles& /*near*/) const {
  const auto [first, last] = support(row, dof);
  JointSet joints;
  if (first >= 3 * dof) return joints.set();  // the liquids', which all may move
  for (int i = first; i < last; ++i) joints.set(i % dof);
  return joints;
}

Lanes Objective::value(const NodeBatch& nodes, const BatchWeight& weight) const {
  Lanes result;
  for_each_lane(nodes, [&](const Node& node, int lane) { result.set(lane, value(node, lane_of(weight, lane))); });
  return result;
}
void Objective::add_gradient(const NodeBatch& nodes, const BatchWeight& weight, NodeGradientOf<Lanes>& gradient) const {
  add_by_lane<NodeGradient>(nodes, gradient, [&](const Node& node, int lane, NodeGradient& one) {
    add_gradient(node, lane_of(weight, lane), one);
  });
}
void Objective::add_hessian(const NodeBatch& nodes, const BatchWeight& weight, NodeHessianOf<Lanes>& hessian) const {
  add_by_lane<NodeHessian>(nodes, hessian, [&](const Node& node, int lane, NodeHessian& one) {
    add_hessian(node, lane_of(weight, lane), one);
  });
}
void Objective::add_convex_hessian(const NodeBatch& nodes, const BatchWeight& weight,
                                   NodeHessianOf<Lanes>& hessian) const {
  add_by_lane<NodeHessian>(nodes, hessian, [&](const Node& node, int lane, NodeHessian& one) {
    add_convex_hessian(node, lane_of(weight, lane), one);
  });
}

Lanes Constraint::value(const NodeBatch& nodes, int row) const {
  Lanes result;
  for_each_lane(nodes, [&](const Node& node, int lane) { result.set(lane, value(node, row)); });
  return result;
}
void Constraint::find_near(const NodeBatch& nodes, Lanes acts, char* near) const {
  for (int i = 0; i < rows(); ++i) {
    const Bounds limit = bounds(i);
    const Lanes v = value(nodes, i), inside = min(v - limit.lower, limit.upper - v);
    if (any(select(acts > 0.0, inside - activation_margin(i), 0.0) < 0.0)) near[i] = 1;
  }
}
void Constraint::add_gradient(const NodeBatch& nodes, int row, Lanes scale, NodeGradientOf<Lanes>& gradient) const {
  add_by_lane<NodeGradient>(nodes, gradient, [&](const Node& node, int lane, NodeGradient& one) {
    add_gradient(node, row, scale[lane], one);
  });
}
void Constraint::add_hessian(const NodeBatch& nodes, int row, Lanes scale, NodeHessianOf<Lanes>& hessian) const {
  add_by_lane<NodeHessian>(
      nodes, hessian, [&](const Node& node, int lane, NodeHessian& one) { add_hessian(node, row, scale[lane], one); });
}

}  // namespace steadyhand

#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "steadyhand/ocp/ocp.hpp"

namespace steadyhand {

/// One scalar inequality of a node: row `row` of constraint `constraint`.
struct ConstraintRow {
  int constraint;  ///< index in Ocp::constraints()
  int row;
};

/// The terms of one Ocp, evaluated node by node at the point that is set. Scratch of one thread; memory is taken by the
/// constructor, nothing after it allocates. The Ocp and the instance must outlive it.
class Evaluation {
 public:
  explicit Evaluation(const Ocp& ocp);

  void set_instance(const OcpInstance& instance);
  /// Moves node k to (x, u); does nothing when it is there already. u is ignored at k = N.
  void set_node(int k, const StateVector& x, const JointVector& u);
  void set_trajectory(const Trajectory& trajectory);

  /// dt * (sum of the node's objectives).
  double objective(int k) const;
  /// dt * (objective i of Ocp::objectives(), summed over the horizon): its share of J.
  double objective_share(int i) const;
  void add_objective_gradient(int k, double scale, NodeGradient& gradient) const;
  void add_objective_hessian(int k, double scale, NodeHessian& hessian) const;
  /// With Objective::add_convex_hessian of each.
  void add_objective_convex_hessian(int k, double scale, NodeHessian& hessian) const;

  /// All rows that act at node k, in the order of Ocp::constraints().
  const std::vector<ConstraintRow>& rows(int k) const { return rows_[k]; }
  double constraint(int k, ConstraintRow row) const;
  Bounds bounds(ConstraintRow row) const { return ocp_->constraints()[row.constraint]->bounds(row.row); }
  void add_constraint_gradient(int k, ConstraintRow row, double scale, NodeGradient& gradient) const;
  void add_constraint_hessian(int k, ConstraintRow row, double scale, NodeHessian& hessian) const;

  /// Largest amount by which a row of any node leaves its bounds, in the row's own unit; 0 when inside.
  double violation() const;
  /// Smallest gap between sphere surfaces over nodes 0..N, m.
  double clearance() const;

  const Ocp& ocp() const { return *ocp_; }
  const OcpInstance& instance() const { return *instance_; }
  const Kinematics& arm(int k) const { return arms_[k]; }

 private:
  Node node(int k) const;

  const Ocp* ocp_;
  const OcpInstance* instance_ = nullptr;
  std::vector<Kinematics> arms_;
  std::vector<StateVector> x_;
  std::vector<JointVector> u_, dq_;
  std::vector<double> times_;  ///< s, of the nodes
  std::vector<std::vector<ConstraintRow>> rows_;
};

}  // namespace steadyhand

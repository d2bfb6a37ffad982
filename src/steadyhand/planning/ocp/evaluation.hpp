#pragma once

#include <memory>
#include <vector>

#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

template <typename Scalar>
class SloshIntervalOf;

/// The terms of one Ocp, evaluated node by node at the point that is set. Scratch of one thread; only the constructor
/// allocates. The Ocp and the instance must outlive it.
class Evaluation {
 public:
  /// Allocates all memory.
  explicit Evaluation(const Ocp& ocp);
  ~Evaluation();

  void set_instance(const OcpInstance& instance);  ///< from now on
  /// Moves node k to (x, u); does nothing when it is there already. u is ignored at k = N.
  void set_node(int k, const StateVector& x, const JointVector& u);
  /// All nodes, the liquid rolled out from the instance's state.
  void set_trajectory(const Trajectory& trajectory);

  // ---- of a problem with a liquid
  /// Moves a tool's liquid at node k. Call set_node() before reading.
  void set_slosh(int k, const SloshState& state, int tool = 0) { slosh_[index(k, tool)] = state; }
  const SloshState& slosh(int k, int tool = 0) const { return slosh_[index(k, tool)]; }  ///< at node k
  /// How the liquid's state goes over interval k, with derivatives at node k's.
  const SloshStep& slosh_step(int k, int tool = 0) const;
  /// After slosh_step(k, tool): adds the second derivatives of costate . state+ by z.
  void add_slosh_hessian(int k, const SloshState& costate, NodeHessian& hessian, int tool = 0) const;

  /// dt * (sum of the node's objectives).
  double objective(int k) const;
  /// dt * (objective i of Ocp::objectives(), summed over the horizon): its share of J.
  double objective_share(int i) const;
  /// Adds scale times the derivative of objective(k) by z.
  void add_objective_gradient(int k, double scale, NodeGradient& gradient) const;
  /// The same of its second derivatives.
  void add_objective_hessian(int k, double scale, NodeHessian& hessian) const;
  /// With Objective::add_convex_hessian of each.
  void add_objective_convex_hessian(int k, double scale, NodeHessian& hessian) const;

  /// All rows that act at node k, in the order of Ocp::constraints().
  const std::vector<ConstraintRow>& rows(int k) const { return rows_[k]; }
  double constraint(int k, ConstraintRow row) const;  ///< value of a row at node k
  /// Bounds of the row.
  Bounds bounds(int k, ConstraintRow row) const {
    const Constraint& constraint = *ocp_->constraints()[row.constraint];
    return k == 0 ? constraint.first_bounds(instance_->x0, row.row) : constraint.bounds(row.row);
  }
  /// Adds scale times the row's derivative by z.
  void add_constraint_gradient(int k, ConstraintRow row, double scale, NodeGradient& gradient) const;
  /// The same of its second derivatives.
  void add_constraint_hessian(int k, ConstraintRow row, double scale, NodeHessian& hessian) const;

  /// Penalty at node k of rows with a price outside their bounds.
  double price(int k) const;
  /// Largest amount by which a row without a price leaves its bounds at any node, in the row's own unit; 0 when inside.
  /// Without rows of given joints (Ocp::is_given).
  double violation() const;
  /// Smallest gap between sphere surfaces over nodes 0..N, m.
  double clearance() const;

  const Ocp& ocp() const { return *ocp_; }                    ///< whose terms these are
  const OcpInstance& instance() const { return *instance_; }  ///< that was set
  const Kinematics& arm(int k) const { return arms_[k]; }     ///< at node k

 private:
  Node node(int k) const;
  std::size_t index(int k, int tool) const { return static_cast<std::size_t>(k) * ocp_->tool_count() + tool; }

  const Ocp* ocp_;
  const OcpInstance* instance_ = nullptr;
  std::vector<Kinematics> arms_;
  std::vector<StateVector> x_;
  std::vector<JointVector> u_, dq_;
  std::vector<double> times_;  ///< s, of the nodes
  std::vector<std::vector<ConstraintRow>> rows_;
  std::vector<ReferencePoseOf<double>> references_;    ///< by index()
  std::vector<SloshState> slosh_;                      ///< by index()
  std::unique_ptr<SloshIntervalOf<double>> interval_;  ///< the last one asked for
  mutable SloshStep step_;
};

}  // namespace steadyhand

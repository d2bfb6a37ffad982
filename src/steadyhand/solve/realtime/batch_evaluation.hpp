#pragma once

#include <vector>

#include "steadyhand/ocp/evaluation.hpp"
#include "steadyhand/solve/realtime/node_table.hpp"

namespace steadyhand::realtime {

/// Which second derivatives a Newton step uses.
enum class Curvature {
  kExact,   ///< those of the Lagrangian: quadratic convergence, but perhaps no descent far from the solution
  kConvex,  ///< the objectives' positive semidefinite stand-ins, constraints taken as linear: always descent
};

/// The terms of one Ocp, kLanes nodes at a time. In lanes where a term does not act it gives 0. What Evaluation is for
/// single nodes; scratch of one thread, memory is taken by the constructor.
class BatchEvaluation {
 public:
  explicit BatchEvaluation(const Ocp& ocp);

  /// Copies what it needs.
  void set_instance(const OcpInstance& instance);
  /// Moves all nodes. z: table [q; dq; u] x nodes that starts at the instance's x_0.
  void set_point(const NodeTable& z);

  int batches() const { return static_cast<int>(batches_.size()); }
  /// Batches 0 .. acting_batches - 1 have nodes where terms of this kind act.
  int acting_batches(Nodes nodes) const { return nodes == Nodes::kStates ? state_batches_ : batches(); }
  /// 1 in lanes whose node is one where terms of this kind act, else 0.
  const Lanes& acts(Nodes nodes, int b) const {
    return nodes == Nodes::kStates ? batches_[b].state : batches_[b].interval;
  }

  /// J
  double objective() const;
  void add_objective_gradient(int b, NodeGradientOf<Lanes>& gradient) const;
  void add_objective_hessian(int b, Curvature curvature, NodeHessianOf<Lanes>& hessian) const;

  Lanes constraint(int b, ConstraintRow row) const { return term(row).value(node(b), row.row); }
  /// All rows of constraint c: row i goes to values[i * stride].
  void constraints(int b, int c, Lanes* values, int stride) const {
    ocp_.constraints()[c]->values(node(b), values, stride);
  }
  void add_constraint_gradient(int b, ConstraintRow row, NodeGradientOf<Lanes>& gradient) const {
    term(row).add_gradient(node(b), row.row, 1.0, gradient);
  }
  void add_constraint_hessian(int b, ConstraintRow row, Lanes scale, NodeHessianOf<Lanes>& hessian) const {
    term(row).add_hessian(node(b), row.row, scale, hessian);
  }

 private:
  struct Batch {
    KinematicsOf<Lanes> arm;
    JointVectorOf<Lanes> dq, u;
    Vector3Of<Lanes> p_ref;
    Matrix3Of<Lanes> R_ref;
    Lanes time;                                   ///< s, of the nodes
    Lanes state, interval;                        ///< see acts()
    std::vector<Objective::BatchWeight> weights;  ///< dt * weight of each objective; 0 where it does not act
  };

  NodeBatch node(int b) const {
    const Batch& batch = batches_[b];
    return {{batch.arm, batch.dq, batch.u, batch.p_ref, batch.R_ref, batch.time, near_}, scratch_};
  }
  const Constraint& term(ConstraintRow row) const { return *ocp_.constraints()[row.constraint]; }

  const Ocp& ocp_;
  NodeOrder order_;
  std::vector<Batch> batches_;
  int state_batches_;
  NearObstacles near_;         ///< of the instance
  std::vector<int> weighted_;  ///< objectives whose weight is not 0
  bool needs_motion_ = false, fresh_ = true;
  mutable Kinematics scratch_;
};

}  // namespace steadyhand::realtime

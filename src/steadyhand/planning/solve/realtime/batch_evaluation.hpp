#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/ocp/slosh_interval.hpp"
#include "steadyhand/planning/solve/realtime/node_table.hpp"

namespace steadyhand::realtime {

/// Which second derivatives a Newton step uses.
enum class Curvature {
  kExact,   ///< those of the Lagrangian: quadratic convergence, but perhaps no descent far from the solution
  kConvex,  ///< the objectives' positive semidefinite stand-ins, constraints taken as linear: always descent
};

/// The terms of one Ocp, kLanes nodes at a time; Evaluation does the same for single nodes. In lanes where a term does
/// not act it gives 0. Scratch of one thread; the constructor allocates all memory.
class BatchEvaluation {
 public:
  explicit BatchEvaluation(const Ocp& ocp);

  /// Copies what it needs. The liquids' derivatives by joints that are given are 0.
  void set_instance(const OcpInstance& instance);
  /// Moves all nodes. z: table [q; dq; u] x nodes that starts at the instance's x_0. After these rows it writes the
  /// liquid's states, rolled out.
  void set_point(NodeTable& z);

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
  /// See Constraint::find_near, of constraint c.
  void find_near(int b, int c, char* near) const {
    const Constraint& constraint = *ocp_.constraints()[c];
    constraint.find_near(node(b), acts(constraint.nodes(), b), near);
  }
  void add_constraint_gradient(int b, ConstraintRow row, NodeGradientOf<Lanes>& gradient) const {
    term(row).add_gradient(node(b), row.row, 1.0, gradient);
  }
  void add_constraint_hessian(int b, ConstraintRow row, Lanes scale, NodeHessianOf<Lanes>& hessian) const {
    term(row).add_hessian(node(b), row.row, scale, hessian);
  }

  // ---- of a problem with a liquid, after set_point
  /// Computes the derivatives of all intervals.
  void differentiate_slosh(const NodeTable& z);
  /// Of each interval of a tool's liquid.
  const std::vector<SloshStep>& slosh_steps(int tool) const { return slosh_steps_[tool]; }
  /// The second derivatives of costates[k] . state+ (see SloshStep) of a tool's liquid by [q; dq; u] of node k, for the
  /// kLanes intervals from `first`, a multiple of kLanes, on: sets the upper triangle of H.
  void find_slosh_hessian(int tool, int first, const NodeTable& z, const std::vector<SloshState>& costates,
                          NodeHessianOf<Lanes>& H) const;

 private:
  struct Batch {
    KinematicsOf<Lanes> arm;
    JointVectorOf<Lanes> dq, u;
    std::array<ReferencePoseOf<Lanes>, kMaxTools> reference;
    Lanes time;             ///< s, of the nodes
    Lanes state, interval;  ///< see acts()
    std::array<SloshStateOf<Lanes>, kMaxTools> slosh;
    std::vector<Objective::BatchWeight> weights;  ///< dt * weight of each objective; 0 where it does not act
  };

  NodeBatch node(int b) const {
    const Batch& batch = batches_[b];
    return {{batch.arm, batch.dq, batch.u, batch.reference.data(), batch.time, near_,
             ocp_.liquid() ? batch.slosh.data() : nullptr, liquid_.data(), &u_followed_, clearance_, &held_},
            scratch_};
  }
  /// Whether batch b has only node 0, which is stored as Start.
  bool is_start(int b) const { return start_known_ && b == state_batches_; }
  void find_start();
  JointVector start_step() const;  ///< of u_0, from where Start was computed
  void roll_out_slosh(NodeTable& z);
  SloshState slosh_state(const NodeTable& z, int k, int tool) const {
    SloshState state;
    for (int i = 0; i < kSloshStates; ++i) state[i] = z.at(slosh_begin(ocp_.dof(), tool) + i, k);
    return state;
  }
  const Constraint& term(ConstraintRow row) const { return *ocp_.constraints()[row.constraint]; }

  const Ocp& ocp_;
  NodeOrder order_;
  std::vector<Batch> batches_;
  int state_batches_;
  NearObstacles near_;                                         ///< from the instance
  std::array<LiquidInstance, kMaxTools> liquid_;               ///< the same
  JointVector u_followed_;                                     ///< the same
  double clearance_ = 0.0;                                     ///< m, the same
  ReferencePoseOf<double> held_;                               ///< the same
  JointSet given_;                                             ///< the same
  std::vector<SloshIntervalOf<Lanes>> slosh_;                  ///< intervals kLanes b to kLanes b + kLanes - 1
  std::array<std::vector<SloshStep>, kMaxTools> slosh_steps_;  ///< by interval
  std::vector<int> weighted_;                                  ///< objectives whose weight is not 0
  bool needs_motion_ = false, fresh_ = true, slosh_counts_ = false;

  /// J of node 0, whose state is given: a quadratic function of u_0.
  struct Start {
    JointVector u, gradient;  ///< where it was computed
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxJoints, kMaxJoints> hessian;
    double value = 0.0;
  };
  Start start_;
  NodeHessianOf<Lanes> start_hessian_;  ///< scratch
  bool inputs_only_;                    ///< node 0 is alone in a batch, and constraints on intervals are limits
  bool start_known_ = false;
  mutable Kinematics scratch_;
};

}  // namespace steadyhand::realtime

#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "steadyhand/planning/solve/realtime/batch_evaluation.hpp"
#include "steadyhand/planning/solve/realtime/curvature_scale.hpp"
#include "steadyhand/planning/solve/realtime/newton_system.hpp"
#include "steadyhand/planning/solve/realtime/node_table.hpp"
#include "steadyhand/planning/solve/realtime/row_set.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand::realtime {

/// One bound of a row at the nodes of a batch: g = sign * (c - limit).
struct RowSide {
  double sign;
  Lanes limit;
  Lanes slack, elastic, multiplier;
  Lanes stiffness, offset;  ///< from the last model()
  Lanes slack_step, elastic_step, multiplier_step;
  Lanes new_slack, new_elastic;
};
/// A row of the working set at the nodes of a batch.
struct RowBlock {
  int row, entry;
  EntryRange support;
  double price;  ///< for the elastic variables
  bool soft;     ///< it is the row's own
  Lanes acts;    ///< 1 in lanes where the row acts, else 0
  Lanes value;   ///< c at the point
  std::array<RowSide, 2> sides;
  int side_count;
  std::size_t gradient;  ///< in those of all blocks, where dc/dz begins: the entries of the support, if it is no entry

  /// g of a side; 1 in lanes where the row does not act.
  Lanes inside(const RowSide& side) const { return select(acts > 0.0, side.sign * (value - side.limit), 1.0); }
  /// As Solution::multipliers has it; 0 in lanes where the row does not act.
  Lanes signed_multiplier() const {
    Lanes total = 0.0;
    for (int i = 0; i < side_count; ++i) total -= sides[i].sign * sides[i].multiplier;
    return acts * total;
  }
};

/// Distance of a point with its multipliers from the KKT conditions; the first three are the terms of kkt_error().
struct Residuals {
  double dual = 0.0;             ///< largest |dL/du|, states eliminated
  double violation = 0.0;        ///< in the rows of the working set that have no price
  double complementarity = 0.0;  ///< largest |multiplier * distance to the bound|, with a price see kkt_error()
  double centrality = 0.0;       ///< largest |slack * multiplier - mu|, of slacks and of elastic variables

  double kkt() const { return std::max({dual, violation, complementarity}); }
};

/// The problem that the solver's Newton steps see (docs/explanation/solver.md, "Elastic barrier"). Every bound of every
/// row at every node, written as g(z) >= 0, gets two positive variables with g + elastic = slack: the slack is the
/// distance to the bound from inside, the elastic variable the violation. Over the accelerations and these the solver
/// minimises
///   phi = J + sum ( price * elastic - mu log slack - mu log elastic ),
/// whose minimisers go to the solution as mu -> 0. They make g + elastic = slack true at any point, so there is no
/// infeasible iterate; the price is above every multiplier, so that elastic variables vanish wherever they can, except
/// for rows with their own price (Constraint::price).
///
/// Points z are tables [q; dq; u; states of the liquids] x nodes that obey the dynamics. Lanes in which a row does not
/// act carry the bound 1 >= 0, which keeps all arithmetic free of cases. Allocates only when it is made.
class ElasticBarrier {
 public:
  explicit ElasticBarrier(const Ocp& ocp);

  /// Leaves in the working set only the rows that are always there.
  void forget_rows() { rows_.reset(); }
  /// Starts a new problem at z. Adds the rows near their bounds to the working set.
  /// start_slacks() must follow before anything but differentiate().
  /// @param multipliers those of a solution nearby, or null
  void begin(const OcpInstance& instance, const NodeTable& z, const Multipliers* multipliers);
  /// Slacks for the point and the barrier parameter mu: far enough from zero to move. Multipliers on the central path
  /// or, if that is larger, as they are.
  void start_slacks(double mu);
  /// After differentiate(), whose residuals are those of the new mu then.
  void set_mu(double mu);
  double mu() const { return mu_; }

  /// Where the Newton step starts: derivatives and residuals at the point that begin(), try_step() or move() set last.
  /// Values that depend only on the point are computed once per point.
  const Residuals& differentiate();
  /// Residuals from the last differentiate().
  const Residuals& residuals() const { return residuals_; }
  /// Second-order models of all nodes with the slacks eliminated. `damping` is added to the curvature by u.
  void model(Curvature curvature, double damping, NewtonSystem& newton);
  /// The slacks' and multipliers' part of a step, and how much of it keeps them positive.
  /// @return dphi along the step; +infinity for a step that is not finite
  double complete(const NodeTable& step);
  double largest_scale() const { return largest_scale_; }

  /// Adds limits that the step would reach or nearly reach to the working set. True if there were any: then the
  /// model has changed.
  bool meet_limits(const NodeTable& step);

  double merit();
  /// phi at z + scale * step with the slacks moved along; infinite where it is not finite.
  double try_step(const NodeTable& z, double scale);
  /// Accepts the last step of try_step; multipliers move as far as they stay positive.
  void accept();

  /// Sets the point without touching slacks and multipliers.
  void move(const NodeTable& z);
  /// J and the cost of rows with a price.
  double objective() const { return objective_ + cost_of_prices(); }
  /// Result of check_all_rows().
  enum class Check { kNothingNew, kMissedLinear, kMissed };
  /// Checks all rows at the point; those outside their bounds by more than the tolerance enter the working set.
  Check check_all_rows(double tolerance);
  /// Adds rows that the point has come near to the working set, if the joints have moved far enough since all rows were
  /// checked.
  void watch();
  /// Violation of all rows without a price at the last begin() or check_all_rows().
  double violation() const { return violation_; }
  double curvature_scale() const { return curvature_scale_; }
  /// Writes the multipliers of the rows in the working set.
  void write_multipliers(Multipliers& multipliers) const;

 private:
  static constexpr double kPenalty = 1e6;
  static constexpr double kStayInside = 0.995;  ///< largest share of the way to zero that a slack goes in one step
  /// Rows with multipliers below this count as not near their bounds.
  static constexpr double kNoMultiplier = 1e-4;
  static constexpr double kClose = 0.1;  ///< share of its margin at which a limit is met

  /// Contribution of the slacks to phi.
  struct Barrier {
    double elastic = 0.0, logarithms = 0.0;
  };

  /// Sets near[r] = 0 for rows that are no constraints, see OcpInstance::given.
  void forget_given();
  /// Sets the second derivatives by the motion of given joints to 0.
  void leave_out_given(NodeHessianOf<Lanes>& H) const;
  void set_point();  ///< sets all values that depend on z_
  void differentiate_terms();
  void find_near();
  /// Calls f(row) with the rows of watch_.near.
  template <typename F>
  void for_each_near(const F& f) {
    for (auto at = watch_.near.begin(); (at = std::find(at, watch_.near.end(), 1)) != watch_.near.end(); ++at) {
      f(static_cast<int>(at - watch_.near.begin()));
    }
  }
  Lanes off_centre(const RowBlock& block, const RowSide& side) const;
  double violation_of_blocks() const;
  double violation(int r) const;
  Lanes compute(const RowBlock& block, int b) const;
  /// Whether no joint has moved so far, since all rows were checked, that a row could have used up this share of its
  /// margin.
  bool stayed_near(double share) const;
  void take(int r);  ///< adds it to the working set
  /// Sets first_bounds_; rows whose bounds they narrow count as near.
  void narrow_first(const StateVector& x0);
  void work_on(int r, const Multipliers* multipliers);
  void start_slacks(RowBlock& block) const;
  bool had_multiplier(const Multipliers& multipliers, int r) const;
  void add_slosh(NewtonSystem& newton);
  void find_model(int b, Curvature curvature, double damping);
  void write_model(int b, NewtonSystem& newton) const;
  double phi(const Barrier& barrier) const;
  double cost_of_prices() const;
  /// Calls f(block, batch) with every block.
  template <typename F>
  void for_each_block(const F& f) {
    for (int b = 0; b < evaluation_.batches(); ++b) {
      for (RowBlock& block : blocks_[b]) f(block, b);
    }
  }

  const Ocp& ocp_;
  int n_, entries_;
  NodeOrder order_;
  BatchEvaluation evaluation_;
  RowSet rows_;
  CurvatureScale curvature_;
  double curvature_scale_ = 1.0;
  double mu_ = 1.0;

  std::vector<int> interval_rows_;    ///< those that act at node 0
  std::vector<Bounds> first_bounds_;  ///< by row, at node 0
  JointSet given_;
  std::vector<int> given_rows_;  ///< that are no constraints

  /// The rows outside of the working set.
  struct Watch {
    JointVector levers;      ///< 1/rad, of the constraints that know them (Constraint::levers)
    bool all_known = true;   ///< these are all with rows outside of the working set
    NodeTable begun;         ///< the point where begin() or watch() checked all rows
    std::vector<char> near;  ///< by row, see Constraint::find_near
  } watch_;

  NodeTable z_;                                ///< the point
  std::vector<std::vector<RowBlock>> blocks_;  ///< by batch
  std::vector<Lanes> gradients_;               ///< by block
  double objective_ = 0.0, violation_ = 0.0;
  bool differentiated_ = false;                  ///< gradient_ and gradients_ are those of the point
  Barrier barrier_, tried_barrier_;              ///< tried: by try_step()
  bool merit_known_ = false;                     ///< barrier_ is of the slacks
  std::vector<NodeGradientOf<Lanes>> gradient_;  ///< of J by z, in each batch
  std::vector<NodeGradientOf<Lanes>> lagrangian_gradient_;
  /// The model of a batch, from find_model().
  struct Model {
    NodeHessianOf<Lanes> hessian;
    NodeGradientOf<Lanes> gradient;
  } model_;
  struct Slosh {
    bool counts = false;
    NodeHessianOf<Lanes> hessian;  ///< for a liquid's input in kLanes intervals, by [q; dq; u]
    /// dL by the state of each tool's liquid at k + 1, of everything from there on.
    std::array<std::vector<SloshState>, kMaxTools> costates;
  } slosh_;
  Residuals residuals_;
  double largest_scale_ = 1.0, largest_dual_scale_ = 1.0;
  const NodeTable* step_ = nullptr;
};

}  // namespace steadyhand::realtime

#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "solve/realtime/batch_evaluation.hpp"
#include "solve/realtime/newton_system.hpp"
#include "solve/realtime/node_table.hpp"
#include "solve/realtime/row_set.hpp"

namespace steadyhand::realtime {

/// Distance of a point with its multipliers from the KKT conditions; the first three are the terms of kkt_error().
struct Residuals {
  double dual = 0.0;             ///< largest |dL/du|, states eliminated
  double violation = 0.0;        ///< of the watched rows
  double complementarity = 0.0;  ///< largest |multiplier * distance to the bound|
  double centrality = 0.0;       ///< largest |slack * multiplier - mu|, of both kinds of slack

  double kkt() const { return std::max({dual, violation, complementarity}); }
};

/// The problem that the solver's Newton steps see (docs/solver.md, "Elastic barrier"). Every bound of every row at
/// every node, written as g(z) >= 0, gets two positive slacks with g + excess = room: `room` inside the bound and
/// `excess` beyond it. Over the accelerations and the slacks the solver minimises
///   phi = J + sum ( price * excess - mu log room - mu log excess ),
/// whose minimisers go to the solution as mu -> 0. The slacks make g + excess = room true at any point, so there is no
/// infeasible iterate; the price is above every multiplier, so no excess is left at the end unless it must.
///
/// Points z are tables [q; dq; u] x nodes that obey the dynamics. Lanes in which a row does not act carry the bound
/// 1 >= 0, which keeps all arithmetic free of cases. Allocates only when it is made.
class ElasticBarrier {
 public:
  explicit ElasticBarrier(const Ocp& ocp);

  /// Only the rows that are always watched stay so.
  void forget_rows() { rows_.reset(); }
  /// Starts a new problem at z. Also watches the rows near their bounds there.
  /// @param multipliers those of a solution nearby, or null
  /// @param mu the barrier's first parameter
  /// @return violation of all rows at z
  double begin(const OcpInstance& instance, const NodeTable& z, const std::vector<std::vector<double>>* multipliers,
               double mu);
  void set_mu(double mu) { mu_ = mu; }
  double mu() const { return mu_; }

  /// Where the Newton step starts: derivatives and residuals at the point that begin(), try_step() or move() set last.
  const Residuals& differentiate();
  /// Second-order models of all nodes with the slacks eliminated. `damping` is added to the curvature by u.
  void model(Curvature curvature, double damping, NewtonSystem& newton);
  /// The slacks' and multipliers' part of a step, and how much of it keeps them positive.
  /// @return dphi along the step; +infinity for a step that is not finite
  double complete(const NodeTable& step);
  double largest_scale() const { return largest_scale_; }

  double merit() const;
  /// phi at z + scale * step with the slacks moved along; infinite where it is not finite.
  double try_step(const NodeTable& z, double scale);
  /// Keeps what try_step tried last; multipliers move as far as they stay positive.
  void accept();

  /// Sets the point without touching slacks and multipliers.
  void move(const NodeTable& z);
  double objective() const { return objective_; }
  /// Violation of all rows at the point; rows outside their bounds are watched from now on. `added` tells if any are
  /// new.
  double check_all_rows(double tolerance, bool& added);
  double curvature_scale() const { return curvature_scale_; }
  /// Multipliers in the order of Solution::multipliers.
  void write_multipliers(std::vector<std::vector<double>>& multipliers) const;

 private:
  static constexpr double kPrice = 1e6;
  static constexpr double kStayInside = 0.995;  ///< largest share of the way to zero that a slack goes in one step
  /// Multipliers below this are taken for those of rows that are not near their bounds.
  static constexpr double kNoMultiplier = 1e-4;

  /// One bound of every row: g = sign * (c - bound).
  struct Side {
    double sign;
    NodeTable room, excess, multiplier;
    NodeTable stiffness, offset;  ///< of the last model()
    NodeTable room_step, excess_step, multiplier_step;
    NodeTable new_room, new_excess;

    Side(double s, const NodeTable& shape)
        : sign(s),
          room(shape),
          excess(shape),
          multiplier(shape),
          stiffness(shape),
          offset(shape),
          room_step(shape),
          excess_step(shape),
          multiplier_step(shape),
          new_room(shape),
          new_excess(shape) {}
    double bound(const Row& row) const { return sign > 0.0 ? row.bounds.lower : row.bounds.upper; }
  };

  void compute_value(int r);
  const Lanes* value(int r) const { return rows_[r].entry >= 0 ? z_[rows_[r].entry] : value_[r]; }
  /// g of a side in batch b; 1 in lanes where the row does not act.
  Lanes inside(const Side& side, int r, int b) const;
  /// Smallest distance of row r to its bounds at a node; negative outside.
  double least_inside(int r) const;
  void start_slacks(int r, const std::vector<std::vector<double>>* multipliers);
  /// Largest multiplier of each row, in the order of rows.
  void largest_multipliers(const std::vector<std::vector<double>>& multipliers);
  double sum_of_barriers(const NodeTable Side::*room, const NodeTable Side::*excess) const;
  /// Signed multipliers as Solution::multipliers has them; 0 in lanes where the row does not act.
  Lanes signed_multiplier(int r, int b) const;
  void write_model(int b, const NodeHessianOf<Lanes>& H, const NodeGradientOf<Lanes>& g, NewtonSystem& newton) const;

  /// dc/dz of row r in batch b: the entries of its support.
  Lanes* row_gradient(int r, int b) { return row_gradients_.data() + row_gradient_begin_[r] + b * support_size(r); }
  int support_size(int r) const { return rows_[r].support.last - rows_[r].support.first; }

  const Ocp& ocp_;
  int n_, horizon_;
  double dt_;
  NodeOrder order_;
  BatchEvaluation evaluation_;
  RowSet rows_;
  std::vector<JointVector> unit_curvature_;  ///< of each objective and weight entry: curvature_scale_ is linear in them
  double curvature_scale_ = 1.0;
  double mu_ = 1.0;

  NodeTable z_;      ///< the point
  NodeTable value_;  ///< of the rows that are not entries of z
  std::array<Side, 2> sides_;
  std::vector<double> largest_multiplier_;
  double objective_ = 0.0;
  std::vector<NodeGradientOf<Lanes>> gradient_;  ///< of J by z, in each batch
  std::vector<NodeGradientOf<Lanes>> lagrangian_gradient_;
  std::vector<Lanes> row_gradients_;
  std::vector<std::size_t> row_gradient_begin_;
  Residuals residuals_;
  double largest_scale_ = 1.0, largest_dual_scale_ = 1.0;
  const NodeTable* step_ = nullptr;
};

}  // namespace steadyhand::realtime

#pragma once

#include <array>
#include <vector>

#include "ocp/evaluation.hpp"
#include "solve/realtime/newton_system.hpp"
#include "solve/realtime/node_table.hpp"
#include "solve/realtime/row_set.hpp"

namespace steadyhand::realtime {

/// Which second derivatives a Newton step uses.
enum class Curvature {
  kExact,   ///< those of the Lagrangian: quadratic convergence, but perhaps no descent far from the solution
  kConvex,  ///< the objectives' positive semidefinite stand-ins, constraints taken as linear: always descent
};

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
/// Points z are tables [q; dq; u] x nodes that obey the dynamics. Allocates only when it is made.
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

  /// Where the Newton step starts: derivatives and residuals at the point.
  const Residuals& differentiate(const NodeTable& z);
  /// Second-order models of all nodes with the slacks eliminated. `damping` is added to the curvature by u.
  void model(Curvature curvature, double damping, NewtonSystem& newton) const;
  /// The slacks' and multipliers' part of a step, and how much of it keeps them positive.
  /// @return dphi along the step; +infinity for a step that is not finite
  double complete(const NodeTable& step);
  double largest_scale() const { return largest_scale_; }

  double merit() const;
  /// phi at z + scale * step with the slacks moved along; infinite where it is not finite.
  double try_step(const NodeTable& z, double scale);
  /// Keeps what try_step tried last; multipliers move as far as they stay positive.
  void accept(double scale);

  /// Violation of all rows at z; rows outside their bounds are watched from now on. `added` tells if any are new.
  double check_all_rows(const NodeTable& z, double tolerance, bool& added);
  double objective_at(const NodeTable& z);
  double curvature_scale() const { return curvature_scale_; }
  /// Multipliers in the order of Solution::multipliers.
  void write_multipliers(std::vector<std::vector<double>>& multipliers) const;

 private:
  static constexpr double kPrice = 1e6;
  static constexpr double kStayInside = 0.995;  ///< largest share of the way to zero that a slack goes in one step

  /// One bound of every row: g = sign * (c - bound).
  struct Side {
    double sign;
    NodeTable room, excess, multiplier;
    NodeTable room_step, excess_step, multiplier_step;
    NodeTable new_room, new_excess;

    Side(double s, const NodeTable& shape)
        : sign(s),
          room(shape),
          excess(shape),
          multiplier(shape),
          room_step(shape),
          excess_step(shape),
          multiplier_step(shape),
          new_room(shape),
          new_excess(shape) {}
    double bound(const Row& row) const { return sign > 0.0 ? row.bounds.lower : row.bounds.upper; }
  };

  void set_point(const NodeTable& z);  ///< with the values of the watched rows
  void set_value(int r);               ///< of row r at the point
  void start_slacks(int r, int k, double multiplier);
  double sum_of_barriers(const NodeTable Side::*room, const NodeTable Side::*excess) const;
  /// Signed multiplier as Solution::multipliers has it.
  double signed_multiplier(int r, int k) const { return sides_[1].multiplier[r][k] - sides_[0].multiplier[r][k]; }

  const Ocp& ocp_;
  int n_, horizon_;
  double dt_;
  Evaluation evaluation_;
  RowSet rows_;
  std::vector<JointVector> unit_curvature_;  ///< of each objective and weight entry: curvature_scale_ is linear in them
  double curvature_scale_ = 1.0;
  double mu_ = 1.0;

  NodeTable value_;  ///< of the rows
  std::array<Side, 2> sides_;
  double objective_ = 0.0;
  std::vector<NodeGradient> gradient_;  ///< of J by z, at each node
  std::vector<NodeGradient> lagrangian_gradient_;
  Residuals residuals_;
  double largest_scale_ = 1.0, largest_dual_scale_ = 1.0;
  const NodeTable* step_ = nullptr;
  NodeTable trial_;
};

}  // namespace steadyhand::realtime

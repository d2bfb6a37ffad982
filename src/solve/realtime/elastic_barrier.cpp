#include "solve/realtime/elastic_barrier.hpp"

#include <cmath>
#include <limits>

namespace steadyhand::realtime {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Mean curvature of one node's Hessian as seen by an acceleration some steps before.
double seen_by_acceleration(const NodeHessian& H, int n, double dt) {
  constexpr double kSteps = 8.0, kSumOfSquares = 170.0;  // sum of k^2, k = 1..8
  const double by_q = H.diagonal().head(n).mean(), by_v = H.diagonal().segment(n, n).mean();
  const double by_u = H.diagonal().tail(n).mean();
  return by_u + kSteps * dt * dt * by_v + kSumOfSquares * dt * dt * dt * dt * by_q;
}

/// How much of a step keeps a positive number positive.
double scale_inside(double value, double step, double share) { return step < 0.0 ? -share * value / step : kInfinity; }

}  // namespace

ElasticBarrier::ElasticBarrier(const Ocp& ocp)
    : ocp_(ocp),
      n_(ocp.dof()),
      horizon_(ocp.horizon()),
      dt_(ocp.dt()),
      evaluation_(ocp),
      rows_(ocp),
      value_(rows_.size(), horizon_ + 1),
      sides_{Side(1.0, value_), Side(-1.0, value_)},
      gradient_(horizon_ + 1, NodeGradient::Zero(3 * n_)),
      lagrangian_gradient_(gradient_),
      trial_(3 * n_, horizon_ + 1) {
  OcpInstance unit;
  unit.x0 = StateVector::Zero(2 * n_);
  unit.x0.head(n_) = ocp.model().home;
  unit.reference.nodes = horizon_;
  unit.reference.p.fill(Vector3::Zero());
  unit.reference.R.fill(Matrix3::Identity());
  for (const auto& objective : ocp.objectives()) unit.weights.push_back(JointVector::Zero(objective->weight_count(n_)));
  evaluation_.set_instance(unit);
  evaluation_.set_node(0, unit.x0, JointVector::Zero(n_));
  evaluation_.set_node(1, unit.x0, JointVector::Zero(n_));
  for (std::size_t i = 0; i < unit.weights.size(); ++i) {
    unit_curvature_.push_back(unit.weights[i]);
    for (int j = 0; j < unit.weights[i].size(); ++j) {
      unit.weights[i][j] = 1.0;
      NodeHessian H = NodeHessian::Zero(3 * n_, 3 * n_);
      evaluation_.add_objective_convex_hessian(ocp.acts(ocp.objectives()[i]->nodes(), 0) ? 0 : 1, 1.0, H);
      unit_curvature_[i][j] = seen_by_acceleration(H, n_, dt_);
      unit.weights[i][j] = 0.0;
    }
  }
}

double ElasticBarrier::begin(const OcpInstance& instance, const NodeTable& z,
                             const std::vector<std::vector<double>>* multipliers, double mu) {
  evaluation_.set_instance(instance);
  mu_ = mu;
  curvature_scale_ = 0.0;
  for (std::size_t i = 0; i < unit_curvature_.size(); ++i) {
    curvature_scale_ += unit_curvature_[i].dot(instance.weights[i]);
  }
  if (curvature_scale_ == 0.0) curvature_scale_ = 1.0;

  set_point(z);
  double violation = 0.0;
  for (int r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    if (!rows_.is_watched(r)) set_value(r);
    for (int k = row.first; k <= row.last; ++k) {
      const double inside = std::min(value_[r][k] - row.bounds.lower, row.bounds.upper - value_[r][k]);
      const double multiplier = multipliers ? (*multipliers)[k][rows_.slot(r, k)] : 0.0;
      violation = std::max(violation, -inside);
      if (inside < row.watch_margin || multiplier != 0.0) rows_.watch(r);
      start_slacks(r, k, multiplier);
    }
  }
  return violation;
}

/// The slacks start far enough from zero to move, the multipliers on the central path or, if that is larger, where they
/// were.
void ElasticBarrier::start_slacks(int r, int k, double multiplier) {
  const Row& row = rows_[r];
  for (Side& side : sides_) {
    const double inside = side.sign * (value_[r][k] - side.bound(row));
    if (!std::isfinite(inside)) continue;
    const double room = std::max(inside, std::min(mu_, 1e-2));
    side.room[r][k] = room;
    side.excess[r][k] = room - inside + mu_ / kPrice;
    side.room[r][k] += mu_ / kPrice;
    side.multiplier[r][k] = std::min(std::max(-side.sign * multiplier, mu_ / room), 0.5 * kPrice);
  }
}

void ElasticBarrier::set_point(const NodeTable& z) {
  StateVector x(2 * n_);
  JointVector u(n_);
  for (int k = 0; k <= horizon_; ++k) {
    for (int i = 0; i < 2 * n_; ++i) x[i] = z[i][k];
    for (int i = 0; i < n_; ++i) u[i] = z[2 * n_ + i][k];
    evaluation_.set_node(k, x, u);
  }
  objective_ = 0.0;
  for (int k = 0; k <= horizon_; ++k) objective_ += evaluation_.objective(k);
  for (const int r : rows_.watched()) set_value(r);
}

void ElasticBarrier::set_value(int r) {
  for (int k = rows_[r].first; k <= rows_[r].last; ++k) value_[r][k] = evaluation_.constraint(k, rows_[r].id);
}

double ElasticBarrier::objective_at(const NodeTable& z) {
  set_point(z);
  return objective_;
}

const Residuals& ElasticBarrier::differentiate(const NodeTable& z) {
  set_point(z);
  residuals_ = {};
  for (int k = 0; k <= horizon_; ++k) {
    gradient_[k].setZero();
    evaluation_.add_objective_gradient(k, 1.0, gradient_[k]);
    lagrangian_gradient_[k] = gradient_[k];
  }
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (int k = row.first; k <= row.last; ++k) {
      evaluation_.add_constraint_gradient(k, row.id, signed_multiplier(r, k), lagrangian_gradient_[k]);
      for (const Side& side : sides_) {
        const double inside = side.sign * (value_[r][k] - side.bound(row));
        if (!std::isfinite(inside)) continue;
        const double multiplier = side.multiplier[r][k];
        residuals_.violation = std::max(residuals_.violation, -inside);
        residuals_.complementarity = std::max(residuals_.complementarity, std::abs(multiplier * inside));
        residuals_.centrality = std::max({residuals_.centrality, std::abs(side.room[r][k] * multiplier - mu_),
                                          std::abs(side.excess[r][k] * (kPrice - multiplier) - mu_)});
      }
    }
  }
  StateVector costate = lagrangian_gradient_[horizon_].head(2 * n_);
  for (int k = horizon_ - 1; k >= 0; --k) {
    const JointVector dL_du =
        lagrangian_gradient_[k].tail(n_) + 0.5 * dt_ * dt_ * costate.head(n_) + dt_ * costate.tail(n_);
    residuals_.dual = std::max(residuals_.dual, dL_du.lpNorm<Eigen::Infinity>());
    costate.tail(n_) += dt_ * costate.head(n_);
    costate += lagrangian_gradient_[k].head(2 * n_);
  }
  return residuals_;
}

// The Newton equations of one bound, with y the multiplier, w = price - y that of excess >= 0, and dg = g' dz:
//   dg + d_excess = d_room,   room dy + y d_room = mu - room y,   -excess dy + w d_excess = mu - excess w.
// So dy = stiffness (offset - dg) with 1 / stiffness = room / y + excess / w and offset = (mu / y - room) - (mu / w -
// excess).

void ElasticBarrier::model(Curvature curvature, double damping, NewtonSystem& newton) const {
  const bool exact = curvature == Curvature::kExact;
  const auto place = [n_ = n_](int i) {
    return i < 2 * n_ ? n_ + i : i - 2 * n_;
  };  // of z = [q; dq; u] in w = [u; q; dq]
  for (int k = 0; k <= horizon_; ++k) {
    NodeHessian H = NodeHessian::Zero(3 * n_, 3 * n_);
    if (exact) {
      evaluation_.add_objective_hessian(k, 1.0, H);
    } else {
      evaluation_.add_objective_convex_hessian(k, 1.0, H);
    }
    NodeGradient g = gradient_[k];
    for (const int r : rows_.watched()) {
      const Row& row = rows_[r];
      if (k < row.first || k > row.last) continue;
      double stiffness = 0.0, force = 0.0;
      for (const Side& side : sides_) {
        if (!std::isfinite(side.bound(row))) continue;
        const double room = side.room[r][k], excess = side.excess[r][k], y = side.multiplier[r][k], w = kPrice - y;
        const double stiff = 1.0 / (room / y + excess / w);
        stiffness += stiff;
        force -= side.sign * (y + stiff * ((mu_ / y - room) - (mu_ / w - excess)));
      }
      if (row.entry >= 0) {
        H(row.entry, row.entry) += stiffness;
        g[row.entry] += force;
        continue;
      }
      NodeGradient gradient = NodeGradient::Zero(3 * n_);
      evaluation_.add_constraint_gradient(k, row.id, 1.0, gradient);
      H.noalias() += stiffness * gradient.lazyProduct(gradient.transpose());
      g += force * gradient;
      if (exact) evaluation_.add_constraint_hessian(k, row.id, signed_multiplier(r, k), H);
    }
    H.diagonal().tail(n_).array() += damping;
    for (int i = 0; i < 3 * n_; ++i) {
      double* row = newton.row(k, place(i));
      for (int j = 0; j < 3 * n_; ++j) row[place(j)] = H(i, j);
      row[3 * n_] = g[i];
    }
  }
}

double ElasticBarrier::complete(const NodeTable& step) {
  step_ = &step;
  largest_scale_ = largest_dual_scale_ = 1.0;
  double slope = 0.0;
  for (int k = 0; k <= horizon_; ++k) {
    for (int i = 0; i < 3 * n_; ++i) slope += gradient_[k][i] * step[i][k];
  }
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (int k = row.first; k <= row.last; ++k) {
      double change = 0.0;
      if (row.entry >= 0) {
        change = step[row.entry][k];
      } else {
        NodeGradient gradient = NodeGradient::Zero(3 * n_);
        evaluation_.add_constraint_gradient(k, row.id, 1.0, gradient);
        for (int i = 0; i < 3 * n_; ++i) change += gradient[i] * step[i][k];
      }
      for (Side& side : sides_) {
        if (!std::isfinite(side.bound(row))) continue;
        const double room = side.room[r][k], excess = side.excess[r][k], y = side.multiplier[r][k], w = kPrice - y;
        const double stiff = 1.0 / (room / y + excess / w);
        const double dy = stiff * ((mu_ / y - room) - (mu_ / w - excess) - side.sign * change);
        const double d_room = mu_ / y - room - room / y * dy, d_excess = mu_ / w - excess + excess / w * dy;
        side.multiplier_step[r][k] = dy;
        side.room_step[r][k] = d_room;
        side.excess_step[r][k] = d_excess;
        slope += kPrice * d_excess - mu_ * (d_room / room + d_excess / excess);
        largest_scale_ = std::min(
            {largest_scale_, scale_inside(room, d_room, kStayInside), scale_inside(excess, d_excess, kStayInside)});
        largest_dual_scale_ =
            std::min({largest_dual_scale_, scale_inside(y, dy, kStayInside), scale_inside(w, -dy, kStayInside)});
      }
    }
  }
  return std::isfinite(slope) ? slope : kInfinity;
}

double ElasticBarrier::sum_of_barriers(const NodeTable Side::*room, const NodeTable Side::*excess) const {
  double sum = 0.0;
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (const Side& side : sides_) {
      if (!std::isfinite(side.bound(row))) continue;
      for (int k = row.first; k <= row.last; ++k) {
        sum += kPrice * (side.*excess)[r][k] - mu_ * std::log((side.*room)[r][k] * (side.*excess)[r][k]);
      }
    }
  }
  return sum;
}

double ElasticBarrier::merit() const { return objective_ + sum_of_barriers(&Side::room, &Side::excess); }

double ElasticBarrier::try_step(const NodeTable& z, double scale) {
  trial_.set_sum(z, scale, *step_);
  set_point(trial_);
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (Side& side : sides_) {
      if (!std::isfinite(side.bound(row))) continue;
      for (int k = row.first; k <= row.last; ++k) {
        double room = side.room[r][k] + scale * side.room_step[r][k];
        double excess = side.excess[r][k] + scale * side.excess_step[r][k];
        // What curvature leaves of g + excess = room goes into the room while there is some, then into the excess.
        const double rest = side.sign * (value_[r][k] - side.bound(row)) + excess - room;
        const double taken = std::max(rest, -0.5 * room);
        room += taken;
        excess -= rest - taken;
        side.new_room[r][k] = room;
        side.new_excess[r][k] = excess;
      }
    }
  }
  const double phi = objective_ + sum_of_barriers(&Side::new_room, &Side::new_excess);
  return std::isfinite(phi) ? phi : kInfinity;
}

void ElasticBarrier::accept(double /*scale*/) {
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (Side& side : sides_) {
      if (!std::isfinite(side.bound(row))) continue;
      for (int k = row.first; k <= row.last; ++k) {
        side.room[r][k] = side.new_room[r][k];
        side.excess[r][k] = side.new_excess[r][k];
        side.multiplier[r][k] += largest_dual_scale_ * side.multiplier_step[r][k];
      }
    }
  }
}

double ElasticBarrier::check_all_rows(const NodeTable& z, double tolerance, bool& added) {
  set_point(z);
  added = false;
  double violation = 0.0;
  for (int r = 0; r < rows_.size(); ++r) {
    if (!rows_.is_watched(r)) set_value(r);
    for (int k = rows_[r].first; k <= rows_[r].last; ++k) {
      const double outside = std::max(rows_[r].bounds.lower - value_[r][k], value_[r][k] - rows_[r].bounds.upper);
      violation = std::max(violation, outside);
      if (outside <= tolerance || rows_.is_watched(r)) continue;
      rows_.watch(r);
      added = true;
      for (int j = rows_[r].first; j <= rows_[r].last; ++j) start_slacks(r, j, 0.0);
    }
  }
  return violation;
}

void ElasticBarrier::write_multipliers(std::vector<std::vector<double>>& multipliers) const {
  for (auto& node : multipliers) std::fill(node.begin(), node.end(), 0.0);
  for (const int r : rows_.watched()) {
    for (int k = rows_[r].first; k <= rows_[r].last; ++k) multipliers[k][rows_.slot(r, k)] = signed_multiplier(r, k);
  }
}

}  // namespace steadyhand::realtime

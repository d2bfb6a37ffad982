#include "solve/realtime/elastic_barrier.hpp"

#include <cmath>
#include <limits>

#include "solve/realtime/log_sum.hpp"

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

/// What each weight of each objective adds to that curvature, at the robot's home.
std::vector<JointVector> unit_curvatures(const Ocp& ocp) {
  const int n = ocp.dof();
  OcpInstance unit;
  unit.x0 = StateVector::Zero(2 * n);
  unit.x0.head(n) = ocp.model().home;
  unit.reference.nodes = ocp.horizon();
  unit.reference.p.fill(Vector3::Zero());
  unit.reference.R.fill(Matrix3::Identity());
  for (const auto& objective : ocp.objectives()) unit.weights.push_back(JointVector::Zero(objective->weight_count(n)));
  Evaluation evaluation(ocp);
  evaluation.set_instance(unit);
  evaluation.set_node(0, unit.x0, JointVector::Zero(n));
  evaluation.set_node(1, unit.x0, JointVector::Zero(n));

  std::vector<JointVector> result = unit.weights;
  for (std::size_t i = 0; i < result.size(); ++i) {
    for (int j = 0; j < result[i].size(); ++j) {
      unit.weights[i][j] = 1.0;
      NodeHessian H = NodeHessian::Zero(3 * n, 3 * n);
      evaluation.add_objective_convex_hessian(ocp.acts(ocp.objectives()[i]->nodes(), 0) ? 0 : 1, 1.0, H);
      result[i][j] = seen_by_acceleration(H, n, ocp.dt());
      unit.weights[i][j] = 0.0;
    }
  }
  return result;
}

}  // namespace

ElasticBarrier::ElasticBarrier(const Ocp& ocp)
    : ocp_(ocp),
      n_(ocp.dof()),
      horizon_(ocp.horizon()),
      dt_(ocp.dt()),
      order_{ocp.horizon()},
      evaluation_(ocp),
      rows_(ocp),
      unit_curvature_(unit_curvatures(ocp)),
      z_(3 * n_, order_),
      value_(rows_.size(), order_),
      sides_{Side(1.0, value_), Side(-1.0, value_)},
      largest_multiplier_(rows_.size(), 0.0),
      gradient_(order_.batches(), NodeGradientOf<Lanes>::Zero(3 * n_)),
      lagrangian_gradient_(gradient_) {
  std::size_t total = 0;
  for (int r = 0; r < rows_.size(); ++r) {
    row_gradient_begin_.push_back(total);
    if (rows_[r].entry < 0) total += static_cast<std::size_t>(support_size(r)) * order_.batches();
  }
  row_gradients_.assign(total, 0.0);
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

  move(z);
  if (multipliers) largest_multipliers(*multipliers);
  double violation = 0.0;
  for (int r = 0; r < rows_.size(); ++r) {
    if (!rows_.is_watched(r)) compute_value(r);
    const double least = least_inside(r);
    violation = std::max(violation, -least);
    if (least < rows_[r].watch_margin || (multipliers && largest_multiplier_[r] > kNoMultiplier)) rows_.watch(r);
    if (rows_.is_watched(r)) start_slacks(r, multipliers);
  }
  return violation;
}

void ElasticBarrier::largest_multipliers(const std::vector<std::vector<double>>& multipliers) {
  std::fill(largest_multiplier_.begin(), largest_multiplier_.end(), 0.0);
  for (int k = 0; k <= horizon_; ++k) {
    for (int r = 0; r < rows_.size(); ++r) {
      if (k < rows_.first(r) || k > rows_.last(r)) continue;
      largest_multiplier_[r] = std::max(largest_multiplier_[r], std::abs(multipliers[k][rows_.slot(r, k)]));
    }
  }
}

/// The slacks start far enough from zero to move, the multipliers on the central path or, if that is larger, where they
/// were.
void ElasticBarrier::start_slacks(int r, const std::vector<std::vector<double>>* multipliers) {
  for (Side& side : sides_) {
    if (!std::isfinite(side.bound(rows_[r]))) continue;
    for (int b = 0; b < evaluation_.batches(); ++b) {
      Lanes given = 0.0;
      for (int i = 0; multipliers && i < kLanes; ++i) {
        const int k = order_.node(b * kLanes + i);
        if (evaluation_.acts(rows_[r].nodes, b)[i] > 0.0) given.set(i, (*multipliers)[k][rows_.slot(r, k)]);
      }
      const Lanes g = inside(side, r, b), room = max(g, std::min(mu_, 1e-2));
      side.room[r][b] = room + mu_ / kPrice;
      side.excess[r][b] = room - g + mu_ / kPrice;
      side.multiplier[r][b] = min(max(-side.sign * given, mu_ / room), 0.5 * kPrice);
    }
  }
}

Lanes ElasticBarrier::inside(const Side& side, int r, int b) const {
  const Lanes g = side.sign * (value(r)[b] - side.bound(rows_[r]));
  return select(evaluation_.acts(rows_[r].nodes, b) > 0.0, g, 1.0);
}

double ElasticBarrier::least_inside(int r) const {
  const Row& row = rows_[r];
  Lanes least = kInfinity;
  for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
    const Lanes v = value(r)[b];
    least = min(least, select(evaluation_.acts(row.nodes, b) > 0.0, min(v - row.bounds.lower, row.bounds.upper - v),
                              kInfinity));
  }
  return -largest(-least);
}

void ElasticBarrier::move(const NodeTable& z) {
  z_ = z;
  evaluation_.set_point(z_);
  objective_ = evaluation_.objective();
  for (const int r : rows_.watched()) compute_value(r);
}

void ElasticBarrier::compute_value(int r) {
  if (rows_[r].entry >= 0) return;
  for (int b = 0; b < evaluation_.acting_batches(rows_[r].nodes); ++b) {
    value_[r][b] = evaluation_.constraint(b, rows_[r].id);
  }
}

Lanes ElasticBarrier::signed_multiplier(int r, int b) const {
  return evaluation_.acts(rows_[r].nodes, b) * (sides_[1].multiplier[r][b] - sides_[0].multiplier[r][b]);
}

const Residuals& ElasticBarrier::differentiate() {
  for (int b = 0; b < evaluation_.batches(); ++b) {
    gradient_[b].setZero();
    evaluation_.add_objective_gradient(b, gradient_[b]);
    lagrangian_gradient_[b] = gradient_[b];
  }
  Lanes violation = 0.0, complementarity = 0.0, centrality = 0.0;
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
      const Lanes multiplier = signed_multiplier(r, b);
      if (row.entry >= 0) {
        lagrangian_gradient_[b][row.entry] += multiplier;
      } else {
        NodeGradientOf<Lanes> gradient(3 * n_);
        gradient.segment(row.support.first, support_size(r)).setZero();
        evaluation_.add_constraint_gradient(b, row.id, gradient);
        for (int i = row.support.first; i < row.support.last; ++i) {
          row_gradient(r, b)[i - row.support.first] = gradient[i];
          lagrangian_gradient_[b][i] += multiplier * gradient[i];
        }
      }
      for (const Side& side : sides_) {
        if (!std::isfinite(side.bound(row))) continue;
        const Lanes g = inside(side, r, b), y = side.multiplier[r][b];
        violation = max(violation, -g);
        complementarity = max(complementarity, abs(y * g));
        centrality = max(centrality, max(abs(side.room[r][b] * y - mu_), abs(side.excess[r][b] * (kPrice - y) - mu_)));
      }
    }
  }
  residuals_ = {0.0, largest(violation), largest(complementarity), largest(centrality)};

  std::array<double, 2 * kMaxJoints> costate{};  // dL/dx_{k+1} of everything from node k + 1 on
  for (int k = horizon_; k >= 0; --k) {
    const int b = order_.column(k) / kLanes, lane = order_.column(k) % kLanes;
    const NodeGradientOf<Lanes>& gradient = lagrangian_gradient_[b];
    for (int i = 0; i < n_; ++i) {
      double &by_q = costate[i], &by_v = costate[n_ + i];
      if (k < horizon_) {
        const double by_u = gradient[2 * n_ + i][lane] + 0.5 * dt_ * dt_ * by_q + dt_ * by_v;
        residuals_.dual = std::max(residuals_.dual, std::abs(by_u));
      }
      by_v += dt_ * by_q + gradient[n_ + i][lane];
      by_q += gradient[i][lane];
    }
  }
  return residuals_;
}

// The Newton equations of one bound, with y the multiplier, w = price - y that of excess >= 0, and dg = g' dz:
//   dg + d_excess = d_room,   room dy + y d_room = mu - room y,   -excess dy + w d_excess = mu - excess w.
// So dy = stiffness (offset - dg) with 1 / stiffness = room / y + excess / w and offset = (mu / y - room) - (mu / w -
// excess).

void ElasticBarrier::model(Curvature curvature, double damping, NewtonSystem& newton) {
  const bool exact = curvature == Curvature::kExact;
  for (int b = 0; b < evaluation_.batches(); ++b) {
    NodeHessianOf<Lanes> H = NodeHessianOf<Lanes>::Zero(3 * n_, 3 * n_);
    evaluation_.add_objective_hessian(b, curvature, H);
    NodeGradientOf<Lanes> g = gradient_[b];
    for (const int r : rows_.watched()) {
      const Row& row = rows_[r];
      if (b >= evaluation_.acting_batches(row.nodes)) continue;
      Lanes stiffness = 0.0, force = 0.0;
      for (Side& side : sides_) {
        if (!std::isfinite(side.bound(row))) continue;
        const Lanes room = side.room[r][b], excess = side.excess[r][b], y = side.multiplier[r][b], w = kPrice - y;
        const Lanes yw = y * w, stiff = yw / (room * w + excess * y);
        const Lanes offset = mu_ * (w - y) / yw - room + excess;
        side.stiffness[r][b] = stiff;
        side.offset[r][b] = offset;
        stiffness += stiff;
        force -= side.sign * (y + stiff * offset);
      }
      const Lanes& acts = evaluation_.acts(row.nodes, b);
      stiffness *= acts;
      force *= acts;
      if (row.entry >= 0) {
        H(row.entry, row.entry) += stiffness;
        g[row.entry] += force;
        continue;
      }
      const Lanes* gradient = row_gradient(r, b);
      const int first = row.support.first, size = support_size(r);
      for (int j = 0; j < size; ++j) {
        const Lanes scaled = stiffness * gradient[j];
        for (int i = 0; i <= j; ++i) H(first + i, first + j) += scaled * gradient[i];
        g[first + j] += force * gradient[j];
      }
      const Lanes multiplier = signed_multiplier(r, b);
      if (exact && largest(abs(multiplier)) > kNoMultiplier) {
        evaluation_.add_constraint_hessian(b, row.id, multiplier, H);
      }
    }
    for (int i = 2 * n_; i < 3 * n_; ++i) H(i, i) += damping;
    write_model(b, H, g, newton);
  }
}

void ElasticBarrier::write_model(int b, const NodeHessianOf<Lanes>& H, const NodeGradientOf<Lanes>& g,
                                 NewtonSystem& newton) const {
  const int lanes = std::min(kLanes, horizon_ + 1 - b * kLanes);  // without padding
  std::array<double*, kLanes> models;
  for (int i = 0; i < lanes; ++i) models[i] = newton.row(order_.node(b * kLanes + i), 0);
  const auto z_entry = [n = n_](int i) { return i < n ? 2 * n + i : i - n; };  // of w = [u; q; dq]
  for (int i = 0; i < 3 * n_; ++i) {
    const int row = i * newton.width();
    for (int j = i; j < 3 * n_; ++j) {
      const auto [first, second] = std::minmax({z_entry(i), z_entry(j)});
      const Lanes& numbers = H(first, second);
      for (int lane = 0; lane < lanes; ++lane) models[lane][row + j] = numbers[lane];
    }
    const Lanes& numbers = g[z_entry(i)];
    for (int lane = 0; lane < lanes; ++lane) models[lane][row + 3 * n_] = numbers[lane];
  }
}

double ElasticBarrier::complete(const NodeTable& step) {
  step_ = &step;
  Lanes slope = 0.0, shrink = 0.0, dual_shrink = 0.0;  // largest relative decrease of a slack, of a multiplier
  for (int i = 0; i < 3 * n_; ++i) {
    for (int b = 0; b < evaluation_.batches(); ++b) slope += gradient_[b][i] * step[i][b];
  }
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
      Lanes change = 0.0;
      if (row.entry >= 0) {
        change = step[row.entry][b];
      } else {
        const Lanes* gradient = row_gradient(r, b);
        for (int i = row.support.first; i < row.support.last; ++i) change += *gradient++ * step[i][b];
      }
      change *= evaluation_.acts(row.nodes, b);
      for (Side& side : sides_) {
        if (!std::isfinite(side.bound(row))) continue;
        const Lanes room = side.room[r][b], excess = side.excess[r][b], y = side.multiplier[r][b], w = kPrice - y;
        const Lanes dy = side.stiffness[r][b] * (side.offset[r][b] - side.sign * change);
        const Lanes by_multipliers = 1.0 / (y * w), by_slacks = 1.0 / (room * excess);
        const Lanes d_room = (mu_ - room * dy) * (w * by_multipliers) - room;
        const Lanes d_excess = (mu_ + excess * dy) * (y * by_multipliers) - excess;
        side.multiplier_step[r][b] = dy;
        side.room_step[r][b] = d_room;
        side.excess_step[r][b] = d_excess;
        const Lanes grow_room = d_room * (excess * by_slacks), grow_excess = d_excess * (room * by_slacks);
        slope += kPrice * d_excess - mu_ * (grow_room + grow_excess);
        shrink = max(shrink, max(-grow_room, -grow_excess));
        dual_shrink = max(dual_shrink, max(-dy * (w * by_multipliers), dy * (y * by_multipliers)));
      }
    }
  }
  largest_scale_ = std::min(1.0, kStayInside / largest(shrink));
  largest_dual_scale_ = std::min(1.0, kStayInside / largest(dual_shrink));
  const double total = sum(slope);
  return std::isfinite(total) ? total : kInfinity;
}

double ElasticBarrier::sum_of_barriers(const NodeTable Side::*room, const NodeTable Side::*excess) const {
  Lanes price = 0.0;
  LogSum logs;
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (const Side& side : sides_) {
      if (!std::isfinite(side.bound(row))) continue;
      for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
        price += (side.*excess)[r][b];
        logs.add((side.*room)[r][b] * (side.*excess)[r][b]);
      }
    }
  }
  return kPrice * sum(price) - mu_ * logs.value();
}

double ElasticBarrier::merit() const { return objective_ + sum_of_barriers(&Side::room, &Side::excess); }

double ElasticBarrier::try_step(const NodeTable& z, double scale) {
  z_.set_sum(z, scale, *step_);
  evaluation_.set_point(z_);
  objective_ = evaluation_.objective();
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    compute_value(r);
    for (Side& side : sides_) {
      if (!std::isfinite(side.bound(row))) continue;
      for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
        const Lanes room = side.room[r][b] + scale * side.room_step[r][b];
        const Lanes excess = side.excess[r][b] + scale * side.excess_step[r][b];
        // What curvature leaves of g + excess = room goes into the room while there is some, then into the excess.
        const Lanes rest = inside(side, r, b) + excess - room, taken = max(rest, -0.5 * room);
        side.new_room[r][b] = room + taken;
        side.new_excess[r][b] = excess - (rest - taken);
      }
    }
  }
  const double phi = objective_ + sum_of_barriers(&Side::new_room, &Side::new_excess);
  return std::isfinite(phi) ? phi : kInfinity;
}

void ElasticBarrier::accept() {
  for (const int r : rows_.watched()) {
    const Row& row = rows_[r];
    for (Side& side : sides_) {
      if (!std::isfinite(side.bound(row))) continue;
      for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
        side.room[r][b] = side.new_room[r][b];
        side.excess[r][b] = side.new_excess[r][b];
        side.multiplier[r][b] += largest_dual_scale_ * side.multiplier_step[r][b];
      }
    }
  }
}

double ElasticBarrier::check_all_rows(double tolerance, bool& added) {
  added = false;
  double violation = 0.0;
  for (int r = 0; r < rows_.size(); ++r) {
    if (!rows_.is_watched(r)) compute_value(r);
    const double outside = -least_inside(r);
    violation = std::max(violation, outside);
    if (outside <= tolerance || rows_.is_watched(r)) continue;
    rows_.watch(r);
    start_slacks(r, nullptr);
    added = true;
  }
  return violation;
}

void ElasticBarrier::write_multipliers(std::vector<std::vector<double>>& multipliers) const {
  for (auto& node : multipliers) std::fill(node.begin(), node.end(), 0.0);
  for (const int r : rows_.watched()) {
    for (int k = rows_.first(r); k <= rows_.last(r); ++k) {
      const int column = order_.column(k);
      multipliers[k][rows_.slot(r, k)] = signed_multiplier(r, column / kLanes)[column % kLanes];
    }
  }
}

}  // namespace steadyhand::realtime

#include "steadyhand/solve/realtime/elastic_barrier.hpp"

#include <cmath>
#include <limits>

#include "steadyhand/solve/realtime/log_sum.hpp"

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
      values_(rows_.size(), order_),
      bands_(order_.batches()),
      largest_multiplier_(rows_.size(), 0.0),
      gradient_(order_.batches(), NodeGradientOf<Lanes>::Zero(3 * n_)),
      lagrangian_gradient_(gradient_) {
  for (auto& batch : bands_) batch.reserve(rows_.size());
  std::size_t gradients = 0;
  for (int r = 0; r < rows_.size(); ++r) gradients += rows_[r].support.last - rows_[r].support.first;
  gradients_.reserve(gradients * order_.batches());
}

void ElasticBarrier::begin(const OcpInstance& instance, const NodeTable& z,
                           const std::vector<std::vector<double>>* multipliers) {
  evaluation_.set_instance(instance);
  curvature_scale_ = 0.0;
  for (std::size_t i = 0; i < unit_curvature_.size(); ++i) {
    curvature_scale_ += unit_curvature_[i].dot(instance.weights[i]);
  }
  if (curvature_scale_ == 0.0) curvature_scale_ = 1.0;

  for (auto& batch : bands_) batch.clear();
  gradients_.clear();
  z_ = z;
  set_point();
  compute_all_rows();
  if (multipliers) find_largest_multipliers(*multipliers);
  Lanes violation = 0.0;
  for (int r = 0; r < rows_.size(); ++r) {
    const Lanes least = least_inside(r);
    violation = max(violation, -least);
    if (rows_.is_watched(r) || any(least < rows_[r].watch_margin) ||
        (multipliers && largest_multiplier_[r] > kNoMultiplier)) {
      watch(r, multipliers);
    }
  }
  violation_ = largest(violation);
}

void ElasticBarrier::set_point() {
  evaluation_.set_point(z_);
  objective_ = evaluation_.objective();
}

void ElasticBarrier::compute_all_rows() {
  for (int b = 0; b < evaluation_.batches(); ++b) {
    int r = 0;
    for (int c = 0; c < std::ssize(ocp_.constraints()); ++c) {
      const Constraint& constraint = *ocp_.constraints()[c];
      if (b < evaluation_.acting_batches(constraint.nodes())) {
        evaluation_.constraints(b, c, values_[r] + b, values_.batches());
      }
      r += constraint.rows();
    }
  }
}

/// Smallest distance of row r to its bounds in each lane, over the batches; negative outside.
Lanes ElasticBarrier::least_inside(int r) const {
  const Row& row = rows_[r];
  Lanes least = kInfinity;
  for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
    const Lanes v = values_[r][b], here = min(v - row.bounds.lower, row.bounds.upper - v);
    least = min(least, select(evaluation_.acts(row.nodes, b) > 0.0, here, kInfinity));
  }
  return least;
}

void ElasticBarrier::find_largest_multipliers(const std::vector<std::vector<double>>& multipliers) {
  std::fill(largest_multiplier_.begin(), largest_multiplier_.end(), 0.0);
  for (int k = 0; k <= horizon_; ++k) {
    const double* here = multipliers[k].data();
    if (k > 0 && k < horizon_) {  // all rows, in their order
      for (int r = 0; r < rows_.size(); ++r) {
        largest_multiplier_[r] = std::max(largest_multiplier_[r], std::abs(here[r]));
      }
    } else {
      for (int r = 0; r < rows_.size(); ++r) {
        if (k < rows_.first(r) || k > rows_.last(r)) continue;
        largest_multiplier_[r] = std::max(largest_multiplier_[r], std::abs(here[rows_.slot(r, k)]));
      }
    }
  }
}

void ElasticBarrier::watch(int r, const std::vector<std::vector<double>>* multipliers) {
  rows_.watch(r);
  const Row& row = rows_[r];
  for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
    Band& band = bands_[b].emplace_back();
    band.row = r;
    band.entry = row.entry;
    band.support = row.support;
    band.acts = evaluation_.acts(row.nodes, b);
    band.value = values_[r][b];
    band.side_count = 0;
    band.gradient = gradients_.size();
    if (row.entry < 0) gradients_.resize(gradients_.size() + row.support.last - row.support.first);

    Lanes given = 0.0;
    for (int i = 0; multipliers && i < kLanes; ++i) {
      const int k = order_.node(b * kLanes + i);
      if (band.acts[i] > 0.0) given.set(i, (*multipliers)[k][rows_.slot(r, k)]);
    }
    for (const double sign : {1.0, -1.0}) {
      const double limit = sign > 0.0 ? row.bounds.lower : row.bounds.upper;
      if (!std::isfinite(limit)) continue;
      Side& side = band.sides[band.side_count++];
      side.sign = sign;
      side.limit = limit;
      side.multiplier = max(-sign * given, 0.0);
      side.room = side.excess = 1.0;
    }
  }
}

void ElasticBarrier::start_slacks(double mu) {
  mu_ = mu;
  for_each_band([&](Band& band, int) { start_slacks(band); });
}

void ElasticBarrier::start_slacks(Band& band) const {
  for (int i = 0; i < band.side_count; ++i) {
    Side& side = band.sides[i];
    const Lanes g = band.inside(side), room = max(g, std::min(mu_, 1e-2));
    side.room = room + mu_ / kPrice;
    side.excess = room - g + mu_ / kPrice;
    side.multiplier = min(max(side.multiplier, mu_ / room), 0.5 * kPrice);
  }
}

Lanes ElasticBarrier::compute(const Band& band, int b) const {
  return band.entry >= 0 ? z_[band.entry][b] : evaluation_.constraint(b, rows_[band.row].id);
}

void ElasticBarrier::move(const NodeTable& z) {
  z_ = z;
  set_point();
  for_each_band([&](Band& band, int b) { band.value = compute(band, b); });
}

const Residuals& ElasticBarrier::differentiate() {
  Lanes violation = 0.0, complementarity = 0.0, centrality = 0.0;
  for (int b = 0; b < evaluation_.batches(); ++b) {
    gradient_[b].setZero();
    evaluation_.add_objective_gradient(b, gradient_[b]);
    NodeGradientOf<Lanes>& lagrangian = lagrangian_gradient_[b];
    lagrangian = gradient_[b];
    for (Band& band : bands_[b]) {
      const Lanes multiplier = band.signed_multiplier();
      if (band.entry >= 0) {
        lagrangian[band.entry] += multiplier;
      } else {
        const auto [first, last] = band.support;
        NodeGradientOf<Lanes> gradient(3 * n_);
        gradient.segment(first, last - first).setZero();
        evaluation_.add_constraint_gradient(b, rows_[band.row].id, gradient);
        for (int i = first; i < last; ++i) {
          gradients_[band.gradient + i - first] = gradient[i];
          lagrangian[i] += multiplier * gradient[i];
        }
      }
      for (int i = 0; i < band.side_count; ++i) {
        const Side& side = band.sides[i];
        const Lanes g = band.inside(side), y = side.multiplier;
        violation = max(violation, -g);
        complementarity = max(complementarity, abs(y * g));
        centrality = max(centrality, max(abs(side.room * y - mu_), abs(side.excess * (kPrice - y) - mu_)));
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
  for (int b = 0; b < evaluation_.batches(); ++b) {
    NodeHessianOf<Lanes> H = NodeHessianOf<Lanes>::Zero(3 * n_, 3 * n_);
    evaluation_.add_objective_hessian(b, curvature, H);
    NodeGradientOf<Lanes> g = gradient_[b];
    for (Band& band : bands_[b]) {
      Lanes stiffness = 0.0, force = 0.0;
      for (int i = 0; i < band.side_count; ++i) {
        Side& side = band.sides[i];
        const Lanes y = side.multiplier, w = kPrice - y, yw = y * w;
        side.stiffness = yw / (side.room * w + side.excess * y);
        side.offset = mu_ * (w - y) / yw - side.room + side.excess;
        stiffness += side.stiffness;
        force -= side.sign * (y + side.stiffness * side.offset);
      }
      stiffness *= band.acts;
      force *= band.acts;
      if (band.entry >= 0) {
        H(band.entry, band.entry) += stiffness;
        g[band.entry] += force;
        continue;
      }
      const Lanes* gradient = gradients_.data() + band.gradient;
      const int first = band.support.first, size = band.support.last - first;
      for (int j = 0; j < size; ++j) {
        const Lanes scaled = stiffness * gradient[j];
        for (int i = 0; i <= j; ++i) H(first + i, first + j) += scaled * gradient[i];
        g[first + j] += force * gradient[j];
      }
      const Lanes multiplier = band.signed_multiplier();
      if (curvature == Curvature::kExact && any(abs(multiplier) > kNoMultiplier)) {
        evaluation_.add_constraint_hessian(b, rows_[band.row].id, multiplier, H);
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
  for_each_band([&](Band& band, int b) {
    Lanes change = 0.0;
    if (band.entry >= 0) {
      change = step[band.entry][b];
    } else {
      const Lanes* gradient = gradients_.data() + band.gradient;
      for (int i = band.support.first; i < band.support.last; ++i) change += *gradient++ * step[i][b];
    }
    change *= band.acts;
    for (int i = 0; i < band.side_count; ++i) {
      Side& side = band.sides[i];
      const Lanes room = side.room, excess = side.excess, y = side.multiplier, w = kPrice - y;
      const Lanes dy = side.stiffness * (side.offset - side.sign * change);
      const Lanes by_multipliers = 1.0 / (y * w), by_slacks = 1.0 / (room * excess);
      side.multiplier_step = dy;
      side.room_step = (mu_ - room * dy) * (w * by_multipliers) - room;
      side.excess_step = (mu_ + excess * dy) * (y * by_multipliers) - excess;
      const Lanes room_growth = side.room_step * (excess * by_slacks);
      const Lanes excess_growth = side.excess_step * (room * by_slacks);
      slope += kPrice * side.excess_step - mu_ * (room_growth + excess_growth);
      shrink = max(shrink, -min(room_growth, excess_growth));
      dual_shrink = max(dual_shrink, max(-dy * (w * by_multipliers), dy * (y * by_multipliers)));
    }
  });
  largest_scale_ = std::min(1.0, kStayInside / largest(shrink));
  largest_dual_scale_ = std::min(1.0, kStayInside / largest(dual_shrink));
  const double total = sum(slope);
  return std::isfinite(total) ? total : kInfinity;
}

double ElasticBarrier::phi(Lanes excess, double logarithms) const {
  const double result = objective_ + kPrice * sum(excess) - mu_ * logarithms;
  return std::isfinite(result) ? result : kInfinity;
}

double ElasticBarrier::merit() {
  Lanes excess = 0.0;
  LogSum logarithms;
  for_each_band([&](const Band& band, int) {
    for (int i = 0; i < band.side_count; ++i) {
      excess += band.sides[i].excess;
      logarithms.add(band.sides[i].room * band.sides[i].excess);
    }
  });
  return phi(excess, logarithms.value());
}

double ElasticBarrier::try_step(const NodeTable& z, double scale) {
  z_.set_sum(z, scale, *step_);
  set_point();
  Lanes sum_of_excess = 0.0;
  LogSum logarithms;
  for_each_band([&](Band& band, int b) {
    band.value = compute(band, b);
    for (int i = 0; i < band.side_count; ++i) {
      Side& side = band.sides[i];
      const Lanes room = side.room + scale * side.room_step, excess = side.excess + scale * side.excess_step;
      // What curvature leaves of g + excess = room goes into the room while there is some, then into the excess.
      const Lanes rest = band.inside(side) + excess - room, taken = max(rest, -0.5 * room);
      side.new_room = room + taken;
      side.new_excess = excess - (rest - taken);
      sum_of_excess += side.new_excess;
      logarithms.add(side.new_room * side.new_excess);
    }
  });
  return phi(sum_of_excess, logarithms.value());
}

void ElasticBarrier::accept() {
  for_each_band([&](Band& band, int) {
    for (int i = 0; i < band.side_count; ++i) {
      Side& side = band.sides[i];
      side.room = side.new_room;
      side.excess = side.new_excess;
      side.multiplier += largest_dual_scale_ * side.multiplier_step;
    }
  });
}

ElasticBarrier::Check ElasticBarrier::check_all_rows(double tolerance) {
  compute_all_rows();
  Check result = Check::kNothingNew;
  Lanes violation = 0.0;
  for (int r = 0; r < rows_.size(); ++r) {
    const Lanes outside = -least_inside(r);
    violation = max(violation, outside);
    if (rows_.is_watched(r) || !any(outside > tolerance)) continue;
    watch(r, nullptr);
    for (int b = 0; b < evaluation_.acting_batches(rows_[r].nodes); ++b) start_slacks(bands_[b].back());
    if (rows_[r].entry < 0) result = Check::kMissed;
    if (result == Check::kNothingNew) result = Check::kMissedLinear;
  }
  violation_ = largest(violation);
  return result;
}

void ElasticBarrier::write_multipliers(std::vector<std::vector<double>>& multipliers) const {
  for (auto& node : multipliers) std::fill(node.begin(), node.end(), 0.0);
  for (int b = 0; b < evaluation_.batches(); ++b) {
    for (const Band& band : bands_[b]) {
      const Lanes numbers = band.signed_multiplier();
      for (int i = 0; i < kLanes; ++i) {
        const int k = order_.node(b * kLanes + i);
        if (band.acts[i] > 0.0) multipliers[k][rows_.slot(band.row, k)] = numbers[i];
      }
    }
  }
}

}  // namespace steadyhand::realtime

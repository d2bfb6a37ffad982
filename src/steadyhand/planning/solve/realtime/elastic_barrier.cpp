#include "steadyhand/planning/solve/realtime/elastic_barrier.hpp"

#include <cmath>
#include <limits>

#include "steadyhand/planning/solve/realtime/log_sum.hpp"

namespace steadyhand::realtime {
namespace {

using std::abs;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Whether all its rows are limits or always in the working set.
bool needs_no_watch(const Constraint& constraint) {
  for (int row = 0; row < constraint.rows(); ++row) {
    if (constraint.entry(row) < 0 && std::isfinite(constraint.activation_margin(row))) return false;
  }
  return true;
}

}  // namespace

ElasticBarrier::ElasticBarrier(const Ocp& ocp)
    : ocp_(ocp),
      n_(ocp.dof()),
      entries_(ocp.entries()),
      order_{ocp.horizon()},
      evaluation_(ocp),
      rows_(ocp),
      curvature_(ocp),
      watch_{JointVector::Zero(ocp.dof()), true, NodeTable(entries_, order_), std::vector<char>(rows_.size(), 0)},
      z_(watch_.begun),
      blocks_(order_.batches()),
      gradient_(order_.batches(), NodeGradientOf<Lanes>::Zero(entries_)),
      lagrangian_gradient_(gradient_),
      model_{NodeHessianOf<Lanes>(entries_, entries_), {}},
      slosh_{false, NodeHessianOf<Lanes>(3 * n_, 3 * n_), {}} {
  for (int t = 0; ocp.liquid() && t < ocp.tool_count(); ++t) slosh_.costates[t].resize(ocp.horizon());
  for (const auto& constraint : ocp.constraints()) {
    if (needs_no_watch(*constraint)) continue;
    const JointVector levers = constraint->levers();
    watch_.all_known = watch_.all_known && levers.size() == n_;
    if (levers.size() == n_) watch_.levers = watch_.levers.cwiseMax(levers);
  }
  for (int r = 0; r < rows_.size(); ++r) {
    first_bounds_.push_back(rows_[r].bounds);
    if (rows_[r].nodes == Nodes::kIntervals) interval_rows_.push_back(r);
  }
  given_rows_.reserve(rows_.size());
  for (auto& batch : blocks_) batch.reserve(rows_.size());
  std::size_t gradients = 0;
  for (int r = 0; r < rows_.size(); ++r) gradients += rows_[r].support.last - rows_[r].support.first;
  gradients_.reserve(gradients * order_.batches());
}

void ElasticBarrier::begin(const OcpInstance& instance, const NodeTable& z, const Multipliers* multipliers) {
  evaluation_.set_instance(instance);
  slosh_.counts = false;
  for (int t = 0; ocp_.liquid() && t < ocp_.tool_count(); ++t)
    slosh_.counts = slosh_.counts || instance.liquid[t].counts;
  entries_ = slosh_.counts ? ocp_.entries() : 3 * n_;
  model_.gradient.resize(entries_);
  for (auto& gradient : gradient_) gradient.resize(entries_);
  curvature_scale_ = curvature_.of(instance.weights);
  given_ = instance.given;
  given_rows_.clear();
  for (int r = 0; given_.any() && r < rows_.size(); ++r)
    if (ocp_.is_given(instance, rows_[r].id)) given_rows_.push_back(r);

  for (auto& batch : blocks_) batch.clear();
  gradients_.clear();
  z_ = z;
  set_point();
  find_near();
  if (multipliers) {
    for (const int r : multipliers->stored()) {
      if (rows_[r].support.last > entries_) continue;  // a row of a liquid that no longer counts
      watch_.near[r] |= static_cast<char>(had_multiplier(*multipliers, r));
    }
  }
  for (const int r : rows_.working_set()) watch_.near[r] = 1;
  narrow_first(instance.x0);
  forget_given();
  for_each_near([&](int r) { work_on(r, multipliers); });
  violation_ = violation_of_blocks();
  watch_.begun = z_;
}

void ElasticBarrier::narrow_first(const StateVector& x0) {
  for (const int r : interval_rows_) {
    const Row& row = rows_[r];
    first_bounds_[r] = ocp_.constraints()[row.id.constraint]->first_bounds(x0, row.id.row);
    if (first_bounds_[r].lower > row.bounds.lower || first_bounds_[r].upper < row.bounds.upper) watch_.near[r] = 1;
  }
}

void ElasticBarrier::watch() {
  if (stayed_near(0.5)) return;
  find_near();
  for_each_near([&](int r) {
    if (!rows_.in_working_set(r)) take(r);
  });
  watch_.begun = z_;
}

bool ElasticBarrier::stayed_near(double share) const {
  for (int b = 0; b < evaluation_.acting_batches(Nodes::kStates); ++b) {
    Lanes moved = 0.0;
    for (int i = 0; i < n_; ++i) moved += watch_.levers[i] * abs(z_[i][b] - watch_.begun[i][b]);
    if (any(moved > share)) return false;
  }
  return true;
}

void ElasticBarrier::set_point() {
  differentiated_ = false;
  evaluation_.set_point(z_);
  objective_ = evaluation_.objective();
}

void ElasticBarrier::find_near() {
  std::fill(watch_.near.begin(), watch_.near.end(), 0);
  for (int c = 0, first = 0; c < std::ssize(ocp_.constraints()); ++c) {
    const Constraint& constraint = *ocp_.constraints()[c];
    for (int b = 0; b < evaluation_.acting_batches(constraint.nodes()); ++b) {
      evaluation_.find_near(b, c, watch_.near.data() + first);
    }
    first += constraint.rows();
  }
  forget_given();
}

void ElasticBarrier::forget_given() {
  for (const int r : given_rows_) watch_.near[r] = 0;
}

double ElasticBarrier::violation_of_blocks() const {
  Lanes violation = 0.0;
  for (const auto& batch : blocks_) {
    for (const RowBlock& block : batch) {
      for (int i = 0; !block.soft && i < block.side_count; ++i) {
        violation = max(violation, -block.inside(block.sides[i]));
      }
    }
  }
  return largest(violation);
}

bool ElasticBarrier::had_multiplier(const Multipliers& multipliers, int r) const {
  const double* numbers = multipliers.find(r);
  return numbers &&
         std::any_of(numbers, numbers + ocp_.horizon() + 1, [](double m) { return std::abs(m) > kNoMultiplier; });
}

void ElasticBarrier::work_on(int r, const Multipliers* multipliers) {
  rows_.add(r);
  const Row& row = rows_[r];
  merit_known_ = false;
  if (row.entry < 0) differentiated_ = false;
  const double* known = multipliers ? multipliers->find(r) : nullptr;
  for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
    RowBlock& block = blocks_[b].emplace_back();
    block.row = r;
    block.entry = row.entry;
    block.support = row.support;
    block.soft = row.soft();
    block.price = block.soft ? row.price : kPenalty;
    block.acts = evaluation_.acts(row.nodes, b);
    block.value = compute(block, b);
    block.side_count = 0;
    block.gradient = gradients_.size();
    if (row.entry < 0) gradients_.resize(gradients_.size() + row.support.last - row.support.first);

    Lanes given = 0.0;
    for (int i = 0; known && i < kLanes; ++i) {
      if (block.acts[i] > 0.0) given.set(i, known[order_.node(b * kLanes + i)]);
    }
    for (const double sign : {1.0, -1.0}) {
      const double limit = sign > 0.0 ? row.bounds.lower : row.bounds.upper;
      if (!std::isfinite(limit)) continue;
      RowSide& side = block.sides[block.side_count++];
      side.sign = sign;
      side.limit = limit;
      for (int i = 0; i < kLanes; ++i) {
        if (order_.node(b * kLanes + i) != 0) continue;
        side.limit.set(i, sign > 0.0 ? first_bounds_[r].lower : first_bounds_[r].upper);
      }
      side.multiplier = max(-sign * given, 0.0);
      side.slack = side.elastic = 1.0;
    }
  }
}

void ElasticBarrier::take(int r) {
  work_on(r, nullptr);
  for (int b = 0; b < evaluation_.acting_batches(rows_[r].nodes); ++b) {
    start_slacks(blocks_[b].back());
  }
}

void ElasticBarrier::start_slacks(double mu) {
  mu_ = mu;
  merit_known_ = false;
  for_each_block([&](RowBlock& block, int) { start_slacks(block); });
}

void ElasticBarrier::start_slacks(RowBlock& block) const {
  for (int i = 0; i < block.side_count; ++i) {
    RowSide& side = block.sides[i];
    const Lanes g = block.inside(side), slack = max(g, std::min(mu_, 1e-2));
    side.slack = slack + mu_ / block.price;
    side.elastic = slack - g + mu_ / block.price;
    side.multiplier = min(max(side.multiplier, mu_ / slack), 0.5 * block.price);
  }
}

Lanes ElasticBarrier::compute(const RowBlock& block, int b) const {
  return block.entry >= 0 ? z_[block.entry][b] : evaluation_.constraint(b, rows_[block.row].id);
}

void ElasticBarrier::move(const NodeTable& z) {
  z_ = z;
  set_point();
  for_each_block([&](RowBlock& block, int b) { block.value = compute(block, b); });
}

void ElasticBarrier::differentiate_terms() {
  if (differentiated_) return;
  for (int b = 0; b < evaluation_.batches(); ++b) {
    gradient_[b].setZero();
    evaluation_.add_objective_gradient(b, gradient_[b]);
    for (const RowBlock& block : blocks_[b]) {
      if (block.entry >= 0) continue;
      const auto [first, last] = block.support;
      NodeGradientOf<Lanes> gradient(entries_);
      gradient.segment(first, last - first).setZero();
      evaluation_.add_constraint_gradient(b, rows_[block.row].id, gradient);
      std::copy_n(gradient.data() + first, last - first, gradients_.data() + block.gradient);
    }
  }
  if (slosh_.counts) evaluation_.differentiate_slosh(z_);
  differentiated_ = true;
}

void ElasticBarrier::set_mu(double mu) {
  mu_ = mu;
  Lanes centrality = 0.0;
  for_each_block([&](const RowBlock& block, int) {
    for (int i = 0; i < block.side_count; ++i) centrality = max(centrality, off_centre(block, block.sides[i]));
  });
  residuals_.centrality = largest(centrality);
}

/// How far the products of a bound are from mu.
Lanes ElasticBarrier::off_centre(const RowBlock& block, const RowSide& side) const {
  return max(abs(side.slack * side.multiplier - mu_), abs(side.elastic * (block.price - side.multiplier) - mu_));
}

const Residuals& ElasticBarrier::differentiate() {
  differentiate_terms();
  Lanes violation = 0.0, complementarity = 0.0, centrality = 0.0;
  for (int b = 0; b < evaluation_.batches(); ++b) {
    NodeGradientOf<Lanes>& lagrangian = lagrangian_gradient_[b];
    lagrangian = gradient_[b];
    for (const RowBlock& block : blocks_[b]) {
      const Lanes multiplier = block.signed_multiplier();
      if (block.entry >= 0) {
        lagrangian[block.entry] += multiplier;
      } else {
        const Lanes* gradient = gradients_.data() + block.gradient;
        for (int i = block.support.first; i < block.support.last; ++i) lagrangian[i] += multiplier * *gradient++;
      }
      for (int i = 0; i < block.side_count; ++i) {
        const RowSide& side = block.sides[i];
        const Lanes g = block.inside(side), y = side.multiplier, w = block.price - y;
        if (block.soft) {
          complementarity = max(complementarity, max(y * g, -(w * g)));
        } else {
          violation = max(violation, -g);
          complementarity = max(complementarity, abs(y * g));
        }
        centrality = max(centrality, off_centre(block, side));
      }
    }
  }
  residuals_ = {0.0, largest(violation), largest(complementarity), largest(centrality)};

  const double dt = ocp_.dt();
  std::array<double, 2 * kMaxJoints> costate{};  // dL/dx_{k+1} of everything from node k + 1 on
  std::array<SloshState, kMaxTools> slosh;       // the same by the state of each tool's liquid
  slosh.fill(SloshState::Zero());
  const int liquids = slosh_.counts ? ocp_.tool_count() : 0;
  for (int k = ocp_.horizon(); k >= 0; --k) {
    const int b = order_.column(k) / kLanes, lane = order_.column(k) % kLanes;
    NodeGradient gradient(entries_);
    for (int i = 0; i < entries_; ++i) gradient[i] = lagrangian_gradient_[b][i][lane];
    for (int t = 0; t < liquids; ++t) {
      if (k < ocp_.horizon()) {
        const SloshStep& step = evaluation_.slosh_steps(t)[k];
        slosh_.costates[t][k] = slosh[t];
        const Vector3 by_force = step.by_force.transpose() * slosh[t];
        for (int i = 0; i < 3 * n_; ++i) gradient[i] += step.by_motion.col(i).dot(by_force);
        slosh[t] = step.pull_back(slosh[t]);
      }
      slosh[t] += gradient.segment<kSloshStates>(slosh_begin(n_, t));
    }
    for (int i = 0; i < n_; ++i) {
      double &by_q = costate[i], &by_v = costate[n_ + i];
      if (k < ocp_.horizon()) {
        const double by_u = gradient[2 * n_ + i] + 0.5 * dt * dt * by_q + dt * by_v;
        if (!given_[i]) residuals_.dual = std::max(residuals_.dual, std::abs(by_u));
      }
      by_v += dt * by_q + gradient[n_ + i];
      by_q += gradient[i];
    }
  }
  return residuals_;
}

// The Newton equations of one bound, with y the multiplier, w = price - y that of elastic >= 0, and dg = g' dz:
//   dg + d_elastic = d_slack,   slack dy + y d_slack = mu - slack y,   -elastic dy + w d_elastic = mu - elastic w.
// They give dy = stiffness (offset - dg) with 1 / stiffness = slack / y + elastic / w and
// offset = (mu / y - slack) - (mu / w - elastic).

void ElasticBarrier::model(Curvature curvature, double damping, NewtonSystem& newton) {
  Riccati::Steps steps{};
  for (int t = 0; slosh_.counts && t < ocp_.tool_count(); ++t) steps[t] = evaluation_.slosh_steps(t).data();
  newton.set_sources(steps, model_.hessian, model_.gradient, slosh_.hessian);
  newton.set_given(given_);
  for (int b = 0; b < evaluation_.batches(); ++b) {
    find_model(b, curvature, damping);
    if (newton.is_separate() && newton.couples(model_.hessian)) {  // begins again
      newton.separate(false);
      b = -1;
    } else {
      write_model(b, newton);
    }
  }
  if (slosh_.counts && curvature == Curvature::kExact) add_slosh(newton);
}

/// model_ <- that of batch b.
void ElasticBarrier::find_model(int b, Curvature curvature, double damping) {
  NodeHessianOf<Lanes>& H = model_.hessian;
  NodeGradientOf<Lanes>& g = model_.gradient;
  for (int j = 0; j < entries_; ++j) {  // no term is of a liquid and of the arm
    for (int i = j < 3 * n_ ? 0 : 3 * n_; i <= j; ++i) H(i, j) = 0.0;
  }
  evaluation_.add_objective_hessian(b, curvature, H);
  for (const RowBlock& block : blocks_[b]) {
    if (block.entry >= 0 || curvature == Curvature::kConvex) continue;
    const Lanes multiplier = block.signed_multiplier();
    if (any(abs(multiplier) > kNoMultiplier)) {
      evaluation_.add_constraint_hessian(b, rows_[block.row].id, multiplier, H);
    }
  }
  g = gradient_[b];
  for (RowBlock& block : blocks_[b]) {
    Lanes stiffness = 0.0, force = 0.0;
    for (int i = 0; i < block.side_count; ++i) {
      RowSide& side = block.sides[i];
      const Lanes y = side.multiplier, w = block.price - y, yw = y * w;
      side.stiffness = yw / (side.slack * w + side.elastic * y);
      side.offset = mu_ * (w - y) / yw - side.slack + side.elastic;
      stiffness += side.stiffness;
      force -= side.sign * (y + side.stiffness * side.offset);
    }
    stiffness *= block.acts;
    force *= block.acts;
    if (block.entry >= 0) {
      H(block.entry, block.entry) += stiffness;
      g[block.entry] += force;
      continue;
    }
    const Lanes* gradient = gradients_.data() + block.gradient;
    const int first = block.support.first, size = block.support.last - first;
    for (int j = 0; j < size; ++j) {
      const Lanes scaled = stiffness * gradient[j];
      for (int i = 0; i <= j; ++i) H(first + i, first + j) += scaled * gradient[i];
      g[first + j] += force * gradient[j];
    }
  }
  for (int i = 2 * n_; i < 3 * n_; ++i) H(i, i) += damping;
  if (given_.none()) return;
  leave_out_given(H);
  for (int j = 0; j < n_; ++j) {
    if (!given_[j]) continue;
    for (const int i : {j, n_ + j, 2 * n_ + j}) g[i] = 0.0;
    H(2 * n_ + j, 2 * n_ + j) = curvature_scale_;
  }
}

void ElasticBarrier::leave_out_given(NodeHessianOf<Lanes>& H) const {
  for (int i = 0; i < 3 * n_; ++i) {
    if (!given_[i % n_]) continue;
    for (int j = 0; j < 3 * n_; ++j) H(std::min(i, j), std::max(i, j)) = 0.0;
  }
}

/// The second derivatives of how the liquids go.
void ElasticBarrier::add_slosh(NewtonSystem& newton) {
  for (NewtonSystem::Part& part : newton.parts()) {
    if (part.is_given) continue;
    Riccati& riccati = part.riccati;
    const auto& [first_joint, dof, first_tool, tools] = riccati.joints();
    for (int t = first_tool; t < first_tool + tools; ++t) {
      const int begin = slosh_begin(dof, t - first_tool);
      for (int first = 0; first < ocp_.horizon(); first += kLanes) {
        evaluation_.find_slosh_hessian(t, first, z_, slosh_.costates[t], slosh_.hessian);
        if (given_.any()) leave_out_given(slosh_.hessian);
        std::array<double*, kLanes> models;
        for (int lane = 0; lane < kLanes; ++lane) {
          const int k = first + lane;
          models[lane] = k < ocp_.horizon() ? riccati.row(k, 0) : riccati.padding();
          if (k >= ocp_.horizon()) continue;
          const SloshStep& step = evaluation_.slosh_steps(t)[k];
          const SloshState by_vertical = step.curvature_by_vertical(slosh_.costates[t][k]);
          for (int i = 0; i < 3 * dof; ++i)
            Eigen::Map<SloshState>(riccati.row(k, i) + begin) += step.by_motion(2, riccati.entries()[i]) * by_vertical;
        }
        part.slosh.add(models, 3 * dof);
      }
    }
  }
}

void ElasticBarrier::write_model(int b, NewtonSystem& newton) const {
  for (NewtonSystem::Part& part : newton.parts()) {
    if (part.is_given) continue;
    std::array<double*, kLanes> models;
    for (int lane = 0; lane < kLanes; ++lane) {
      const int column = b * kLanes + lane;
      models[lane] = column <= ocp_.horizon() ? part.riccati.row(order_.node(column), 0) : part.riccati.padding();
    }
    // Of node 0, whose state is given, only u counts.
    part.model.write(models, order_.node(b * kLanes) == 0 ? part.riccati.joints().dof : part.riccati.size());
  }
}

double ElasticBarrier::complete(const NodeTable& step) {
  step_ = &step;
  Lanes slope = 0.0, shrink = 0.0, dual_shrink = 0.0;  // largest relative decrease of a slack, of a multiplier
  for (int i = 0; i < 3 * n_; ++i) {
    for (int b = 0; b < evaluation_.batches(); ++b) slope += gradient_[b][i] * step[i][b];
  }
  for_each_block([&](RowBlock& block, int b) {
    Lanes change = 0.0;
    if (block.entry >= 0) {
      change = step[block.entry][b];
    } else {
      const Lanes* gradient = gradients_.data() + block.gradient;
      for (int i = block.support.first; i < block.support.last; ++i) change += *gradient++ * step[i][b];
    }
    change *= block.acts;
    for (int i = 0; i < block.side_count; ++i) {
      RowSide& side = block.sides[i];
      const Lanes slack = side.slack, elastic = side.elastic, y = side.multiplier, w = block.price - y;
      const Lanes dy = side.stiffness * (side.offset - side.sign * change);
      const Lanes by_multipliers = 1.0 / (y * w), by_slacks = 1.0 / (slack * elastic);
      side.multiplier_step = dy;
      side.slack_step = (mu_ - slack * dy) * (w * by_multipliers) - slack;
      side.elastic_step = (mu_ + elastic * dy) * (y * by_multipliers) - elastic;
      const Lanes room_growth = side.slack_step * (elastic * by_slacks);
      const Lanes excess_growth = side.elastic_step * (slack * by_slacks);
      slope += block.price * side.elastic_step - mu_ * (room_growth + excess_growth);
      shrink = max(shrink, -min(room_growth, excess_growth));
      dual_shrink = max(dual_shrink, max(-dy * (w * by_multipliers), dy * (y * by_multipliers)));
    }
  });
  largest_scale_ = std::min(1.0, kStayInside / largest(shrink));
  largest_dual_scale_ = std::min(1.0, kStayInside / largest(dual_shrink));
  const double total = sum(slope);
  return std::isfinite(total) ? total : kInfinity;
}

bool ElasticBarrier::meet_limits(const NodeTable& step) {
  bool met = false;
  for (const int r : rows_.limits()) {
    const Row& row = rows_[r];
    if (rows_.in_working_set(r) || given_[row.entry % n_]) continue;
    Lanes least = kInfinity;
    for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
      const Lanes v = z_[row.entry][b] + step[row.entry][b], inside = min(v - row.bounds.lower, row.bounds.upper - v);
      least = min(least, select(evaluation_.acts(row.nodes, b) > 0.0, inside, kInfinity));
    }
    if (!any(least < kClose * row.activation_margin)) continue;
    take(r);
    met = true;
  }
  return met;
}

double ElasticBarrier::phi(const Barrier& barrier) const {
  const double result = objective_ + barrier.elastic - mu_ * barrier.logarithms;
  return std::isfinite(result) ? result : kInfinity;
}

double ElasticBarrier::cost_of_prices() const {
  Lanes cost = 0.0;
  for (const auto& batch : blocks_) {
    for (const RowBlock& block : batch) {
      for (int i = 0; block.soft && i < block.side_count; ++i) {
        cost += block.price * max(-block.inside(block.sides[i]), 0.0);
      }
    }
  }
  return sum(cost);
}

double ElasticBarrier::merit() {
  if (!merit_known_) {
    Lanes elastic = 0.0;
    LogSum logarithms;
    for_each_block([&](const RowBlock& block, int) {
      for (int i = 0; i < block.side_count; ++i) {
        elastic += block.price * block.sides[i].elastic;
        logarithms.add(block.sides[i].slack * block.sides[i].elastic);
      }
    });
    barrier_ = {sum(elastic), logarithms.value()};
    merit_known_ = true;
  }
  return phi(barrier_);
}

double ElasticBarrier::try_step(const NodeTable& z, double scale) {
  z_.set_sum(z, scale, *step_);
  set_point();
  Lanes sum_of_excess = 0.0;
  LogSum logarithms;
  for_each_block([&](RowBlock& block, int b) {
    block.value = compute(block, b);
    for (int i = 0; i < block.side_count; ++i) {
      RowSide& side = block.sides[i];
      const Lanes slack = side.slack + scale * side.slack_step, elastic = side.elastic + scale * side.elastic_step;
      // What curvature leaves of g + elastic = slack goes into the slack while there is some, then into the elastic.
      const Lanes rest = block.inside(side) + elastic - slack, taken = max(rest, -0.5 * slack);
      side.new_slack = slack + taken;
      side.new_elastic = elastic - (rest - taken);
      sum_of_excess += block.price * side.new_elastic;
      logarithms.add(side.new_slack * side.new_elastic);
    }
  });
  tried_barrier_ = {sum(sum_of_excess), logarithms.value()};
  return phi(tried_barrier_);
}

void ElasticBarrier::accept() {
  barrier_ = tried_barrier_;
  merit_known_ = true;
  for_each_block([&](RowBlock& block, int) {
    for (int i = 0; i < block.side_count; ++i) {
      RowSide& side = block.sides[i];
      side.slack = side.new_slack;
      side.elastic = side.new_elastic;
      side.multiplier += largest_dual_scale_ * side.multiplier_step;
    }
  });
}

ElasticBarrier::Check ElasticBarrier::check_all_rows(double tolerance) {
  if (watch_.all_known && differentiated_ && stayed_near(1.0)) {
    violation_ = residuals_.violation;
    return Check::kNothingNew;
  }
  violation_ = violation_of_blocks();
  find_near();
  Check result = Check::kNothingNew;
  for_each_near([&](int r) {
    if (rows_.in_working_set(r)) return;
    const double outside = violation(r);
    if (!rows_[r].soft()) violation_ = std::max(violation_, outside);
    if (!(outside > tolerance)) return;
    take(r);
    if (rows_[r].entry < 0) result = Check::kMissed;
    if (result == Check::kNothingNew) result = Check::kMissedLinear;
  });
  return result;
}

/// How far row r, which is not in the working set, is outside its bounds.
double ElasticBarrier::violation(int r) const {
  const Row& row = rows_[r];
  Lanes outside = 0.0;
  for (int b = 0; b < evaluation_.acting_batches(row.nodes); ++b) {
    const Lanes v = evaluation_.constraint(b, row.id), here = max(row.bounds.lower - v, v - row.bounds.upper);
    outside = max(outside, select(evaluation_.acts(row.nodes, b) > 0.0, here, 0.0));
  }
  return largest(outside);
}

void ElasticBarrier::write_multipliers(Multipliers& multipliers) const {
  multipliers.clear();
  for (int b = 0; b < evaluation_.batches(); ++b) {
    for (const RowBlock& block : blocks_[b]) {
      const Lanes numbers = block.signed_multiplier();
      double* nodes = multipliers.store(block.row);
      for (int i = 0; i < kLanes; ++i) {
        if (block.acts[i] > 0.0) nodes[order_.node(b * kLanes + i)] = numbers[i];
      }
    }
  }
}

}  // namespace steadyhand::realtime

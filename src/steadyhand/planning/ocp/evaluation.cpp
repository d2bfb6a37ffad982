#include "steadyhand/planning/ocp/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/planning/ocp/slosh_interval.hpp"

namespace steadyhand {

Evaluation::Evaluation(const Ocp& ocp)
    : ocp_(&ocp),
      arms_(ocp.horizon() + 1, Kinematics(ocp.model())),
      x_(ocp.horizon() + 1, StateVector::Zero(2 * ocp.dof())),
      u_(ocp.horizon() + 1, JointVector::Zero(ocp.dof())),
      dq_(ocp.horizon() + 1, JointVector::Zero(ocp.dof())),
      rows_(ocp.horizon() + 1),
      references_((ocp.horizon() + 1) * ocp.tool_count()),
      slosh_(references_.size(), SloshState::Zero()),
      interval_(std::make_unique<SloshIntervalOf<double>>(ocp.model(), ocp.dt())) {
  step_.by_motion.setZero(3, 3 * ocp.dof());
  for (int k = 0; k <= ocp.horizon(); ++k) {
    times_.push_back(k * ocp.dt());
    for (int c = 0; c < static_cast<int>(ocp.constraints().size()); ++c) {
      if (!ocp.acts(ocp.constraints()[c]->nodes(), k)) continue;
      for (int row = 0; row < ocp.constraints()[c]->rows(); ++row) rows_[k].push_back({c, row});
    }
  }
}

Evaluation::~Evaluation() = default;

void Evaluation::set_instance(const OcpInstance& instance) {
  instance_ = &instance;
  for (int k = 1; k <= ocp_->horizon(); ++k) {  // node 0 has none, and no term of a state acts there
    for (int t = 0; t < ocp_->tool_count(); ++t) {
      const ToolReference& reference = instance.reference.tools[t];
      references_[index(k, t)] = {reference.p[k - 1], reference.R[k - 1]};
    }
  }
}

void Evaluation::set_node(int k, const StateVector& x, const JointVector& u) {
  const int n = ocp_->dof();
  const bool has_input = k < ocp_->horizon();
  const bool moved = x != x_[k];
  if (!moved && (!has_input || u == u_[k])) return;
  if (moved) {
    x_[k] = x;
    dq_[k] = x.tail(n);
    arms_[k].set_position(x.head(n));
  }
  if (has_input) {
    u_[k] = u;
    arms_[k].set_motion(dq_[k], u);
  }
}

void Evaluation::set_trajectory(const Trajectory& trajectory) {
  for (int k = 0; k < ocp_->horizon(); ++k) set_node(k, trajectory.x[k], trajectory.u[k]);
  set_node(ocp_->horizon(), trajectory.x.back(), u_.back());
  if (!ocp_->liquid()) return;
  for (int t = 0; t < ocp_->tool_count(); ++t) set_slosh(0, instance_->liquid[t].state, t);
  for (int k = 0; k < ocp_->horizon(); ++k) {
    interval_->set(x_[k].head(ocp_->dof()), dq_[k], u_[k]);
    for (int t = 0; t < ocp_->tool_count(); ++t) {
      instance_->liquid[t].model.set_step(interval_->force(t), false, step_);
      set_slosh(k + 1, step_.next(slosh(k, t)), t);
    }
  }
}

Node Evaluation::node(int k) const {
  return {arms_[k],
          dq_[k],
          u_[k],
          &references_[index(k, 0)],
          times_[k],
          instance_->near,
          ocp_->liquid() ? &slosh(k) : nullptr,
          instance_->liquid.data(),
          &instance_->u_followed,
          instance_->clearance,
          &instance_->held};
}

const SloshStep& Evaluation::slosh_step(int k, int tool) const {
  interval_->set(x_[k].head(ocp_->dof()), dq_[k], u_[k]);
  instance_->liquid[tool].model.set_step(interval_->force(tool), true, step_);
  for (int i = 0; i < 3 * ocp_->dof(); ++i) step_.by_motion.col(i) = interval_->force_by(i, tool);
  step_.differentiate(slosh(k, tool));
  return step_;
}

void Evaluation::add_slosh_hessian(int k, const SloshState& costate, NodeHessian& hessian, int tool) const {
  const int size = 3 * ocp_->dof(), begin = slosh_begin(ocp_->dof(), tool);
  interval_->add_hessian(step_.by_force.transpose() * costate, hessian, tool);
  const auto& G = step_.by_motion;
  const NodeHessian by_motion = G.transpose() * step_.curvature_by_force(slosh(k, tool), costate) * G;
  const SloshState by_vertical = step_.curvature_by_vertical(costate);
  for (int j = 0; j < size; ++j) {
    for (int i = 0; i <= j; ++i) hessian(i, j) += by_motion(i, j);
    for (int i = 0; i < kSloshStates; ++i) hessian(j, begin + i) += G(2, j) * by_vertical[i];
  }
}

double Evaluation::objective(int k) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < ocp_->objectives().size(); ++i) {
    const Objective& term = *ocp_->objectives()[i];
    if (ocp_->acts(term.nodes(), k) && !instance_->weights[i].isZero(0.0)) {
      sum += term.value(node(k), instance_->weights[i]);
    }
  }
  return ocp_->dt() * sum;
}

double Evaluation::objective_share(int i) const {
  const Objective& term = *ocp_->objectives()[i];
  double sum = 0.0;
  for (int k = 0; k <= ocp_->horizon(); ++k) {
    if (ocp_->acts(term.nodes(), k)) sum += term.value(node(k), instance_->weights[i]);
  }
  return ocp_->dt() * sum;
}

void Evaluation::add_objective_gradient(int k, double scale, NodeGradient& gradient) const {
  for (std::size_t i = 0; i < ocp_->objectives().size(); ++i) {
    const Objective& term = *ocp_->objectives()[i];
    const JointVector& weight = instance_->weights[i];
    if (ocp_->acts(term.nodes(), k) && !weight.isZero(0.0)) {
      term.add_gradient(node(k), scale * ocp_->dt() * weight, gradient);
    }
  }
}

void Evaluation::add_objective_hessian(int k, double scale, NodeHessian& hessian) const {
  for (std::size_t i = 0; i < ocp_->objectives().size(); ++i) {
    const Objective& term = *ocp_->objectives()[i];
    const JointVector& weight = instance_->weights[i];
    if (ocp_->acts(term.nodes(), k) && !weight.isZero(0.0)) {
      term.add_hessian(node(k), scale * ocp_->dt() * weight, hessian);
    }
  }
}

void Evaluation::add_objective_convex_hessian(int k, double scale, NodeHessian& hessian) const {
  for (std::size_t i = 0; i < ocp_->objectives().size(); ++i) {
    const Objective& term = *ocp_->objectives()[i];
    const JointVector& weight = instance_->weights[i];
    if (ocp_->acts(term.nodes(), k) && !weight.isZero(0.0)) {
      term.add_convex_hessian(node(k), scale * ocp_->dt() * weight, hessian);
    }
  }
}

double Evaluation::constraint(int k, ConstraintRow row) const {
  return ocp_->constraints()[row.constraint]->value(node(k), row.row);
}

void Evaluation::add_constraint_gradient(int k, ConstraintRow row, double scale, NodeGradient& gradient) const {
  ocp_->constraints()[row.constraint]->add_gradient(node(k), row.row, scale, gradient);
}

void Evaluation::add_constraint_hessian(int k, ConstraintRow row, double scale, NodeHessian& hessian) const {
  ocp_->constraints()[row.constraint]->add_hessian(node(k), row.row, scale, hessian);
}

double Evaluation::price(int k) const {
  double sum = 0.0;
  for (const ConstraintRow row : rows_[k]) {
    const double price = ocp_->constraints()[row.constraint]->price(row.row);
    if (!std::isfinite(price)) continue;
    const double value = constraint(k, row);
    const Bounds limit = bounds(k, row);
    sum += price * std::max({0.0, limit.lower - value, value - limit.upper});
  }
  return sum;
}

double Evaluation::violation() const {
  double largest = 0.0;
  for (int k = 0; k <= ocp_->horizon(); ++k) {
    for (const ConstraintRow row : rows_[k]) {
      if (std::isfinite(ocp_->constraints()[row.constraint]->price(row.row))) continue;
      if (ocp_->is_given(*instance_, row)) continue;
      const double value = constraint(k, row);
      const Bounds limit = bounds(k, row);
      largest = std::max({largest, limit.lower - value, value - limit.upper});
    }
  }
  return largest;
}

double Evaluation::clearance() const {
  double smallest = std::numeric_limits<double>::infinity();
  for (const Kinematics& arm : arms_) smallest = std::min(smallest, steadyhand::clearance(arm));
  return smallest;
}

}  // namespace steadyhand

#include "steadyhand/planning/solve/realtime/batch_evaluation.hpp"

namespace steadyhand::realtime {

BatchEvaluation::BatchEvaluation(const Ocp& ocp)
    : ocp_(ocp),
      order_{ocp.horizon()},
      state_batches_((ocp.horizon() + kLanes - 1) / kLanes),
      start_hessian_(3 * ocp.dof(), 3 * ocp.dof()),
      scratch_(ocp.model()) {
  const int n = ocp.dof();
  for (int b = 0; b < order_.batches(); ++b) {
    Batch batch{KinematicsOf<Lanes>(ocp.model()),
                JointVectorOf<Lanes>::Zero(n),
                JointVectorOf<Lanes>::Zero(n),
                {},
                0.0,
                0.0,
                0.0,
                {},
                {}};
    batch.slosh.fill(SloshStateOf<Lanes>::Zero());
    for (int i = 0; i < kLanes; ++i) {
      const int column = b * kLanes + i, k = order_.node(column);
      const bool padding = column > order_.column(0);
      batch.time.set(i, k * ocp.dt());
      batch.state.set(i, !padding && ocp.acts(Nodes::kStates, k));
      batch.interval.set(i, !padding && ocp.acts(Nodes::kIntervals, k));
    }
    for (const auto& objective : ocp.objectives()) {
      batch.weights.push_back(Objective::BatchWeight::Zero(objective->weight_count(ocp.model())));
    }
    batches_.push_back(batch);
  }
  inputs_only_ = state_batches_ < batches();
  for (const auto& constraint : ocp.constraints()) {
    for (int row = 0; constraint->nodes() == Nodes::kIntervals && row < constraint->rows(); ++row) {
      inputs_only_ = inputs_only_ && constraint->entry(row) >= 0;
    }
  }
  start_ = {JointVector::Zero(n), JointVector::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  weighted_.reserve(ocp.objectives().size());
  near_.resize(ocp.obstacle_rows());
  if (!ocp.liquid()) return;
  slosh_.assign((ocp.horizon() + kLanes - 1) / kLanes, SloshIntervalOf<Lanes>(ocp.model(), ocp.dt()));
  for (int t = 0; t < ocp.tool_count(); ++t) {
    slosh_steps_[t].resize(ocp.horizon());
    for (SloshStep& step : slosh_steps_[t]) step.by_motion.setZero(3, 3 * n);
  }
}

void BatchEvaluation::set_instance(const OcpInstance& instance) {
  fresh_ = true;
  start_known_ = false;
  needs_motion_ = false;
  weighted_.clear();
  for (int i = 0; i < std::ssize(ocp_.objectives()); ++i) {
    if (instance.weights[i].isZero(0.0)) continue;
    weighted_.push_back(i);
    const Objective& term = *ocp_.objectives()[i];
    needs_motion_ = needs_motion_ || term.needs_motion();
    for (int b = 0; b < batches(); ++b) {
      for (int j = 0; j < instance.weights[i].size(); ++j) {
        batches_[b].weights[i][j] = (ocp_.dt() * instance.weights[i][j]) * acts(term.nodes(), b);
      }
    }
  }
  near_ = instance.near;
  u_followed_ = instance.u_followed;
  clearance_ = instance.clearance;
  held_ = instance.held;
  given_ = instance.given;
  slosh_counts_ = false;
  for (int t = 0; t < ocp_.tool_count(); ++t) {
    if (ocp_.liquid()) liquid_[t] = instance.liquid[t];
    slosh_counts_ = slosh_counts_ || (ocp_.liquid() && liquid_[t].counts);
    const ToolReference& reference = instance.reference.tools[t];
    for (int b = 0; b < batches(); ++b) {
      auto& [p, R] = batches_[b].reference[t];
      for (int i = 0; i < kLanes; ++i) {
        const int entry = std::max(order_.node(b * kLanes + i) - 1, 0);  // no term of a state acts at node 0
        for (int j = 0; j < 3; ++j) p[j].set(i, reference.p[entry][j]);
        for (int j = 0; j < 9; ++j) R.data()[j].set(i, reference.R[entry].data()[j]);
      }
    }
  }
}

void BatchEvaluation::set_point(NodeTable& z) {
  const int n = ocp_.dof();
  JointVectorOf<Lanes> q(n);
  for (int b = 0; b < batches(); ++b) {
    Batch& batch = batches_[b];
    if (is_start(b)) {
      for (int i = 0; i < n; ++i) batch.u[i] = z[2 * n + i][b];
      continue;
    }
    for (int i = 0; i < n; ++i) {
      q[i] = z[i][b];
      batch.dq[i] = z[n + i][b];
      batch.u[i] = z[2 * n + i][b];
    }
    if (fresh_ || b < state_batches_) batch.arm.set_position(q);  // after them only node 0, which does not change
    if (needs_motion_) batch.arm.set_motion(batch.dq, batch.u);
  }
  if (fresh_) find_start();
  fresh_ = false;
  if (slosh_counts_) roll_out_slosh(z);
}

void BatchEvaluation::find_start() {
  for (const int i : weighted_) {
    const Objective& term = *ocp_.objectives()[i];
    if (!inputs_only_ || (term.nodes() == Nodes::kIntervals && !term.quadratic_in_input())) return;
  }
  const int n = ocp_.dof(), b = state_batches_;
  NodeGradientOf<Lanes> gradient = NodeGradientOf<Lanes>::Zero(3 * n);
  NodeHessianOf<Lanes>& hessian = start_hessian_;
  for (int j = 0; j < 3 * n; ++j) {
    for (int i = 0; i <= j; ++i) hessian(i, j) = 0.0;
  }
  Lanes value = 0.0;
  for (const int i : weighted_) {
    const Objective& term = *ocp_.objectives()[i];
    if (b >= acting_batches(term.nodes())) continue;
    value += term.value(node(b), batches_[b].weights[i]);
    term.add_gradient(node(b), batches_[b].weights[i], gradient);
    term.add_convex_hessian(node(b), batches_[b].weights[i], hessian);
  }
  start_.value = value[0];
  for (int i = 0; i < n; ++i) {
    start_.u[i] = batches_[b].u[i][0];
    start_.gradient[i] = gradient[2 * n + i][0];
    for (int j = i; j < n; ++j) start_.hessian(i, j) = start_.hessian(j, i) = hessian(2 * n + i, 2 * n + j)[0];
  }
  start_known_ = true;
}

void BatchEvaluation::roll_out_slosh(NodeTable& z) {
  const int n = ocp_.dof(), horizon = ocp_.horizon(), tools = ocp_.tool_count();
  std::array<SloshState, kMaxTools> states;
  JointVectorOf<Lanes> q(n), dq(n), u(n);
  const auto write = [&](int tool, int k) {
    for (int i = 0; i < kSloshStates; ++i) z.set(slosh_begin(n, tool) + i, k, states[tool][i]);
  };
  for (int t = 0; t < tools; ++t) {
    states[t] = liquid_[t].state;
    write(t, 0);
  }
  for (int b = 0; b < std::ssize(slosh_); ++b) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const int k = std::min(b * kLanes + lane, horizon - 1);
      for (int i = 0; i < n; ++i) {
        q[i].set(lane, z.at(i, k));
        dq[i].set(lane, z.at(n + i, k));
        u[i].set(lane, z.at(2 * n + i, k));
      }
    }
    slosh_[b].set(q, dq, u);
    for (int t = 0; t < tools; ++t) {
      const Vector3Of<Lanes>& force = slosh_[b].force(t);
      for (int lane = 0; lane < kLanes && b * kLanes + lane < horizon; ++lane) {
        const int k = b * kLanes + lane;
        liquid_[t].model.set_step({force[0][lane], force[1][lane], force[2][lane]}, false, slosh_steps_[t][k]);
        states[t] = slosh_steps_[t][k].next(states[t]);
        write(t, k + 1);
      }
    }
  }
  for (int b = 0; b < batches(); ++b) {
    for (int t = 0; t < tools; ++t) {
      for (int i = 0; i < kSloshStates; ++i) batches_[b].slosh[t][i] = z[slosh_begin(n, t) + i][b];
    }
  }
}

void BatchEvaluation::differentiate_slosh(const NodeTable& z) {
  const int n = ocp_.dof();
  for (int b = 0; b < std::ssize(slosh_); ++b) {
    const int lanes = std::min(kLanes, ocp_.horizon() - b * kLanes);
    for (int t = 0; t < ocp_.tool_count(); ++t) {
      SloshStep* steps = slosh_steps_[t].data() + b * kLanes;
      for (int i = 0; i < 3 * n; ++i) {
        const Vector3Of<Lanes> by =
            given_[i % n] ? Vector3Of<Lanes>(Vector3Of<Lanes>::Zero()) : slosh_[b].force_by(i, t);
        for (int lane = 0; lane < lanes; ++lane) {
          auto column = steps[lane].by_motion.col(i);
          for (int axis = 0; axis < 3; ++axis) column[axis] = by[axis][lane];
        }
      }
      for (int lane = 0; lane < lanes; ++lane) {
        liquid_[t].model.set_step(steps[lane].force, true, steps[lane]);
        steps[lane].differentiate(slosh_state(z, b * kLanes + lane, t));
      }
    }
  }
}

void BatchEvaluation::find_slosh_hessian(int tool, int first, const NodeTable& z,
                                         const std::vector<SloshState>& costates, NodeHessianOf<Lanes>& H) const {
  const int n = ocp_.dof(), lanes = std::min(kLanes, ocp_.horizon() - first);
  const SloshIntervalOf<Lanes>& interval = slosh_[first / kLanes];
  Vector3Of<Lanes> force = Vector3Of<Lanes>::Zero();
  Matrix3Of<Lanes> curvature = Matrix3Of<Lanes>::Zero();
  for (int i = 0; i < lanes; ++i) {
    const SloshStep& step = slosh_steps_[tool][first + i];
    const SloshState& costate = costates[first + i];
    const Vector3 by_force = step.by_force.transpose() * costate;
    const Matrix3 second = step.curvature_by_force(slosh_state(z, first + i, tool), costate);
    for (int j = 0; j < 3; ++j) force[j].set(i, by_force[j]);
    for (int j = 0; j < 9; ++j) curvature.data()[j].set(i, second.data()[j]);
  }
  std::array<Vector3Of<Lanes>, 3 * kMaxJoints> by_motion;
  for (int j = 0; j < 3 * n; ++j) {
    by_motion[j] = interval.force_by(j, tool);
    const Vector3Of<Lanes> scaled = curvature * by_motion[j];
    for (int i = 0; i <= j; ++i) H(i, j) = by_motion[i].dot(scaled);
  }
  interval.add_hessian(force, H, tool);
}

double BatchEvaluation::objective() const {
  Lanes total = 0.0;
  for (const int i : weighted_) {
    const Objective& term = *ocp_.objectives()[i];
    for (int b = 0; b < acting_batches(term.nodes()); ++b) {
      if (!is_start(b)) total += term.value(node(b), batches_[b].weights[i]);
    }
  }
  if (!start_known_) return sum(total);
  const JointVector step = start_step();
  return sum(total) + start_.value + step.dot(start_.gradient + 0.5 * (start_.hessian * step));
}

JointVector BatchEvaluation::start_step() const {
  const int n = ocp_.dof();
  JointVector step(n);
  for (int i = 0; i < n; ++i) step[i] = batches_[state_batches_].u[i][0] - start_.u[i];
  return step;
}

void BatchEvaluation::add_objective_gradient(int b, NodeGradientOf<Lanes>& gradient) const {
  if (is_start(b)) {
    const int n = ocp_.dof();
    const JointVector by_u = start_.gradient + start_.hessian * start_step();
    for (int i = 0; i < n; ++i) gradient[2 * n + i].set(0, gradient[2 * n + i][0] + by_u[i]);
    return;
  }
  for (const int i : weighted_) {
    const Objective& term = *ocp_.objectives()[i];
    if (b < acting_batches(term.nodes())) term.add_gradient(node(b), batches_[b].weights[i], gradient);
  }
}

void BatchEvaluation::add_objective_hessian(int b, Curvature curvature, NodeHessianOf<Lanes>& hessian) const {
  if (is_start(b)) {
    const int n = ocp_.dof();
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i <= j; ++i) {
        Lanes& entry = hessian(2 * n + i, 2 * n + j);
        entry.set(0, entry[0] + start_.hessian(i, j));
      }
    }
    return;
  }
  for (const int i : weighted_) {
    const Objective& term = *ocp_.objectives()[i];
    if (b >= acting_batches(term.nodes())) continue;
    if (curvature == Curvature::kExact) {
      term.add_hessian(node(b), batches_[b].weights[i], hessian);
    } else {
      term.add_convex_hessian(node(b), batches_[b].weights[i], hessian);
    }
  }
}

}  // namespace steadyhand::realtime

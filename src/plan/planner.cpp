#include "plan/planner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace steadyhand {

Planner::Planner(const RobotModel& model, const OcpSettings& ocp, const PlannerSettings& settings)
    : settings_(settings), ocp_(model, ocp), kinematics_(model), guess_(model.dof(), ocp.horizon) {
  solution_.prepare(ocp_);
}

Result<std::unique_ptr<Planner>> Planner::make(const RobotModel& model, const OcpSettings& ocp,
                                               const PlannerSettings& settings) {
  if (ocp.horizon < 1 || ocp.horizon > kMaxHorizon) {
    return Error{fmt::format("horizon is {}; it must be from 1 to {}", ocp.horizon, kMaxHorizon)};
  }
  if (!(ocp.dt > 0.0) || !std::isfinite(ocp.dt)) return Error{fmt::format("dt is {}; it must be positive", ocp.dt)};
  std::unique_ptr<Planner> planner(new Planner(model, ocp, settings));
  auto solver = make_solver(settings.solver, planner->ocp_, settings.tolerance);
  if (!solver) return solver.error();
  planner->solver_ = std::move(*solver);
  auto weights = planner->ocp_.weights(ocp.weights);
  if (!weights) return weights.error();
  planner->set_weights(*weights);
  planner->reset(model.home, Time(0));
  return planner;
}

void Planner::reset(const JointVector& q, Time now) {
  plan_ = Plan{};
  plan_.start = solved_until_ = now;
  plan_.dt = ocp_.dt();
  plan_.joints = ocp_.dof();
  plan_.x[0] = StateVector::Zero(2 * ocp_.dof());
  plan_.x[0].head(ocp_.dof()) = q;
  for (auto& node : solution_.multipliers) std::fill(node.begin(), node.end(), 0.0);
}

const Plan& Planner::update(const Reference& reference) {
  const JointCommand now = sample(plan_, reference.start);
  instance_.x0.resize(2 * ocp_.dof());
  instance_.x0 << now.q, now.dq;
  instance_.reference = reference;
  make_guess(reference.start);
  multipliers_ = solution_.multipliers;
  solver_->solve(instance_, guess_, &multipliers_, settings_.budget, solution_);

  fault_ = PlanFault::kNotFinite;
  if (solution_.status == SolveStatus::kSolved || solution_.status == SolveStatus::kFeasible) {
    make_plan(reference);
    fault_ = check_plan(candidate_, instance_.x0, settings_.check, kinematics_);
  }
  if (fault_ == PlanFault::kNone) {
    plan_ = candidate_;
    solved_until_ = plan_.start + from_seconds(ocp_.horizon() * ocp_.dt());
  } else {
    plan_.origin = PlanOrigin::kPrevious;
  }
  return plan_;
}

/// The last solution shifted to `start`; what it does not cover goes on at constant velocity.
void Planner::make_guess(Time start) {
  guess_.x[0] = instance_.x0;
  for (int k = 0; k < ocp_.horizon(); ++k) {
    const Time begin = start + from_seconds(k * ocp_.dt()), end = start + from_seconds((k + 1) * ocp_.dt());
    if (end <= solved_until_) {
      guess_.u[k] = (sample(plan_, end).dq - sample(plan_, begin).dq) / ocp_.dt();
    } else {
      guess_.u[k].setZero(ocp_.dof());
    }
    guess_.x[k + 1] = ocp_.next(guess_.x[k], guess_.u[k]);
  }
}

/// The solution, then a stop in which all joints brake evenly, as hard as the limits allow.
void Planner::make_plan(const Reference& reference) {
  const int n = ocp_.dof(), N = ocp_.horizon();
  candidate_.stamp = reference.stamp;
  candidate_.start = reference.start;
  candidate_.dt = ocp_.dt();
  candidate_.joints = n;
  candidate_.origin = solution_.status == SolveStatus::kSolved ? PlanOrigin::kSolved : PlanOrigin::kFeasible;
  for (int k = 0; k < N; ++k) {
    candidate_.x[k] = solution_.trajectory.x[k];
    candidate_.u[k] = solution_.trajectory.u[k];
  }
  candidate_.x[N] = solution_.trajectory.x[N];

  const JointVector velocity = candidate_.x[N].tail(n);
  const double time = (velocity.cwiseAbs().array() / ocp_.model().acceleration_max.array()).maxCoeff();
  const int stop = std::min(static_cast<int>(std::ceil(time / ocp_.dt() - 1e-9)), Plan::kMaxIntervals - N);
  candidate_.intervals = N + stop;
  for (int k = N; k < N + stop; ++k) {
    candidate_.u[k] = -velocity / (stop * ocp_.dt());
    candidate_.x[k + 1] = ocp_.next(candidate_.x[k], candidate_.u[k]);
  }
}

}  // namespace steadyhand

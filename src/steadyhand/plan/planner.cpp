#include "steadyhand/plan/planner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/track/sample.hpp"

namespace steadyhand {

Planner::Planner(const RobotModel& model, const OcpSettings& ocp, const PlannerSettings& settings)
    : settings_(settings), ocp_(model, ocp), kinematics_(model), warm_start_(ocp_) {
  solution_.prepare(ocp_);
}

Result<std::unique_ptr<Planner>> Planner::make(const RobotModel& model, const OcpSettings& ocp,
                                               const PlannerSettings& settings) {
  if (Status s = Ocp::check(ocp); !s) return s.error();
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
  stand(q, now, plan_);
  warm_start_.reset(now);
}

const Plan& Planner::update(const Reference& reference) {
  const JointCommand now = sample(plan_, reference.start);
  instance_.x0.resize(2 * ocp_.dof());
  instance_.x0 << now.q, now.dq;
  instance_.reference = reference;
  warm_start_.shift(instance_.x0, reference.start);
  try {
    solver_->solve(instance_, warm_start_.guess(), warm_start_.multipliers(), settings_.budget, solution_);
  } catch (...) {  // a third party's: it has failed, and the arm goes on along what was checked
    solution_.status = SolveStatus::kInvalid;
    solution_.iterations = 0;
  }

  // Between the solution's last node and rest lies a stop that the problem does not know: it may need to begin earlier.
  fault_ = PlanFault::kNotFinite;
  // Without an iteration, for lack of time, what is feasible is the guess: nothing was planned.
  const bool improved = solution_.status == SolveStatus::kFeasible && solution_.iterations > 0;
  if (solution_.status == SolveStatus::kSolved || improved) {
    for (int intervals = ocp_.horizon(); intervals >= 1 && fault_ != PlanFault::kNone; --intervals) {
      make_plan(reference, intervals);
      fault_ = check_plan(candidate_, instance_.x0, settings_.check, kinematics_);
    }
  }
  if (fault_ == PlanFault::kNone) {
    plan_ = candidate_;
    warm_start_.keep(solution_, reference.start);
  } else {
    plan_.origin = PlanOrigin::kPrevious;
  }
  return plan_;
}

/// The solution's first intervals, then a stop in which all joints brake evenly, as hard as the limits allow.
void Planner::make_plan(const Reference& reference, int intervals) {
  const int n = ocp_.dof();
  candidate_.stamp = reference.stamp;
  candidate_.start = reference.start;
  candidate_.dt = ocp_.dt();
  candidate_.joints = n;
  candidate_.origin = solution_.status == SolveStatus::kSolved ? PlanOrigin::kSolved : PlanOrigin::kFeasible;
  for (int k = 0; k < intervals; ++k) {
    candidate_.x[k] = solution_.trajectory.x[k];
    candidate_.u[k] = solution_.trajectory.u[k];
  }
  candidate_.x[intervals] = solution_.trajectory.x[intervals];

  const JointVector velocity = candidate_.x[intervals].tail(n);
  const double time = (velocity.cwiseAbs().array() / ocp_.model().acceleration_max.array()).maxCoeff();
  const int stop = std::min(static_cast<int>(std::ceil(time / ocp_.dt() - 1e-9)), Plan::kMaxIntervals - intervals);
  candidate_.intervals = intervals + stop;
  for (int k = intervals; k < intervals + stop; ++k) {
    candidate_.u[k] = -velocity / (stop * ocp_.dt());
    candidate_.x[k + 1] = ocp_.next(candidate_.x[k], candidate_.u[k]);
  }
}

}  // namespace steadyhand

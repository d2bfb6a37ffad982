#include <algorithm>
#include <array>
#include <cmath>

#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

double kkt_error(const Evaluation& evaluation, const Trajectory& trajectory, const Multipliers& multipliers) {
  const Ocp& ocp = evaluation.ocp();
  const int n = ocp.dof(), entries = ocp.entries();
  const double dt = ocp.dt();

  double worst = (trajectory.x[0] - evaluation.instance().x0).lpNorm<Eigen::Infinity>();
  StateVector costate = StateVector::Zero(2 * n);     // dL/dx_{k+1} of everything from node k + 1 on
  std::array<SloshState, kMaxTools> liquid_costates;  // the same by the state of each tool's liquid
  liquid_costates.fill(SloshState::Zero());
  const int liquids = ocp.liquid() ? ocp.tool_count() : 0;
  for (int k = ocp.horizon(); k >= 0; --k) {
    NodeGradient gradient = NodeGradient::Zero(entries);
    evaluation.add_objective_gradient(k, 1.0, gradient);
    for (std::size_t i = 0; i < evaluation.rows(k).size(); ++i) {
      const ConstraintRow row = evaluation.rows(k)[i];
      if (ocp.is_given(evaluation.instance(), row)) continue;
      const double multiplier = multipliers.at(k, row);
      const double value = evaluation.constraint(k, row);
      const Bounds bounds = evaluation.bounds(k, row);
      evaluation.add_constraint_gradient(k, row, multiplier, gradient);
      const double price = ocp.constraints()[row.constraint]->price(row.row);
      const double outside = std::max({0.0, bounds.lower - value, value - bounds.upper});
      double slack = multiplier < 0.0 ? value - bounds.lower : bounds.upper - value;
      if (std::isfinite(price)) {
        worst = std::max({worst, std::abs(multiplier) - price, outside * (price - std::abs(multiplier))});
        if (outside > 0.0) slack = 0.0;
      } else {
        worst = std::max(worst, outside);
      }
      if (multiplier != 0.0)
        worst = std::max(worst, std::isfinite(slack) ? std::abs(multiplier * slack) : std::abs(multiplier));
    }
    if (k < ocp.horizon()) {
      for (int t = 0; t < liquids; ++t) {
        const SloshStep& step = evaluation.slosh_step(k, t);
        gradient.head(3 * n) += step.by_motion.transpose() * (step.by_force.transpose() * liquid_costates[t]);
        liquid_costates[t] = step.pull_back(liquid_costates[t]);
        worst =
            std::max(worst, (evaluation.slosh(k + 1, t) - step.next(evaluation.slosh(k, t))).lpNorm<Eigen::Infinity>());
      }
      JointVector dL_du = gradient.segment(2 * n, n) + 0.5 * dt * dt * costate.head(n) + dt * costate.tail(n);
      for (int j = 0; j < n; ++j)
        if (evaluation.instance().given[j]) dL_du[j] = 0.0;
      worst = std::max({worst, dL_du.lpNorm<Eigen::Infinity>(),
                        (trajectory.x[k + 1] - ocp.next(trajectory.x[k], trajectory.u[k])).lpNorm<Eigen::Infinity>()});
      costate.tail(n) += dt * costate.head(n);
    }
    costate += gradient.head(2 * n);
    for (int t = 0; t < liquids; ++t) liquid_costates[t] += gradient.segment<kSloshStates>(slosh_begin(n, t));
  }
  return worst;
}

}  // namespace steadyhand

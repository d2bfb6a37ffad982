#pragma once

#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/multipliers.hpp"

namespace steadyhand {

/// How far a trajectory with multipliers is from a KKT point of the problem: the largest of
/// - the gradient of the Lagrangian by every u_k, states eliminated through the dynamics (the costates are exact),
/// - the violation of rows and dynamics,
/// - |multiplier * slack| of every row; of one with a price and outside its bounds (price - |multiplier|) * excess,
/// - what a multiplier is above its row's price,
/// - wrong signs of multipliers of one-sided rows.
/// Unscaled, in the units of the problem. `evaluation` must be set to the trajectory. Allocates nothing.
double kkt_error(const Evaluation& evaluation, const Trajectory& trajectory, const Multipliers& multipliers);

}  // namespace steadyhand

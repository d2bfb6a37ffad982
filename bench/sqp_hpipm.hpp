#pragma once

#include <memory>

#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand::bench {

/// A peer of `realtime` that isolates the method: sequential quadratic programming whose subproblems HPIPM solves
/// (Frison and Diehl, 2020), fed with the same terms and derivatives. Exact Hessians of the Lagrangian, and convex ones
/// of the objectives where a step with those leads nowhere; steps are halved while an L1 merit function grows; rows
/// outside their activation margins are left out until they are violated. Knows no liquid and no prices.
std::unique_ptr<Solver> make_sqp_hpipm(const Ocp& ocp, double tolerance);

}  // namespace steadyhand::bench

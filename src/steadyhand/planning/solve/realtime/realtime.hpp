#pragma once

#include <memory>

#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

/// The project's solver, specific to this problem: an elastic interior point over the accelerations, each Newton step
/// by a Riccati recursion that uses the double integrator (docs/explanation/solver.md). Every iterate obeys the
/// dynamics. A warm start needs only the last solution and its multipliers, both shifted; which rows are active
/// follows from them.
std::unique_ptr<Solver> make_realtime_solver(const Ocp& ocp, double tolerance);

}  // namespace steadyhand

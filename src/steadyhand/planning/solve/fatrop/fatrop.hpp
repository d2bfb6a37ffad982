#pragma once

#include <memory>

#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

/// FATROP (Vanroye et al. 2023, https://arxiv.org/abs/2303.16746): structure-exploiting interior point, with the exact
/// derivatives of the terms.
std::unique_ptr<Solver> make_fatrop_solver(const Ocp& ocp, double tolerance);

}  // namespace steadyhand

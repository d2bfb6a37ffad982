#pragma once

#include <functional>
#include <memory>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/problem_json.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

using SolverMaker = std::function<Result<std::unique_ptr<Solver>>(const Ocp& ocp, double tolerance)>;

/// Solves each problem with a solver of `make`, and returns the solutions as `steadyhand solve` prints them.
/// Fails on unknown robots and terms, on sizes that are not the robot's, and if `make` fails.
/// @param name of the file; starts the messages if it is not empty
Result<std::string> solve_problems(const ProblemFile& file, const std::string& name, const SolverMaker& make);

}  // namespace steadyhand

#pragma once

#include <functional>
#include <memory>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/record/problem_json.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

using SolverMaker = std::function<Result<std::unique_ptr<Solver>>(const Ocp& ocp, double tolerance)>;

/// Solves each problem with a solver that `make` makes, and gives the solutions as `steadyhand solve` prints them.
/// Fails on robots and terms that there are not, on sizes that are not the robot's, and where `make` does.
/// @param name of the file, begins the messages if it is not empty
Result<std::string> solve_problems(const ProblemFile& file, const std::string& name, const SolverMaker& make);

}  // namespace steadyhand

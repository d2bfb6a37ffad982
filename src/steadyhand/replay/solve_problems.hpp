#pragma once

#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/record/problem_json.hpp"

namespace steadyhand {

/// Solves each problem with the solver of that name, and gives the solutions as `steadyhand solve` prints them. Fails
/// on robots, solvers and terms that there are not, and on sizes that are not the robot's.
/// @param name of the file, begins the messages if it is not empty
Result<std::string> solve_problems(const ProblemFile& file, const std::string& name, const std::string& solver);

}  // namespace steadyhand

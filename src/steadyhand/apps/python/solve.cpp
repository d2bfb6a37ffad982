#include "steadyhand/apps/python/module.hpp"
#include "steadyhand/planning/solve/solver.hpp"
#include "steadyhand/report/replay/solve_problems.hpp"

namespace steadyhand::python {

namespace {

/// JSON in, JSON out.
std::string solve(const std::string& problems, const std::string& name, const std::string& solver) {
  const Unlocked unlocked;
  const SolverMaker make = [&](const Ocp& ocp, double tolerance) { return make_solver(solver, ocp, tolerance); };
  return value_of(solve_problems(value_of(parse_problems(problems, name)), name, make));
}

}  // namespace

void bind_solve(nb::module_& module) {
  module.def("solve", &solve);
  nb::list names;
  for (const std::string& name : solver_names()) names.append(to_text(name));
  module.attr("solvers") = nb::tuple(names);
  module.attr("default_solver") = kDefaultSolver;
}

}  // namespace steadyhand::python

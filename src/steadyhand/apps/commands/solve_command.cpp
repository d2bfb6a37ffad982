#include <iostream>
#include <memory>

#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/planning/solve/solver.hpp"
#include "steadyhand/report/replay/solve_problems.hpp"

namespace steadyhand {

namespace {

struct SolveOptions {
  std::string problem;
  std::string solver = kDefaultSolver;
};

Status run_solve(const SolveOptions& options) {
  const Result<ProblemFile> file = read_problems(options.problem);
  if (!file) return file.error();
  const Result<std::string> answer = solve_problems(*file, options.problem, [&](const Ocp& ocp, double tolerance) {
    return make_solver(options.solver, ocp, tolerance);
  });
  if (!answer) return answer.error();
  std::cout << *answer << "\n";
  return Done{};
}

}  // namespace

void add_solve_command(CommandLine& app, Command& chosen) {
  const auto options = std::make_shared<SolveOptions>();
  CommandLine* command =
      app.add_subcommand("solve", "Solve planning problems given as JSON (docs/explanation/formulation.md)");
  command->add_option("problem", options->problem, "File with one problem, or an array of them solved in order")
      ->required();
  command->add_option("--solver", options->solver, "Solver: " + list_solvers())->capture_default_str();
  command->footer(
      "Prints status, objective, iterations, time_us, kkt_error, x and u of each, as JSON.\n"
      "Examples:\n"
      "  steadyhand solve problem.json\n"
      "  steadyhand replay --dump-problems --out out && steadyhand solve out/anti-slosh/problems.json");
  command->callback([options, &chosen] { chosen = [options] { return run_solve(*options); }; });
}

}  // namespace steadyhand

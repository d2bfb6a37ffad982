#include "steadyhand/replay/solve_problems.hpp"

#include <fmt/format.h>

#include <memory>

#include "steadyhand/config/robot_file.hpp"

namespace steadyhand {

namespace {

/// What consecutive problems share: robot, problem sizes and solver are made once for a run of equal ones.
struct Workshop {
  std::string robot;
  double tolerance = 0.0;
  RobotModel model;
  std::unique_ptr<Ocp> ocp;
  std::unique_ptr<Solver> solver;
  Solution solution;
};

Status prepare(Workshop& shop, const ProblemRecord& problem, const std::string& solver) {
  if (!shop.ocp || shop.robot != problem.robot) {
    Result<RobotModel> model = open_robot(problem.robot);
    if (!model) return model.error();
    shop.ocp.reset();
    shop.solver.reset();
    shop.model = *std::move(model);
    shop.robot = problem.robot;
  }
  if (!shop.ocp || shop.ocp->horizon() != problem.horizon || shop.ocp->dt() != problem.dt ||
      shop.tolerance != problem.tolerance) {
    OcpSettings settings;
    settings.horizon = problem.horizon;
    settings.dt = problem.dt;
    if (Status s = Ocp::check(settings); !s) return s;
    shop.solver.reset();
    shop.ocp = std::make_unique<Ocp>(shop.model, settings);
    Result<std::unique_ptr<Solver>> made = make_solver(solver, *shop.ocp, problem.tolerance);
    if (!made) return made.error();
    shop.solver = *std::move(made);
    shop.tolerance = problem.tolerance;
    shop.solution = Solution();
    shop.solution.prepare(*shop.ocp);
  }
  return Done{};
}

Status solve(Workshop& shop, const ProblemRecord& problem) {
  const Ocp& ocp = *shop.ocp;
  OcpInstance instance;
  instance.x0 = problem.x0;
  instance.reference = problem.reference;
  Result<std::vector<JointVector>> weights = ocp.weights(problem.weights);
  if (!weights) return weights.error();
  instance.weights = *std::move(weights);
  if (Status good = ocp.check(instance); !good) return good;
  Trajectory guess(ocp.dof(), ocp.horizon());
  if (problem.guess) {
    guess = *problem.guess;
  } else {
    guess.x[0] = problem.x0;  // constant velocity
    for (int k = 0; k < ocp.horizon(); ++k) guess.x[k + 1] = ocp.next(guess.x[k], guess.u[k]);
  }
  shop.solver->solve(instance, guess, nullptr, {}, shop.solution);
  return Done{};
}

}  // namespace

Result<std::string> solve_problems(const ProblemFile& file, const std::string& name, const std::string& solver) {
  Workshop shop;
  std::string answer;
  for (std::size_t i = 0; i < file.problems.size(); ++i) {
    const std::string where =
        (name.empty() ? "" : name + ": ") + (file.is_array ? fmt::format("problem[{}]: ", i) : "problem: ");
    if (Status s = prepare(shop, file.problems[i], solver); !s) return Error{where + s.error().message};
    if (Status s = solve(shop, file.problems[i]); !s) return Error{where + s.error().message};
    answer += (i == 0 ? "" : ",\n") + to_json(shop.solution);
  }
  return file.is_array ? "[" + answer + "]" : answer;
}

}  // namespace steadyhand

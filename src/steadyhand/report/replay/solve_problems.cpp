#include "steadyhand/report/replay/solve_problems.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "steadyhand/files/config/open.hpp"

namespace steadyhand {

namespace {

/// Robot, problem sizes and solver, made once for consecutive problems that share them.
struct PreparedSolver {
  std::string robot;
  double tolerance = 0.0;
  RobotModel model;
  std::unique_ptr<Ocp> ocp;
  std::unique_ptr<Solver> solver;
  Solution solution;
};

Status prepare(PreparedSolver& prepared, const ProblemRecord& problem, const SolverMaker& make) {
  if (!prepared.ocp || prepared.robot != problem.robot) {
    Result<RobotModel> model = open_robot(problem.robot);
    if (!model) return model.error();
    prepared.ocp.reset();
    prepared.solver.reset();
    prepared.model = *std::move(model);
    prepared.robot = problem.robot;
  }
  int rows = static_cast<int>(problem.near.size());
  if (rows > 0) rows = std::max(rows, kUsualObstacleRows);
  OcpSettings settings;
  settings.weights = problem.weights;
  add_optional_objectives(settings);
  if (problem.tools != prepared.model.tool_count()) {
    return Error{fmt::format("has references for {} tools; robot '{}' has {}", problem.tools, problem.robot,
                             prepared.model.tool_count())};
  }
  if (!problem.liquid.empty()) settings.liquid = problem.liquid[0].settings;
  const auto names = [](const Objectives& objectives) {
    std::vector<std::string> result;
    for (const auto& each : objectives) result.push_back(each->name());
    return result;
  };
  const LiquidSettings* liquid = prepared.ocp ? prepared.ocp->liquid() : nullptr;
  const bool same_liquid = settings.liquid ? liquid && *liquid == *settings.liquid : !liquid;
  if (!prepared.ocp || !same_liquid || prepared.ocp->horizon() != problem.horizon ||
      prepared.ocp->obstacle_rows() != rows || prepared.ocp->position_margin() != problem.position_margin ||
      prepared.ocp->dt() != problem.dt || names(prepared.ocp->objectives()) != names(settings.objectives) ||
      prepared.tolerance != problem.tolerance) {
    settings.horizon = problem.horizon;
    settings.dt = problem.dt;
    settings.obstacle_rows = rows;
    settings.position_margin = problem.position_margin;
    if (Status s = Ocp::check(settings); !s) return s;
    prepared.solver.reset();
    prepared.ocp = std::make_unique<Ocp>(prepared.model, settings);
    Result<std::unique_ptr<Solver>> made = make(*prepared.ocp, problem.tolerance);
    if (!made) return made.error();
    prepared.solver = *std::move(made);
    prepared.tolerance = problem.tolerance;
    prepared.solution = Solution();
    prepared.solution.prepare(*prepared.ocp);
  }
  return Done{};
}

Status solve(PreparedSolver& prepared, const ProblemRecord& problem) {
  const Ocp& ocp = *prepared.ocp;
  OcpInstance instance;
  instance.x0 = problem.x0;
  instance.reference = problem.reference;
  instance.near = problem.near;
  instance.near.resize(ocp.obstacle_rows());
  instance.u_followed = problem.u_followed;
  instance.clearance = problem.clearance;
  instance.given = problem.given;
  if (problem.held) instance.held = *problem.held;
  for (std::size_t t = 0; t < problem.liquid.size(); ++t) {
    const auto& [settings, counts, room, state] = problem.liquid[t];
    const GlassSettings& glass = settings.glass;
    instance.liquid[t] = {SloshModel(glass, ocp.dt(), settings.frequencies), glass, counts, room, state};
  }
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
  prepared.solver->solve(instance, guess, nullptr, {}, prepared.solution);
  return Done{};
}

}  // namespace

Result<std::string> solve_problems(const ProblemFile& file, const std::string& name, const SolverMaker& make) {
  PreparedSolver prepared;
  std::string answer;
  for (std::size_t i = 0; i < file.problems.size(); ++i) {
    const std::string where =
        (name.empty() ? "" : name + ": ") + (file.is_array ? fmt::format("problem[{}]: ", i) : "problem: ");
    if (Status s = prepare(prepared, file.problems[i], make); !s) return Error{where + s.error().message};
    if (Status s = solve(prepared, file.problems[i]); !s) return Error{where + s.error().message};
    answer += (i == 0 ? "" : ",\n") + to_json(prepared.solution);
  }
  return file.is_array ? "[" + answer + "]" : answer;
}

}  // namespace steadyhand

/// Kept problems, each solved several times: the smallest time of each, which depends least on other load of the
/// machine; see bench/README.md.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/files/config/open.hpp"
#include "support/problem_set.hpp"

namespace steadyhand::bench {
namespace {

struct Options {
  std::string robot = "ur5e", solver = "realtime";
  std::vector<std::string> files;
  int repetitions = 3;
  SolveBudget budget;
  bool cold = false, json = false;
};

/// A solver and what it writes into, for one profile and horizon.
struct Bench {
  Bench(const RobotModel& model, const Profile& profile, const OcpSettings& settings, const std::string& name)
      : ocp(model, settings), solver(*make_solver(name, ocp, profile.tolerance)) {
    solution.prepare(ocp);
  }
  Ocp ocp;
  std::unique_ptr<Solver> solver;
  Solution solution;
};

/// As if nothing had been solved before.
void forget(const Ocp& ocp, PosedProblem& problem) {
  problem.multipliers.clear();
  problem.guess.x[0] = problem.instance.x0;
  for (int k = 0; k < ocp.horizon(); ++k) {
    problem.guess.u[k].setZero();
    problem.guess.x[k + 1] = ocp.next(problem.guess.x[k], problem.guess.u[k]);
  }
}

int main_with(const Options& options) {
  const auto fail = [](const Error& error) {
    std::cerr << error.message << "\n";
    return 2;
  };
  const auto model = open_robot(options.robot);
  if (!model) return fail(model.error());
  std::map<std::pair<std::string, int>, std::unique_ptr<Bench>> benches;
  for (const std::filesystem::path file : options.files) {
    auto problems = read_problem_set(file, model->dof());
    if (!problems) return fail(problems.error());
    std::vector<double> times;
    double iterations = 0.0;
    int most = 0, unsolved = 0;
    for (PosedProblem& problem : *problems) {
      std::unique_ptr<Bench>& bench = benches[{problem.profile, problem.horizon}];
      if (!bench) {
        const auto profile = load_profile(problem.profile);
        if (!profile) return fail(profile.error());
        OcpSettings settings = profile->ocp;
        settings.horizon = problem.horizon;
        bench = std::make_unique<Bench>(*model, *profile, settings, options.solver);
      }
      const auto weights = bench->ocp.weights(problem.weights);
      if (!weights) return fail(weights.error());
      problem.instance.weights = *weights;
      problem.instance.near.resize(bench->ocp.obstacle_rows());
      if (options.cold) forget(bench->ocp, problem);
      const Multipliers multipliers = kept_multipliers(problem, bench->ocp);
      double least = std::numeric_limits<double>::infinity();
      for (int i = 0; i < options.repetitions; ++i) {
        bench->solver->solve(problem.instance, problem.guess, problem.multipliers.empty() ? nullptr : &multipliers,
                             options.budget, bench->solution);
        least = std::min(least, bench->solution.time_us);
      }
      const Solution& solution = bench->solution;
      times.push_back(least);
      iterations += solution.iterations;
      most = std::max(most, solution.iterations);
      unsolved += solution.status != SolveStatus::kSolved;
      if (options.json) {
        std::cout << nlohmann::json{{"file", file.stem().string()},         {"problem", problem.name},
                                    {"status", to_string(solution.status)}, {"us", least},
                                    {"iterations", solution.iterations},    {"objective", solution.objective},
                                    {"violation", solution.violation},      {"kkt_error", solution.kkt_error}}
                         .dump()
                  << "\n";
      }
    }
    if (options.json || times.empty()) continue;
    double total = 0.0;
    for (const double t : times) total += t;
    const auto count = static_cast<double>(times.size());
    std::sort(times.begin(), times.end());
    const auto at = [&](double share) {
      return times[std::min(times.size() - 1, static_cast<std::size_t>(share * count))];
    };
    fmt::print(
        "{:40} {:6} mean {:8.2f} p50 {:8.2f} p99 {:8.2f} p99.9 {:8.2f} max {:9.2f} us  it. {:6.2f} most {:4}  "
        "unsolved {}\n",
        file.stem().string(), times.size(), total / count, at(0.5), at(0.99), at(0.999), times.back(),
        iterations / count, most, unsolved);
  }
  return 0;
}

}  // namespace
}  // namespace steadyhand::bench

int main(int argc, char** argv) {
  using namespace steadyhand::bench;
  Options options;
  steadyhand::CommandLine app("bench_problems", "Times of kept problems, the smallest of several repetitions");
  app.add_option("files", options.files, "Files that `bench_solvers --keep` wrote")->required();
  app.add_option("--robot", options.robot, "Name, robot file or URDF")->capture_default_str();
  app.add_option("--solver", options.solver, "Solver")->capture_default_str();
  app.add_option("--repetitions", options.repetitions, "Solves of each problem")->capture_default_str();
  app.add_option("--budget-iterations", options.budget.iterations, "Iteration budget (default: by the horizon)");
  app.add_flag("--cold", options.cold, "From a constant velocity instead of the kept guess and multipliers");
  app.add_flag("--json", options.json, "One JSON object a problem instead of a table");
  const steadyhand::Result<bool> parsed = app.parse(argc, argv);
  if (!parsed) std::cerr << parsed.error().message << "\n";
  if (!parsed || !*parsed) return parsed ? 0 : 2;
  return main_with(options);
}

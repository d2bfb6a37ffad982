/// Closed loops of our solvers on easy and hard sequences; see bench/README.md.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "closed_loop.hpp"
#include "steadyhand/apps/commands/command_line.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/record/problem_json.hpp"
#include "support/problem_set.hpp"

namespace steadyhand::bench {
namespace {

struct Options {
  std::string robot = "ur5e";
  std::vector<std::string> solvers{"realtime"}, profiles{"tracking", "anti-slosh", "waiter"}, sequences;
  std::vector<int> horizons{8}, objects{0};
  int solves = 2000;  ///< for each combination
  int sample = 0;     ///< how many of them are solved by FATROP too, cold, and written
  unsigned seed = 1;
  SolveBudget budget;
  std::filesystem::path problems;  ///< folder for the sampled problems
  std::filesystem::path keep;      ///< folder for problems as they were posed
  int keep_every = 1;              ///< keep one problem in so many
  int keep_above = 0;              ///< and only those with more iterations, or unsolved
  bool json = false;
};

/// The problem that the loop poses.
PosedProblem posed(const std::string& name, const Profile& profile, const OcpSettings& settings,
                   const ClosedLoop& loop) {
  PosedProblem problem{
      name, profile.name, settings.horizon, settings.weights, loop.instance(), loop.warm_start().guess(), {}};
  if (const Multipliers* multipliers = loop.warm_start().multipliers()) {
    for (const int r : multipliers->stored()) {
      for (int k = 0; k <= settings.horizon; ++k) {
        const ConstraintRow row = multipliers->row(r);
        if (const double m = multipliers->find(r)[k]; m != 0.0) {
          problem.multipliers.push_back({k, loop.ocp().constraints()[row.constraint]->name(), row.row, m});
        }
      }
    }
  }
  return problem;
}

constexpr int kRepetitions = 3;  ///< of sampled problems

double percentile(const std::vector<double>& sorted, double share) {
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

/// FATROP's solutions from a cold start, compared with the solver's.
struct Comparison {
  int compared = 0, better = 0, same = 0, worse = 0, only_fatrop = 0, only_ours = 0;

  void add(const Solution& ours, const Solution& fatrop) {
    const auto feasible = [](const Solution& s) {
      return s.status == SolveStatus::kSolved || s.status == SolveStatus::kFeasible;
    };
    ++compared;
    if (!feasible(fatrop) || !feasible(ours)) {
      only_fatrop += feasible(fatrop) && !feasible(ours);
      only_ours += feasible(ours) && !feasible(fatrop);
      return;
    }
    const double relative = (ours.objective - fatrop.objective) / std::max(std::abs(fatrop.objective), 1e-9);
    (relative > 1e-4 ? worse : relative < -1e-4 ? better : same) += 1;
  }
};

Result<nlohmann::json> run(const Options& options, const RobotModel& model, const Reach& reach,
                           const Sequence& sequence, const Profile& profile, int horizon, int objects,
                           const std::string& name) {
  OcpSettings settings = profile.ocp;
  if (objects > 0) settings.obstacle_rows = kUsualObstacleRows;
  settings.horizon = horizon;
  const Ocp ocp(model, settings);
  auto solver = *make_solver(name, ocp, profile.tolerance);
  std::unique_ptr<Solver> reference;
  if (options.sample > 0) {
    auto fatrop = make_solver("fatrop", ocp, profile.tolerance);
    if (!fatrop) return fatrop.error();
    reference = *std::move(fatrop);
  }
  Solution cold;
  cold.prepare(ocp);
  ClosedLoop loop(ocp, *ocp.weights(settings.weights), sequence, reach, make_obstacles(model, objects, options.seed),
                  options.seed);

  std::ofstream kept;
  if (!options.keep.empty()) {
    kept.open(options.keep / fmt::format("{}-{}-{}.txt", sequence.name, profile.name, horizon));
    if (!kept) return Error{fmt::format("{}: cannot be written to", options.keep.string())};
  }
  std::vector<double> times, times_of_iterations, times_of_choosing;
  double iterations = 0.0;
  int most = 0, unsolved = 0, infeasible = 0;
  Comparison comparison;
  std::vector<ProblemRecord> sampled;
  double sampled_us = 0.0;  // sum over the sampled problems, each the least of several solves
  Solution again;
  again.prepare(ocp);
  const int every = options.sample > 0 ? std::max(1, options.solves / options.sample) : 0;
  for (int i = 0; i < options.solves; ++i) {
    loop.pose();
    Solution& solution = loop.solution();
    solver->solve(loop.instance(), loop.warm_start().guess(), loop.warm_start().multipliers(), options.budget,
                  solution);
    times.push_back(solution.time_us);
    times_of_choosing.push_back(loop.choosing_us());
    times_of_iterations.push_back(solution.time_us / std::max(1, solution.iterations));
    iterations += solution.iterations;
    most = std::max(most, solution.iterations);
    unsolved += solution.status != SolveStatus::kSolved;
    infeasible += solution.status == SolveStatus::kInfeasible;
    if (kept.is_open() && i % options.keep_every == 0 &&
        (solution.iterations > options.keep_above || solution.status != SolveStatus::kSolved)) {
      write(posed(fmt::format("{}-{}-{}", sequence.name, options.seed, i), profile, settings, loop), kept);
    }
    if (every > 0 && i % every == every / 2) {
      double least = solution.time_us;
      for (int repetition = 1; repetition < kRepetitions; ++repetition) {
        solver->solve(loop.instance(), loop.warm_start().guess(), loop.warm_start().multipliers(), options.budget,
                      again);
        least = std::min(least, again.time_us);
      }
      sampled_us += least;
      sampled.push_back(to_record(ocp, loop.instance(), loop.warm_start().guess(), profile.tolerance));
      Trajectory still(ocp.dof(), horizon);
      for (StateVector& x : still.x) x = loop.instance().x0;
      reference->solve(loop.instance(), still, nullptr, {}, cold);
      comparison.add(solution, cold);
    }
    loop.advance();
  }
  std::sort(times.begin(), times.end());
  std::sort(times_of_choosing.begin(), times_of_choosing.end());
  std::sort(times_of_iterations.begin(), times_of_iterations.end());
  double total = 0.0;
  for (const double t : times) total += t;
  if (!options.problems.empty()) {
    const std::string file = fmt::format("{}-{}-{}-{}.json", name, sequence.name, profile.name, horizon);
    if (Status s = write_problems(sampled, options.problems / file); !s) return s.error();
  }
  return nlohmann::json{{"solver", name},
                        {"sequence", sequence.name},
                        {"hard", sequence.hard},
                        {"profile", profile.name},
                        {"horizon", horizon},
                        {"objects", objects},
                        {"choosing_us", percentile(times_of_choosing, 0.5)},
                        {"solves", options.solves},
                        {"mean_us", total / options.solves},
                        {"p50_us", percentile(times, 0.5)},
                        {"p99_us", percentile(times, 0.99)},
                        {"p999_us", percentile(times, 0.999)},
                        {"worst_us", times.back()},
                        {"iteration_us", percentile(times_of_iterations, 0.5)},
                        {"sampled_us", sampled.empty() ? 0.0 : sampled_us / static_cast<double>(sampled.size())},
                        {"iterations", iterations / options.solves},
                        {"most_iterations", most},
                        {"unsolved", unsolved},
                        {"infeasible", infeasible},
                        {"compared", comparison.compared},
                        {"better", comparison.better},
                        {"same", comparison.same},
                        {"worse", comparison.worse},
                        {"only_fatrop", comparison.only_fatrop},
                        {"only_ours", comparison.only_ours}};
}

int main_with(const Options& options) {
  const auto fail = [](const Error& error) {
    std::cerr << error.message << "\n";
    return 2;
  };
  for (const std::string& name : options.solvers) {
    const auto& known = solver_names();
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      return fail({fmt::format("--solver is '{}'; the solvers are {}", name, fmt::join(known, ", "))});
    }
  }
  for (const int horizon : options.horizons) {
    if (horizon < 1 || horizon > kMaxHorizon) {
      return fail({fmt::format("--horizon is {}; it must be from 1 to {}", horizon, kMaxHorizon)});
    }
  }
  for (const int objects : options.objects) {
    if (objects < 0 || objects > Obstacles::kMost) {
      return fail({fmt::format("--objects is {}; it must be from 0 to {}", objects, Obstacles::kMost)});
    }
  }
  if (options.sample < 0 || options.sample > options.solves) {
    return fail({fmt::format("--sample is {}; it must be from 0 to --solves, {}", options.sample, options.solves)});
  }
  if (options.solves < 1) return fail({fmt::format("--solves is {}; it must be at least 1", options.solves)});
  const auto model = open_robot(options.robot);
  if (!model) return fail(model.error());
  const auto sequences = make_sequences(*model, options.seed);
  if (!sequences) return fail(sequences.error());
  std::vector<std::string> names;
  for (const Sequence& sequence : *sequences) names.push_back(sequence.name);
  for (const std::string& name : options.sequences) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      return fail({fmt::format("--sequence is '{}'; the sequences are {}", name, fmt::join(names, ", "))});
    }
  }
  std::vector<Profile> profiles;
  for (const std::string& name : options.profiles) {
    auto profile = load_profile(name);
    if (!profile) return fail(profile.error());
    profiles.push_back(*std::move(profile));
  }

  const Reach reach = compute_reach(*model);
  if (!options.json) {
    fmt::print("{:9} {:16} {:11} {:>3} {:>7} {:>8} {:>8} {:>8} {:>8} {:>9} {:>6} {:>4} {:>8} {:>10}  {}\n", "solver",
               "sequence", "profile", "N", "objects", "mean us", "p50", "p99", "p99.9", "worst", "it.", "most",
               "unsolved", "infeasible",
               options.sample ? "FATROP cold: same/ours better/worse/only FATROP/only ours" : "");
  }
  for (const std::string& name : options.solvers) {
    for (const Sequence& sequence : *sequences) {
      if (!options.sequences.empty() &&
          std::find(options.sequences.begin(), options.sequences.end(), sequence.name) == options.sequences.end()) {
        continue;
      }
      for (const Profile& profile : profiles) {
        for (const int horizon : options.horizons) {
          for (const int objects : options.objects) {
            const auto result = run(options, *model, reach, sequence, profile, horizon, objects, name);
            if (!result) return fail(result.error());
            const nlohmann::json& r = *result;
            if (options.json) {
              std::cout << r.dump() << std::endl;
              continue;
            }
            const auto number = [&](const char* key) { return r[key].get<double>(); };
            const auto count = [&](const char* key) { return r[key].get<int>(); };
            std::string compared;
            if (options.sample) {
              compared = fmt::format("{}/{}/{}/{}/{}", count("same"), count("better"), count("worse"),
                                     count("only_fatrop"), count("only_ours"));
            }
            fmt::print(
                "{:9} {:16} {:11} {:3} {:7} {:8.1f} {:8.1f} {:8.1f} {:8.1f} {:9.1f} {:6.2f} {:4} {:8} {:10}  {}\n",
                name, sequence.name, profile.name, horizon, objects, number("mean_us"), number("p50_us"),
                number("p99_us"), number("p999_us"), number("worst_us"), number("iterations"), count("most_iterations"),
                count("unsolved"), count("infeasible"), compared);
            std::fflush(stdout);
          }
        }
      }
    }
  }
  return 0;
}

}  // namespace
}  // namespace steadyhand::bench

int main(int argc, char** argv) {
  using namespace steadyhand::bench;
  Options options;
  steadyhand::CommandLine app("bench_solvers", "Closed loops of the solvers on easy and hard sequences");
  app.add_option("--robot", options.robot, "Name, robot file or URDF")->capture_default_str();
  app.add_option("--solver", options.solvers, "Solvers")->capture_default_str();
  app.add_option("--sequence", options.sequences, "Sequences (default: all)");
  app.add_option("--profile", options.profiles, "Profiles")->capture_default_str();
  app.add_option("--horizon", options.horizons, "Horizons, intervals")->capture_default_str();
  app.add_option("--objects", options.objects, "Objects around the arm")->capture_default_str();
  app.add_option("--solves", options.solves, "Solves of each combination")->capture_default_str();
  app.add_option("--sample", options.sample, "How many of them FATROP solves too, from a cold start");
  app.add_option("--problems", options.problems, "Folder for the sampled problems, in the form that `solve` reads");
  app.add_option("--keep", options.keep, "Folder for problems as they were posed, which bench_problems reads");
  app.add_option("--keep-every", options.keep_every, "Keep one of so many")->capture_default_str();
  app.add_option("--keep-above", options.keep_above, "Of these, those of more iterations, and those unsolved")
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Of sequences and noise")->capture_default_str();
  app.add_option("--budget-us", options.budget.time_us, "Time budget of a solve, 0: none")->capture_default_str();
  app.add_option("--budget-iterations", options.budget.iterations, "Iteration budget (default: by the horizon)");
  app.add_flag("--json", options.json, "One JSON object a line instead of a table");
  const steadyhand::Result<bool> parsed = app.parse(argc, argv);
  if (!parsed) std::cerr << parsed.error().message << "\n";
  if (!parsed || !*parsed) return parsed ? 0 : 2;
  return main_with(options);
}

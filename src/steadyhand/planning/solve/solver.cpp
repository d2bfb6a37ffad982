#include "steadyhand/planning/solve/solver.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "steadyhand/core/texts.hpp"
#ifdef STEADYHAND_FATROP
#include "steadyhand/planning/solve/fatrop/fatrop.hpp"
#endif
#include "steadyhand/planning/solve/realtime/realtime.hpp"

namespace steadyhand {

std::string_view to_string(SolveStatus status) {
  using enum SolveStatus;
  static constexpr std::pair<SolveStatus, std::string_view> kTexts[] = {
      {kSolved, "solved"},
      {kFeasible, "feasible"},
      {kInfeasible, "infeasible"},
      {kInvalid, "invalid"},
  };
  return text_of(kTexts, status);
}

void Solution::prepare(const Ocp& ocp) {
  trajectory = Trajectory(ocp.dof(), ocp.horizon());
  multipliers.prepare(ocp);
}

namespace {

struct Entry {
  const char* name;
  std::unique_ptr<Solver> (*make)(const Ocp& ocp, double tolerance);
};
constexpr Entry kSolvers[] = {
#ifdef STEADYHAND_FATROP
    {"fatrop", make_fatrop_solver},
#endif
    {"realtime", make_realtime_solver},
};

}  // namespace

const std::vector<std::string>& solver_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Entry& entry : kSolvers) all.emplace_back(entry.name);
    return all;
  }();
  return names;
}

std::string list_solvers() {
#ifdef STEADYHAND_FATROP
  return fmt::format("{}", fmt::join(solver_names(), ", "));
#else
  return fmt::format("{}; fatrop needs a build with -DSTEADYHAND_WITH_FATROP=ON", fmt::join(solver_names(), ", "));
#endif
}

Result<std::unique_ptr<Solver>> make_solver(std::string_view name, const Ocp& ocp, double tolerance) {
  if (ocp.objectives().size() > kMaxObjectives) {
    return Error{fmt::format("{} objectives; a problem has at most {}", ocp.objectives().size(), kMaxObjectives)};
  }
  for (const Entry& entry : kSolvers) {
    if (name == entry.name) return entry.make(ocp, tolerance);
  }
  return Error{fmt::format("unknown solver '{}'; the solvers are {}", name, list_solvers())};
}

}  // namespace steadyhand

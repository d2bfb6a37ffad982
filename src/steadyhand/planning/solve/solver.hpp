#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"
#include "steadyhand/planning/solve/multipliers.hpp"

namespace steadyhand {

struct SolveBudget {
  double time_us = 0.0;  ///< 0: none
  /// At most; none: usual_iterations().
  std::optional<int> iterations;
};

/// Where a solve ends that nobody limits. One at N = 8 takes 1 to 8 in the mean, and of ten million none took more than
/// 231; at N = 64 they take 4 to 17, but some need several hundred.
inline int usual_iterations(int horizon) { return std::max(250, 16 * horizon); }

enum class SolveStatus {
  kSolved,    ///< KKT conditions met to the tolerance, all constraints checked
  kFeasible,  ///< inside all constraints to the tolerance, but the optimum was not reached (budget, or the solver gave
              ///< up)
  kInfeasible,  ///< no point inside the constraints was found; what comes back violates them least, of what was seen
  kInvalid,     ///< the instance or the guess has wrong sizes or numbers that are not finite; nothing was solved
};

std::string_view to_string(SolveStatus status);

/// Result of a solve. Sizes are set by prepare(); a solver writes into it without allocating.
struct Solution {
  SolveStatus status = SolveStatus::kInvalid;
  Trajectory trajectory;
  Multipliers multipliers;
  double objective = 0.0;  ///< J
  double violation = 0.0;  ///< see Evaluation::violation
  double kkt_error = 0.0;  ///< see kkt_error()
  int iterations = 0;
  double time_us = 0.0;  ///< wall time of the solve

  void prepare(const Ocp& ocp);
};

/// A solver of one Ocp. Not thread-safe; the Ocp must outlive it. Memory is taken when it is made.
class Solver {
 public:
  virtual ~Solver() = default;
  virtual std::string_view name() const = 0;

  /// @param guess starting point of the primal variables; x_0 is taken from the instance, other states need not obey
  /// the dynamics.
  /// @param multipliers starting point of Solution::multipliers, or null
  virtual void solve(const OcpInstance& instance, const Trajectory& guess, const Multipliers* multipliers,
                     const SolveBudget& budget, Solution& solution) = 0;

 protected:
  Solver() = default;
};

/// What is used where nobody names one: our own.
inline constexpr const char* kDefaultSolver = "realtime";
/// Names that make_solver knows: with STEADYHAND_WITH_FATROP=ON also "fatrop", the reference.
const std::vector<std::string>& solver_names();
/// The same as text, with what to build for a solver that is left out.
std::string list_solvers();
/// @param tolerance of the KKT conditions, > 0
Result<std::unique_ptr<Solver>> make_solver(std::string_view name, const Ocp& ocp, double tolerance);

}  // namespace steadyhand

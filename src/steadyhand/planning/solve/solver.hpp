#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

class Evaluation;

/// Lagrange multipliers of the constraint rows at the nodes, negative at a lower bound, positive at an upper one. Few
/// rows ever have any: the others are not stored and cost no time. A stored row has a number for each node k = 0..N,
/// which is 0 where the row does not act. prepare() allocates all memory.
class Multipliers {
 public:
  Multipliers() = default;
  Multipliers(const Multipliers&) = default;  ///< allocates
  /// Between equal sizes copies only the stored rows and allocates nothing.
  Multipliers& operator=(const Multipliers& other) {
    if (this == &other) return *this;
    if (!same_sizes(other)) {
      nodes_ = other.nodes_;
      first_ = other.first_;
      place_.assign(other.place_.size(), kNowhere);
      stored_.reserve(other.place_.size());
      values_.resize(other.values_.size());
    }
    clear();
    for (const int r : other.stored_) std::copy_n(other.find(r), nodes_, store(r));
    return *this;
  }

  /// For the rows of this problem, all 0.
  void prepare(const Ocp& ocp) {
    first_.clear();
    int rows = 0;
    for (const auto& constraint : ocp.constraints()) {
      first_.push_back(rows);
      rows += constraint->rows();
    }
    nodes_ = ocp.horizon() + 1;
    place_.assign(rows, kNowhere);
    stored_.clear();
    stored_.reserve(rows);
    values_.assign(static_cast<std::size_t>(rows) * nodes_, 0.0);
  }
  /// Whether both are for the same numbers of rows and nodes.
  bool same_sizes(const Multipliers& other) const {
    return first_ == other.first_ && place_.size() == other.place_.size() && nodes_ == other.nodes_;
  }
  /// Whether each is a number.
  bool all_finite() const {
    const auto used = static_cast<std::ptrdiff_t>(stored_.size()) * nodes_;
    return std::all_of(values_.begin(), values_.begin() + used, [](double m) { return std::isfinite(m); });
  }

  /// Multiplier of a row at node k.
  double at(int k, ConstraintRow row) const {
    const double* numbers = find(index(row));
    return numbers ? numbers[k] : 0.0;
  }
  /// The same, from now on.
  void set(int k, ConstraintRow row, double value) { store(index(row))[k] = value; }

  /// All 0.
  void clear() {
    for (const int r : stored_) place_[r] = kNowhere;
    stored_.clear();
  }
  /// Sets those of this row to 0.
  void clear(ConstraintRow row) {
    if (place_[index(row)] != kNowhere) std::fill_n(store(index(row)), nodes_, 0.0);
  }

  // ---- by index: rows are counted through all constraints
  /// Index of a row.
  int index(ConstraintRow row) const { return first_[row.constraint] + row.row; }
  /// The row of an index.
  ConstraintRow row(int r) const {
    const auto next = std::upper_bound(first_.begin(), first_.end(), r);
    const int constraint = static_cast<int>(next - first_.begin()) - 1;
    return {constraint, r - first_[constraint]};
  }
  /// Indices of the stored rows, in the order of insertion.
  const std::vector<int>& stored() const { return stored_; }
  /// Numbers of a row by node; null where it is not stored.
  const double* find(int r) const {
    return place_[r] == kNowhere ? nullptr : values_.data() + static_cast<std::size_t>(place_[r]) * nodes_;
  }
  /// The same, stored from now on: 0 at first.
  double* store(int r) {
    if (place_[r] == kNowhere) {
      place_[r] = static_cast<int>(stored_.size());
      stored_.push_back(r);
      std::fill_n(values_.begin() + static_cast<std::ptrdiff_t>(place_[r]) * nodes_, nodes_, 0.0);
    }
    return values_.data() + static_cast<std::size_t>(place_[r]) * nodes_;
  }

  /// Whether all numbers are the same, stored or not.
  friend bool operator==(const Multipliers& a, const Multipliers& b) { return a.covers(b) && b.covers(a); }

 private:
  static constexpr int kNowhere = -1;

  /// Whether all rows stored here have the same numbers there.
  bool covers(const Multipliers& other) const {
    return same_sizes(other) && std::all_of(stored_.begin(), stored_.end(), [&](int r) {
             const double *mine = find(r), *its = other.find(r);
             return its ? std::equal(mine, mine + nodes_, its)
                        : std::all_of(mine, mine + nodes_, [](double m) { return m == 0.0; });
           });
  }

  int nodes_ = 0;
  std::vector<int> first_;      ///< index of each constraint's first row
  std::vector<int> place_;      ///< by row: where it is stored
  std::vector<int> stored_;     ///< rows by place
  std::vector<double> values_;  ///< by place and node
};

/// Distance of a trajectory with multipliers from a KKT point of the problem: the largest of
/// - the gradient of the Lagrangian by every u_k that is not given, states eliminated through the dynamics (the
/// costates
///   are exact),
/// - the violation of rows and dynamics,
/// - |multiplier * slack| of every row; of one with a price and outside its bounds (price - |multiplier|) * excess,
/// - the excess of a multiplier over its row's price,
/// - wrong signs of multipliers of one-sided rows.
/// Unscaled, in the units of the problem. `evaluation` must be set to the trajectory. Allocates nothing.
double kkt_error(const Evaluation& evaluation, const Trajectory& trajectory, const Multipliers& multipliers);

/// Limits of a solve.
struct SolveBudget {
  double time_us = 0.0;  ///< us; 0: none
  /// At most; none: usual_iterations().
  std::optional<int> iterations;
};

/// Usual limit of iterations. A solve at N = 8 takes 1 to 8 in the mean, and of ten million none took more than
/// 231; at N = 64 they take 4 to 17, but some need several hundred.
inline int usual_iterations(int horizon) { return std::max(250, 16 * horizon); }

/// Outcome of a solve.
enum class SolveStatus {
  kSolved,    ///< KKT conditions met to the tolerance, all constraints checked
  kFeasible,  ///< inside all constraints to the tolerance, but the optimum was not reached (budget, or the solver gave
              ///< up)
  kInfeasible,  ///< no point inside the constraints was found; the result violates them least of all points seen
  kInvalid,     ///< the instance or the guess has wrong sizes or numbers that are not finite; nothing was solved
};

/// Text for messages: "solved", "feasible", "infeasible", "invalid".
std::string_view to_string(SolveStatus status);

/// Result of a solve. Sizes are set by prepare(); a solver writes into it without allocating.
struct Solution {
  SolveStatus status = SolveStatus::kInvalid;  ///< outcome
  Trajectory trajectory;                       ///< x and u
  Multipliers multipliers;                     ///< multipliers of the constraints' rows
  double objective = 0.0;                      ///< J
  double violation = 0.0;                      ///< see Evaluation::violation
  double kkt_error = 0.0;                      ///< see kkt_error()
  int iterations = 0;                          ///< Newton steps
  double time_us = 0.0;                        ///< wall time of the solve

  void prepare(const Ocp& ocp);  ///< takes the memory
};

/// A solver of one Ocp. Not thread-safe; the Ocp must outlive it. Memory is taken when it is made.
class Solver {
 public:
  virtual ~Solver() = default;
  virtual std::string_view name() const = 0;  ///< see solver_names()

  /// @param guess starting point of the primal variables; x_0 is taken from the instance, other states need not obey
  /// the dynamics. Accelerations of joints that are given (OcpInstance::given) stay exactly as they are here.
  /// @param multipliers starting point of Solution::multipliers, or null
  virtual void solve(const OcpInstance& instance, const Trajectory& guess, const Multipliers* multipliers,
                     const SolveBudget& budget, Solution& solution) = 0;

 protected:
  Solver() = default;
};

/// Solver without an explicit choice: that of this library.
inline constexpr const char* kDefaultSolver = "realtime";
/// Names that make_solver knows: with STEADYHAND_WITH_FATROP=ON also "fatrop", the reference.
const std::vector<std::string>& solver_names();
/// The same as text, with what to build for a solver that is left out.
std::string list_solvers();
/// @param tolerance of the KKT conditions, > 0
Result<std::unique_ptr<Solver>> make_solver(std::string_view name, const Ocp& ocp, double tolerance);

}  // namespace steadyhand

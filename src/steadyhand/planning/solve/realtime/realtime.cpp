#include "steadyhand/planning/solve/realtime/realtime.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "steadyhand/planning/solve/realtime/elastic_barrier.hpp"

namespace steadyhand {
namespace realtime {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// Share of the usual iterations for the guess: if it does not converge, another start gets the rest.
constexpr double kForGuess = 0.4;

/// The remaining time and iterations of a solve.
struct Budget {
  SteadyClock::time_point deadline;
  int iterations;
  int used = 0;

  bool spent() const {
    return used >= iterations || (deadline != SteadyClock::time_point::max() && SteadyClock::now() >= deadline);
  }
};

class Realtime final : public Solver {
 public:
  Realtime(const Ocp& ocp, double tolerance)
      : ocp_(ocp),
        n_(ocp.dof()),
        tolerance_(tolerance),
        barrier_(ocp),
        newton_(ocp),
        start_(ocp.entries(), {ocp.horizon()}),
        point_(start_),
        trial_(start_),
        step_(start_),
        fallback_(start_) {}

  std::string_view name() const override { return "realtime"; }

  void solve(const OcpInstance& instance, const Trajectory& guess, const Multipliers* multipliers,
             const SolveBudget& limits, Solution& solution) override {
    const auto start = SteadyClock::now();
    Budget budget{limits.time_us > 0.0 ? start + std::chrono::nanoseconds(std::llround(1e3 * limits.time_us))
                                       : SteadyClock::time_point::max(),
                  limits.iterations.value_or(usual_iterations(ocp_.horizon()))};
    solution.status = SolveStatus::kInvalid;
    if (ocp_.check(instance) && valid(guess, multipliers, solution)) {
      roll_out(instance, [&](int k, const StateVector&) -> const JointVector& { return guess.u[k]; });
      fallback_violation_ = std::numeric_limits<double>::infinity();
      const int all = budget.iterations;
      if (!limits.iterations) budget.iterations = static_cast<int>(kForGuess * all);
      bool solved = solve_from_point(instance, multipliers, budget);
      budget.iterations = all;
      if (!solved && !budget.spent()) {
        roll_out(instance, [&](int k, const StateVector& x) { return brake(x, instance.given, guess.u[k]); });
        solved = solve_from_point(instance, nullptr, budget);
      }
      if (!solved) retreat();
      write(instance, solved, solution);
    }
    solution.iterations = budget.used;
    solution.time_us = std::chrono::duration<double, std::micro>(SteadyClock::now() - start).count();
  }

 private:
  bool valid(const Trajectory& guess, const Multipliers* multipliers, const Solution& solution) const {
    if (std::ssize(guess.u) != ocp_.horizon()) return false;
    for (const JointVector& u : guess.u) {
      if (u.size() != n_ || !u.allFinite()) return false;
    }
    return multipliers == nullptr || (multipliers->same_sizes(solution.multipliers) && multipliers->all_finite());
  }

  /// point_ <- x_0 and what follows from the accelerations u(k, x_k).
  template <typename Input>
  void roll_out(const OcpInstance& instance, const Input& input) {
    const int padding = NodeOrder{ocp_.horizon()}.columns();
    StateVector x = instance.x0;
    for (int k = 0; k <= ocp_.horizon(); ++k) {
      for (int i = 0; i < 2 * n_; ++i) point_.set(i, k, x[i]);
      if (k == ocp_.horizon()) break;
      const JointVector u = input(k, x);
      for (int i = 0; i < n_; ++i) point_.set(2 * n_ + i, k, u[i]);
      x = ocp_.next(x, u);
    }
    for (int i = 0; i < 3 * n_; ++i) {
      for (int column = ocp_.horizon() + 1; column < padding; ++column) {
        point_[i][column / kLanes].set(column % kLanes, point_.at(i, 0));
      }
    }
  }

  /// From x_0 to rest as fast as half the robot's acceleration limits allow, then stationary; given joints as they are.
  JointVector brake(const StateVector& x, JointSet given, const JointVector& u) const {
    const JointVector limit = 0.5 * ocp_.model().acceleration_max;
    JointVector result = (-x.tail(n_) / ocp_.dt()).cwiseMax(-limit).cwiseMin(limit);
    for (int j = 0; j < n_; ++j)
      if (given[j]) result[j] = u[j];
    return result;
  }

  /// Solves from point_. True if point_ becomes a KKT point with all rows checked.
  bool solve_from_point(const OcpInstance& instance, const Multipliers* multipliers, Budget& budget) {
    start_ = point_;
    barrier_.forget_rows();
    newton_.separate(true);
    while (true) {
      const Outcome outcome = minimise(instance, multipliers, budget);
      if (outcome != Outcome::kMissedRows) return outcome == Outcome::kSolved;
      // The path may have violated a row that was not in the working set: solve again with that row in it.
      point_ = start_;
    }
  }

  enum class Outcome { kSolved, kMissedRows, kGaveUp };

  /// Follows the minimisers of the barrier problem from point_ as mu goes to zero.
  Outcome minimise(const OcpInstance& instance, const Multipliers* multipliers, Budget& budget) {
    const double last_mu = 0.1 * tolerance_;
    path_ = {};
    barrier_.begin(instance, point_, multipliers);
    keep(barrier_.violation());
    barrier_.start_slacks(multipliers ? warm_mu() : kColdMu);
    barrier_.differentiate();
    while (true) {
      const Residuals now = barrier_.residuals();
      if (now.kkt() <= tolerance_) {
        switch (barrier_.check_all_rows(tolerance_)) {
          case ElasticBarrier::Check::kNothingNew:
            return Outcome::kSolved;
          case ElasticBarrier::Check::kMissed:
            return Outcome::kMissedRows;
          case ElasticBarrier::Check::kMissedLinear:
            barrier_.differentiate();  // continues from here with the rows in the working set
            break;
        }
      } else if (barrier_.mu() <= last_mu) {
        // A minimiser that is not a solution lies outside of bounds: locally infeasible.
        if (std::max(now.dual, now.centrality) <= kConverged * last_mu) return Outcome::kGaveUp;
      } else if (std::max(now.dual, now.centrality) <= kCloseEnough * barrier_.mu()) {
        barrier_.set_mu(std::max(last_mu, std::min(0.2 * barrier_.mu(), std::pow(barrier_.mu(), 1.75))));
        continue;
      }
      if (budget.spent()) return Outcome::kGaveUp;
      ++budget.used;
      if (!descend()) return Outcome::kGaveUp;
      barrier_.watch();
      barrier_.differentiate();
    }
  }

  /// The nearer the start is to a solution, the smaller the barrier may be from the beginning.
  double warm_mu() {
    const double dual = barrier_.differentiate().dual;
    return std::clamp(kWarmMu * dual * dual, kLeastWarmMu, kMostWarmMu);
  }

  /// Result of an attempted step.
  enum class Step { kTaken, kNoDescent, kIndefinite };

  /// One Newton step with line search from point_, where barrier_ has been differentiated. False if there is no
  /// descent.
  bool descend() {
    const double unit = barrier_.curvature_scale();
    Step step = attempt(Curvature::kExact, 0.0);
    // Convex steps work well far from the solution. Many of them mean that the cost is flat there; then the exact
    // curvature matters.
    if (step == Step::kIndefinite && path_.convex_steps >= kPatience) {
      const double least = std::max(kLeastDamping * unit, path_.damping / 3.0);
      for (double damping = least; step == Step::kIndefinite && damping < kMostDamping * unit; damping *= 4.0) {
        step = attempt(Curvature::kExact, damping);
        path_.damping = damping;
      }
    }
    if (step != Step::kTaken) {
      step = attempt(Curvature::kConvex, 0.0);
      ++path_.convex_steps;
    }
    for (double damping = 1e-6 * unit; step != Step::kTaken && damping <= 1e6 * unit; damping *= 100.0) {
      step = attempt(Curvature::kExact, damping);
      if (step == Step::kIndefinite) step = attempt(Curvature::kConvex, damping);
    }
    return step == Step::kTaken;
  }

  Step attempt(Curvature curvature, double damping) {
    if (!find_step(curvature, damping, kSmallestPivot * barrier_.curvature_scale())) return Step::kIndefinite;
    return search() ? Step::kTaken : Step::kNoDescent;
  }

  /// Steps of a few hundredths move along the boundary without progress: slacks that are too small for their
  /// multipliers block the step. Starts the barrier again from here, with larger slacks.
  void leave_boundary(double taken) {
    path_.short_steps = taken < kShort ? path_.short_steps + 1 : 0;
    if (path_.short_steps < kJammed) return;
    path_.short_steps = 0;
    barrier_.start_slacks(std::clamp(100.0 * barrier_.mu(), 1e-4, kColdMu));
  }

  /// step_ <- the Newton step, with every limit in the working set that it leads to.
  bool find_step(Curvature curvature, double damping, double smallest_pivot) {
    do {
      barrier_.model(curvature, damping, newton_);
      if (!newton_.factorise(smallest_pivot)) return false;
      newton_.solve(step_);
    } while (barrier_.meet_limits(step_));
    return true;
  }

  /// Moves point_ along step_ until phi has decreased enough (Armijo).
  bool search() {
    const double phi = barrier_.merit(), slope = barrier_.complete(step_);
    if (!(slope < 0.0)) return false;
    const double noise = 1e-13 * std::abs(phi);  // phi is a sum of numbers of this size
    for (double scale = barrier_.largest_scale(); scale > 1e-8; scale *= 0.5) {
      if (barrier_.try_step(point_, scale) <= phi + 1e-4 * scale * slope + noise) {
        barrier_.accept();
        point_.set_sum(point_, scale, step_);
        leave_boundary(scale);
        return true;
      }
    }
    barrier_.move(point_);
    barrier_.differentiate();
    return false;
  }

  /// Remembers point_ if it is the first inside the constraints or violates them least so far.
  void keep(double violation) {
    if (fallback_violation_ <= tolerance_ || violation >= fallback_violation_) return;
    fallback_ = point_;
    fallback_violation_ = violation;
  }

  /// point_ <- the best that is known to be inside the constraints: the last iterate, else the furthest point from the
  /// fallback towards it.
  void retreat() {
    step_.set_sum(point_, -1.0, fallback_);
    barrier_.move(fallback_);
    const double fallback_objective = barrier_.objective();
    for (double scale = 1.0; scale > 1e-2; scale *= 0.5) {
      trial_.set_sum(fallback_, scale, step_);
      barrier_.move(trial_);
      barrier_.check_all_rows(tolerance_);
      const double violation = barrier_.violation();
      const bool better = fallback_violation_ <= tolerance_
                              ? violation <= tolerance_ && barrier_.objective() < fallback_objective
                              : violation < fallback_violation_;
      if (!better) continue;
      std::swap(point_, trial_);
      return;
    }
    std::swap(point_, fallback_);
  }

  void write(const OcpInstance& instance, bool solved, Solution& solution) {
    Trajectory& trajectory = solution.trajectory;
    trajectory.x[0] = instance.x0;
    for (int k = 0; k < ocp_.horizon(); ++k) {
      for (int i = 0; i < n_; ++i) trajectory.u[k][i] = point_.at(2 * n_ + i, k);
      trajectory.x[k + 1] = ocp_.next(trajectory.x[k], trajectory.u[k]);
    }
    barrier_.write_multipliers(solution.multipliers);
    if (!solved) {
      barrier_.move(point_);
      barrier_.check_all_rows(tolerance_);
    }
    solution.violation = barrier_.violation();
    solution.objective = barrier_.objective();
    solution.kkt_error =
        std::max(solved ? barrier_.residuals().kkt() : barrier_.differentiate().kkt(), solution.violation);
    const bool feasible = solution.violation <= tolerance_;
    // A user's term may have derivatives but no value: without a finite objective nothing is optimal.
    const bool optimal = solved && solution.kkt_error <= tolerance_ && std::isfinite(solution.objective);
    solution.status = !feasible ? SolveStatus::kInfeasible : optimal ? SolveStatus::kSolved : SolveStatus::kFeasible;
  }

  static constexpr double kColdMu = 0.1;
  static constexpr double kWarmMu = 3e-3, kLeastWarmMu = 1e-5, kMostWarmMu = 1e-2;
  static constexpr double kCloseEnough = 100.0;    ///< residuals / mu at which mu is lowered
  static constexpr double kConverged = 0.1;        ///< residuals / mu at which the last minimiser is reached
  static constexpr double kSmallestPivot = 1e-10;  ///< in units of the curvature
  static constexpr double kLeastDamping = 1e-3, kMostDamping = 1e3;  ///< the same, of exact steps
  static constexpr int kPatience = 15;    ///< convex steps of a path before exact ones are damped
  static constexpr double kShort = 0.05;  ///< share of a Newton step that leads nowhere
  static constexpr int kJammed = 3;       ///< such steps, one after another

  /// What has happened on the way of minimise().
  struct Path {
    int convex_steps = 0, short_steps = 0;
    double damping = 0.0;  ///< that was enough last
  };

  const Ocp& ocp_;
  int n_;
  double tolerance_;
  ElasticBarrier barrier_;
  NewtonSystem newton_;
  Path path_;
  NodeTable start_, point_, trial_, step_;
  NodeTable fallback_;  ///< feasible, or the least infeasible start
  double fallback_violation_ = 0.0;
};

}  // namespace
}  // namespace realtime

std::unique_ptr<Solver> make_realtime_solver(const Ocp& ocp, double tolerance) {
  return std::make_unique<realtime::Realtime>(ocp, tolerance);
}

}  // namespace steadyhand

#include "steadyhand/planning/solve/fatrop/fatrop.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fatrop/fatrop.hpp>
#include <limits>
#include <numeric>

#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {
namespace {

using fatrop::Index;
using fatrop::Scalar;
using SteadyClock = std::chrono::steady_clock;

/// Thrown out of FATROP's loop when the time is up; it knows no budget in time.
struct OutOfTime {};
/// Thrown where a state has grown beyond all bounds, as that of a liquid in a glass on its head: FATROP would look for
/// a regularisation, or for a step, without end.
struct Diverged {};
constexpr double kMostCurvature = 1e12;  ///< in a node's Hessian; FATROP can still regularise it
constexpr int kMostTrials = 100;         ///< points that a line search may look at

/// The problem in FATROP's form: stages k = 0..N with z = (u_k, x_k), no variables x_0 (given), the terms' rows as
/// inequalities. The liquid's state follows x_k. A row with a price has an input e >= 0 by which it may violate its
/// bounds, at that price; these inputs follow u_k. FATROP's last stage may have no inputs, so such a problem has one
/// more stage, whose state is 0.
///
/// The acceleration of a given joint enters the dynamics as the constant of the guess. Its variable is without effect,
/// and costs half the square of its difference from the guess, where it begins. Rows of given joints are 0 inside of
/// their bounds.
///
/// For a constraint with many rows (pairs of bodies), only the `slots` rows nearest to their bounds are posed at each
/// node: FATROP's time per iteration grows with the rows, and few ever matter. The caller must check the others at the
/// solution.
class FatropOcp final : public fatrop::OcpAbstract {
 public:
  FatropOcp(const Ocp& ocp, int slots) : ocp_(ocp), n_(ocp.dof()), evaluation_(ocp), posed_(ocp.horizon() + 1) {
    for (int k = 0; k <= ocp.horizon(); ++k) {
      const auto& rows = evaluation_.rows(k);
      order_.resize(std::max(order_.size(), rows.size()));
      distance_.resize(order_.size());
      posed_[k].resize(std::min(count_few(k) + slots, static_cast<int>(rows.size())));
      std::iota(posed_[k].begin(), posed_[k].end(), 0);
      const auto soft = [&](ConstraintRow row) { return std::isfinite(price(row)); };
      softs_.push_back(static_cast<int>(std::count_if(rows.begin(), rows.end(), soft)));
    }
    guess_ = Trajectory(n_, ocp.horizon());
    guess_slosh_.resize((ocp.horizon() + 1) * ocp.tool_count());
  }

  /// Sets what is solved next and picks the posed rows by the guess.
  void begin(const OcpInstance& instance, const Trajectory& guess, SteadyClock::time_point deadline) {
    evaluation_.set_instance(instance);
    guess_.x = guess.x;
    guess_.u = guess.u;
    guess_.x[0] = instance.x0;
    deadline_ = deadline;
    trials_ = 0;
    evaluation_.set_trajectory(guess_);
    for (int k = 0; k <= ocp_.horizon(); ++k) {
      for (int t = 0; t < ocp_.tool_count(); ++t) guess_slosh_[k * ocp_.tool_count() + t] = evaluation_.slosh(k, t);
    }
    for (int k = 0; k <= ocp_.horizon(); ++k) pick_rows(k);
  }

  Evaluation& evaluation() { return evaluation_; }
  const std::vector<int>& posed(int k) const { return posed_[k]; }
  /// FATROP reads the bounds only once, when it is constructed. A row whose bounds the instance moves is therefore
  /// scaled to the nominal bounds by this factor; its multiplier is this factor times FATROP's.
  double stretch(int k, ConstraintRow row) const {
    const Bounds usual = nominal(row), now = evaluation_.bounds(k, row);
    const bool moved = now.lower != usual.lower || now.upper != usual.upper;
    return moved ? (usual.upper - usual.lower) / (now.upper - now.lower) : 1.0;
  }

  Index get_nx(const Index k) const override { return k == 0 ? 0 : is_extra(k) ? 1 : states(); }
  Index get_nu(const Index k) const override { return is_extra(k) ? 0 : accelerations(k) + softs_[k]; }
  Index get_ng(const Index /*k*/) const override { return 0; }
  /// The posed rows, then those of e >= 0.
  Index get_ng_ineq(const Index k) const override {
    return is_extra(k) ? 0 : static_cast<Index>(posed_[k].size()) + softs_[k];
  }
  Index get_horizon_length() const override { return ocp_.horizon() + (softs_.back() > 0 ? 2 : 1); }

  Index eval_BAbt(const Scalar* /*x_next*/, const Scalar* u, const Scalar* x, MAT* res, const Index k) override {
    const double dt = ocp_.dt();
    const int of_x = get_nu(k);
    blasfeo_dgese(res->m, res->n, 0.0, res, 0, 0);
    if (k == ocp_.horizon()) return 0;
    for (int i = 0; i < n_; ++i) {
      BLASFEO_DMATEL(res, i, i) = is_given(i) ? 0.0 : 0.5 * dt * dt;
      BLASFEO_DMATEL(res, i, n_ + i) = is_given(i) ? 0.0 : dt;
      if (k == 0) continue;
      BLASFEO_DMATEL(res, of_x + i, i) = 1.0;
      BLASFEO_DMATEL(res, of_x + n_ + i, i) = dt;
      BLASFEO_DMATEL(res, of_x + n_ + i, n_ + i) = 1.0;
    }
    set(u, x, k);
    for (int t = 0; t < liquids(); ++t) {
      const SloshStep& step = evaluation_.slosh_step(k, t);
      const Eigen::MatrixXd by_motion = step.by_force * step.by_motion;
      const int begin = slosh_begin(n_, t), end = begin + kSloshStates;
      for (int i = 0; i < of_x + get_nx(k); ++i) {
        const int entry = z_index(i, k);
        if (entry < 0 || is_given_input(entry) || (entry >= 3 * n_ && (entry < begin || entry >= end))) continue;
        for (int j = 0; j < kSloshStates; ++j) {
          BLASFEO_DMATEL(res, i, begin - n_ + j) =
              entry < 3 * n_ ? by_motion(j, entry) : step.pull_back(SloshState::Unit(j))[entry - begin];
        }
      }
    }
    return 0;
  }

  Index eval_b(const Scalar* x_next, const Scalar* u, const Scalar* x, Scalar* res, const Index k) override {
    if (k == ocp_.horizon()) {
      res[0] = -x_next[0];
      return 0;
    }
    const StateVector next = ocp_.next(state(x, k), input(u, k));
    for (int i = 0; i < 2 * n_; ++i) res[i] = next[i] - x_next[i];
    set(u, x, k);
    for (int t = 0; t < liquids(); ++t) {
      const SloshState liquid = evaluation_.slosh_step(k, t).next(evaluation_.slosh(k, t));
      const int begin = slosh_begin(n_, t) - n_;
      for (int i = 0; i < kSloshStates; ++i) res[begin + i] = liquid[i] - x_next[begin + i];
    }
    return 0;
  }

  Index eval_RSQrqt(const Scalar* objective_scale, const Scalar* u, const Scalar* x, const Scalar* lam_dyn,
                    const Scalar* /*lam_eq*/, const Scalar* lam_ineq, MAT* res, const Index k) override {
    if (k == 0) {
      trials_ = 0;
      if (SteadyClock::now() > deadline_) throw OutOfTime();
    }
    if (is_extra(k)) {
      BLASFEO_DMATEL(res, 0, 0) = 1.0;
      return 0;
    }
    set(u, x, k);
    NodeHessian hessian = NodeHessian::Zero(ocp_.entries(), ocp_.entries());
    evaluation_.add_objective_hessian(k, *objective_scale, hessian);
    for (std::size_t i = 0; i < posed_[k].size(); ++i) {
      const double multiplier = stretch(k, row(k, i)) * lam_ineq[i];
      if (multiplier != 0.0 && !is_given(row(k, i)))
        evaluation_.add_constraint_hessian(k, row(k, i), multiplier, hessian);
    }
    for (int t = 0; k < ocp_.horizon() && t < liquids(); ++t) {
      (void)evaluation_.slosh_step(k, t);
      evaluation_.add_slosh_hessian(k, Eigen::Map<const SloshState>(lam_dyn + slosh_begin(n_, t) - n_), hessian, t);
    }
    for (int j = 0; k < ocp_.horizon() && j < n_; ++j) {
      if (!is_given(j)) continue;
      hessian.row(2 * n_ + j).setZero();
      hessian.col(2 * n_ + j).setZero();
      hessian(2 * n_ + j, 2 * n_ + j) = *objective_scale;
    }
    if (!(hessian.cwiseAbs().maxCoeff() < kMostCurvature)) throw Diverged();  // also what is no number
    const Index size = get_nu(k) + get_nx(k);
    for (int j = 0; j < size; ++j) {
      for (int i = 0; i < size; ++i) {
        const auto [row, column] = std::minmax({z_index(i, k), z_index(j, k)});
        BLASFEO_DMATEL(res, i, j) = row < 0 ? 0.0 : hessian(row, column);
      }
    }
    return 0;
  }

  Index eval_Ggt(const Scalar*, const Scalar*, MAT*, const Index) override { return 0; }
  Index eval_g(const Scalar*, const Scalar*, Scalar*, const Index) override { return 0; }

  Index eval_Ggt_ineq(const Scalar* u, const Scalar* x, MAT* res, const Index k) override {
    if (is_extra(k)) return 0;
    set(u, x, k);
    const Index size = get_nu(k) + get_nx(k);
    const int rows = static_cast<int>(posed_[k].size());
    int soft = 0;
    for (int j = 0; j < rows; ++j) {
      NodeGradient gradient = NodeGradient::Zero(ocp_.entries());
      if (!is_given(row(k, j))) evaluation_.add_constraint_gradient(k, row(k, j), stretch(k, row(k, j)), gradient);
      for (int i = 0; i < n_; ++i)
        if (is_given(i)) gradient[2 * n_ + i] = 0.0;
      for (int i = 0; i < size; ++i) BLASFEO_DMATEL(res, i, j) = z_index(i, k) < 0 ? 0.0 : gradient[z_index(i, k)];
      if (!std::isfinite(price(row(k, j)))) continue;
      const int entry = accelerations(k) + soft;
      BLASFEO_DMATEL(res, entry, j) = relief(row(k, j));
      for (int i = 0; i < size; ++i) BLASFEO_DMATEL(res, i, rows + soft) = i == entry ? 1.0 : 0.0;
      ++soft;
    }
    return 0;
  }

  Index eval_gineq(const Scalar* u, const Scalar* x, Scalar* res, const Index k) override {
    if (is_extra(k)) return 0;
    set(u, x, k);
    const int rows = static_cast<int>(posed_[k].size());
    int soft = 0;
    for (int i = 0; i < rows; ++i) {
      res[i] = is_given(row(k, i)) ? inside(nominal(row(k, i))) : stretched(k, row(k, i));
      if (!std::isfinite(price(row(k, i)))) continue;
      const double excess = u[accelerations(k) + soft];
      res[i] += relief(row(k, i)) * excess;
      res[rows + soft++] = excess;
    }
    return 0;
  }

  Index eval_rq(const Scalar* objective_scale, const Scalar* u, const Scalar* x, Scalar* res, const Index k) override {
    if (is_extra(k)) {
      res[0] = x[0];
      return 0;
    }
    set(u, x, k);
    NodeGradient gradient = NodeGradient::Zero(ocp_.entries());
    evaluation_.add_objective_gradient(k, *objective_scale, gradient);
    for (int i = 0; i < accelerations(k); ++i)
      if (is_given(i)) gradient[2 * n_ + i] = *objective_scale * (u[i] - guess_.u[k][i]);
    for (int i = 0; i < get_nu(k) + get_nx(k); ++i) res[i] = z_index(i, k) < 0 ? 0.0 : gradient[z_index(i, k)];
    for_each_soft(k, [&](int soft, double price) { res[accelerations(k) + soft] = *objective_scale * price; });
    return 0;
  }

  Index eval_L(const Scalar* objective_scale, const Scalar* u, const Scalar* x, Scalar* res, const Index k) override {
    if (k == 0 && SteadyClock::now() > deadline_) throw OutOfTime();
    if (k == 0 && ++trials_ > kMostTrials) throw Diverged();
    if (is_extra(k)) {
      *res = 0.5 * x[0] * x[0];
      return 0;
    }
    set(u, x, k);
    *res = *objective_scale * evaluation_.objective(k);
    for (int i = 0; i < accelerations(k); ++i)
      if (is_given(i)) *res += *objective_scale * 0.5 * (u[i] - guess_.u[k][i]) * (u[i] - guess_.u[k][i]);
    for_each_soft(k, [&](int soft, double price) { *res += *objective_scale * price * u[accelerations(k) + soft]; });
    return 0;
  }

  Index get_bounds(Scalar* lower, Scalar* upper, const Index k) const override {
    if (is_extra(k)) return 0;
    for (std::size_t i = 0; i < posed_[k].size(); ++i) {
      const Bounds bounds = nominal(row(k, i));
      lower[i] = bounds.lower;
      upper[i] = bounds.upper;
    }
    for (int i = 0; i < softs_[k]; ++i) {
      lower[posed_[k].size() + i] = 0.0;
      upper[posed_[k].size() + i] = std::numeric_limits<double>::infinity();
    }
    return 0;
  }

  Index get_initial_xk(Scalar* x, const Index k) const override {
    if (is_extra(k)) x[0] = 0.0;
    for (int i = 0; !is_extra(k) && i < get_nx(k); ++i)
      x[i] = i < 2 * n_ ? guess_.x[k][i]
                        : guess_slosh_[k * liquids() + (i - 2 * n_) / kSloshStates][(i - 2 * n_) % kSloshStates];
    return 0;
  }
  Index get_initial_uk(Scalar* u, const Index k) const override {
    for (int i = 0; i < get_nu(k); ++i) u[i] = i < accelerations(k) ? guess_.u[k][i] : 0.0;
    return 0;
  }

 private:
  /// Constraints with at most two rows per joint are always posed.
  /// As are those with a price.
  bool few(ConstraintRow row) const {
    return ocp_.constraints()[row.constraint]->rows() <= 2 * n_ || std::isfinite(price(row));
  }
  int count_few(int k) const {
    const auto& rows = evaluation_.rows(k);
    return static_cast<int>(std::count_if(rows.begin(), rows.end(), [&](ConstraintRow row) { return few(row); }));
  }

  void pick_rows(int k) {
    const auto& rows = evaluation_.rows(k);
    const int count = static_cast<int>(rows.size()), chosen = static_cast<int>(posed_[k].size());
    if (chosen == count) return;
    for (int i = 0; i < count; ++i) {
      const Bounds bounds = evaluation_.bounds(k, rows[i]);
      const double value = evaluation_.constraint(k, rows[i]);
      distance_[i] = few(rows[i]) ? -std::numeric_limits<double>::infinity()
                                  : std::min(value - bounds.lower, bounds.upper - value);
      order_[i] = i;
    }
    std::nth_element(order_.begin(), order_.begin() + chosen, order_.begin() + count, [&](int a, int b) {
      return distance_[a] < distance_[b] || (distance_[a] == distance_[b] && a < b);
    });
    std::copy_n(order_.begin(), chosen, posed_[k].begin());
    std::sort(posed_[k].begin(), posed_[k].end());
  }

  ConstraintRow row(int k, std::size_t slot) const { return evaluation_.rows(k)[posed_[k][slot]]; }
  bool is_extra(int k) const { return k > ocp_.horizon(); }
  int states() const { return 2 * n_ + ocp_.slosh_states(); }
  int accelerations(int k) const { return k == ocp_.horizon() ? 0 : n_; }
  double price(ConstraintRow row) const { return ocp_.constraints()[row.constraint]->price(row.row); }
  Bounds nominal(ConstraintRow row) const { return ocp_.constraints()[row.constraint]->bounds(row.row); }
  bool is_given(int joint) const { return evaluation_.instance().given[joint]; }
  bool is_given_input(int entry) const { return entry >= 2 * n_ && entry < 3 * n_ && is_given(entry - 2 * n_); }
  bool is_given(ConstraintRow row) const { return ocp_.is_given(evaluation_.instance(), row); }
  static double inside(const Bounds& bounds) {
    const double width = std::min(bounds.upper - bounds.lower, 2.0);
    return std::isfinite(bounds.lower) ? bounds.lower + 0.5 * width : bounds.upper - 0.5 * width;
  }
  /// A row's value, see stretch().
  double stretched(int k, ConstraintRow row) const {
    const double value = evaluation_.constraint(k, row), factor = stretch(k, row);
    return factor == 1.0 ? value : nominal(row).lower + factor * (value - evaluation_.bounds(k, row).lower);
  }
  /// What the excess of a row with a price adds to the row. @pre it has one finite bound
  double relief(ConstraintRow row) const { return std::isfinite(nominal(row).lower) ? 1.0 : -1.0; }
  template <typename F>
  void for_each_soft(int k, const F& f) const {
    int soft = 0;
    for (std::size_t i = 0; i < posed_[k].size(); ++i) {
      if (const double p = price(row(k, i)); std::isfinite(p)) f(soft++, p);
    }
  }
  int liquids() const { return ocp_.slosh_states() / kSloshStates; }
  /// Index in z = [q; dq; u; states of the liquids] of entry i of FATROP's (u, x); -1: an excess.
  int z_index(int i, int k) const {
    const int nu = get_nu(k);
    if (i < nu) return i < accelerations(k) ? 2 * n_ + i : -1;
    return i - nu < 2 * n_ ? i - nu : i - nu + n_;
  }
  StateVector state(const Scalar* x, int k) const {
    return k == 0 ? guess_.x[0] : StateVector(Eigen::Map<const Eigen::VectorXd>(x, 2 * n_));
  }
  JointVector input(const Scalar* u, int k) const {
    if (k == ocp_.horizon()) return JointVector::Zero(n_);
    JointVector result = Eigen::Map<const Eigen::VectorXd>(u, n_);
    for (int i = 0; i < n_; ++i)
      if (is_given(i)) result[i] = guess_.u[k][i];
    return result;
  }
  void set(const Scalar* u, const Scalar* x, int k) {
    evaluation_.set_node(k, state(x, k), input(u, k));
    for (int t = 0; t < liquids(); ++t) {
      evaluation_.set_slosh(k,
                            k == 0 ? evaluation_.instance().liquid[t].state
                                   : SloshState(Eigen::Map<const SloshState>(x + slosh_begin(n_, t) - n_)),
                            t);
    }
  }

  const Ocp& ocp_;
  int n_;
  Evaluation evaluation_;
  std::vector<std::vector<int>> posed_;  ///< by node: indices into Evaluation::rows(k)
  std::vector<int> softs_;               ///< by node: how many rows have a price
  Trajectory guess_;
  std::vector<SloshState> guess_slosh_;  ///< by node and tool
  SteadyClock::time_point deadline_;
  int trials_ = 0;  ///< since the derivatives were asked for
  std::vector<int> order_;
  std::vector<double> distance_;
};

/// FATROP's algorithm object for one FatropOcp.
struct FatropProgram {
  FatropProgram(const Ocp& ocp, int slots, double tolerance) : problem(std::make_shared<FatropOcp>(ocp, slots)) {
    fatrop::IpAlgBuilder<fatrop::OcpType> builder(std::make_shared<fatrop::NlpOcp>(problem));
    algorithm = builder.with_options_registry(&options).build();
    data = builder.get_ipdata();
    options.set_option("tolerance", tolerance);
    options.set_option("print_level", 0);
  }

  std::shared_ptr<FatropOcp> problem;
  fatrop::OptionRegistry options;
  std::shared_ptr<fatrop::IpAlgorithm<fatrop::OcpType>> algorithm;
  std::shared_ptr<fatrop::IpData<fatrop::OcpType>> data;
};

class FatropSolver final : public Solver {
 public:
  FatropSolver(const Ocp& ocp, double tolerance)
      : ocp_(ocp),
        tolerance_(tolerance),
        nearest_(ocp, kSlots, tolerance),
        all_(ocp, std::numeric_limits<int>::max() / 2, tolerance) {
    point_ = Trajectory(ocp.dof(), ocp.horizon());
  }

  std::string_view name() const override { return "fatrop"; }

  void solve(const OcpInstance& instance, const Trajectory& guess, const Multipliers* /*multipliers*/,
             const SolveBudget& budget, Solution& solution) override {
    const auto start = SteadyClock::now();
    solution.status = SolveStatus::kInvalid;
    solution.iterations = 0;
    const auto deadline = budget.time_us > 0.0 ? start + std::chrono::nanoseconds(std::llround(1e3 * budget.time_us))
                                               : SteadyClock::time_point::max();
    if (ocp_.check(instance) && valid(guess)) {
      point_.x = guess.x;
      point_.u = guess.u;
      // A solution of the few rows that keeps the others too is one of the whole problem; else the others are posed as
      // well.
      const int most = budget.iterations.value_or(usual_iterations(ocp_.horizon()));
      if (!run(nearest_, instance, deadline, most, solution)) {
        run(all_, instance, deadline, most, solution);
      }
    }
    solution.time_us = std::chrono::duration<double, std::micro>(SteadyClock::now() - start).count();
  }

 private:
  static constexpr int kSlots = 24;

  bool valid(const Trajectory& guess) const {
    const auto finite = [](const auto& vectors, int count, int size) {
      return std::ssize(vectors) == count && std::all_of(vectors.begin(), vectors.end(), [&](const auto& v) {
               return v.size() == size && v.allFinite();
             });
    };
    return finite(guess.x, ocp_.horizon() + 1, 2 * ocp_.dof()) && finite(guess.u, ocp_.horizon(), ocp_.dof());
  }

  /// Solves from point_, leaves the result in `solution` and point_. True if it is a KKT point of the whole problem.
  bool run(FatropProgram& program, const OcpInstance& instance, SteadyClock::time_point deadline, int iterations,
           Solution& solution) {
    FatropOcp& problem = *program.problem;
    problem.begin(instance, point_, deadline);
    program.options.set_option("max_iter", iterations - solution.iterations);
    fatrop::IpSolverReturnFlag flag = fatrop::IpSolverReturnFlag::Unknown;
    try {
      program.algorithm->reset();
      flag = program.algorithm->optimize();
    } catch (const OutOfTime&) {
    } catch (const Diverged&) {
    } catch (...) {  // FATROP's own: what it leaves behind is judged as any other point
    }
    solution.iterations += program.data->iteration_number();
    read(program, instance, solution);

    Evaluation& evaluation = problem.evaluation();
    evaluation.set_trajectory(solution.trajectory);
    solution.violation = evaluation.violation();
    solution.objective = 0.0;
    for (int k = 0; k <= ocp_.horizon(); ++k) solution.objective += evaluation.objective(k) + evaluation.price(k);
    solution.kkt_error = kkt_error(evaluation, solution.trajectory, solution.multipliers);
    const bool feasible = solution.violation <= tolerance_;
    const bool optimal = flag == fatrop::IpSolverReturnFlag::Success;
    solution.status = !feasible ? SolveStatus::kInfeasible : optimal ? SolveStatus::kSolved : SolveStatus::kFeasible;
    point_.x = solution.trajectory.x;
    point_.u = solution.trajectory.u;
    return solution.status == SolveStatus::kSolved;
  }

  /// Copies accelerations and multipliers; states follow from the dynamics exactly.
  void read(FatropProgram& program, const OcpInstance& instance, Solution& solution) {
    const auto& info = program.data->info();
    const auto& primal = program.data->current_iterate().primal_x();
    const auto& dual = program.data->current_iterate().dual_eq();
    Trajectory& trajectory = solution.trajectory;
    trajectory.x[0] = instance.x0;
    solution.multipliers.clear();
    for (int k = 0; k <= ocp_.horizon(); ++k) {
      const auto& posed = program.problem->posed(k);
      for (std::size_t i = 0; i < posed.size(); ++i) {
        const ConstraintRow row = program.problem->evaluation().rows(k)[posed[i]];
        const double multiplier = dual(info.offsets_g_eq_slack[k] + static_cast<Index>(i));
        solution.multipliers.set(k, row, program.problem->stretch(k, row) * multiplier);
      }
      if (k == ocp_.horizon()) break;
      for (int i = 0; i < ocp_.dof(); ++i)
        trajectory.u[k][i] = instance.given[i] ? point_.u[k][i] : primal(info.offsets_primal_u[k] + i);
      trajectory.x[k + 1] = ocp_.next(trajectory.x[k], trajectory.u[k]);
    }
  }

  const Ocp& ocp_;
  double tolerance_;
  FatropProgram nearest_, all_;
  Trajectory point_;
};

}  // namespace

std::unique_ptr<Solver> make_fatrop_solver(const Ocp& ocp, double tolerance) {
  return std::make_unique<FatropSolver>(ocp, tolerance);
}

}  // namespace steadyhand

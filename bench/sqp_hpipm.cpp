#include "sqp_hpipm.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

extern "C" {
#include <hpipm_d_ocp_qp_dim.h>
#include <hpipm_d_ocp_qp_ipm.h>
#include <hpipm_d_ocp_qp_sol.h>
}

#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand::bench {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kLeast = 1e-3;     ///< share of a step
constexpr double kRounding = 1e-9;  ///< by which a merit may grow, relative

/// What HPIPM lays out in memory of its caller, made for the most rows and laid out anew for each number of them.
class QpMemory {
 public:
  explicit QpMemory(int horizon) : dim_memory_(d_ocp_qp_dim_memsize(horizon)) {
    d_ocp_qp_dim_create(horizon, &dim, dim_memory_.data());
  }
  void take() {
    qp_memory_.resize(d_ocp_qp_memsize(&dim));
    solution_memory_.resize(d_ocp_qp_sol_memsize(&dim));
    argument_memory_.resize(d_ocp_qp_ipm_arg_memsize(&dim));
    lay_out_arguments();
    work_memory_.resize(d_ocp_qp_ipm_ws_memsize(&dim, &arguments));
  }
  void lay_out() {
    d_ocp_qp_create(&dim, &qp, qp_memory_.data());
    d_ocp_qp_sol_create(&dim, &solution, solution_memory_.data());
    lay_out_arguments();
    d_ocp_qp_ipm_ws_create(&dim, &arguments, &work, work_memory_.data());
  }

  double tolerance = 1e-6;
  d_ocp_qp_dim dim{};
  d_ocp_qp qp{};
  d_ocp_qp_sol solution{};
  d_ocp_qp_ipm_arg arguments{};
  d_ocp_qp_ipm_ws work{};

 private:
  void lay_out_arguments() {
    d_ocp_qp_ipm_arg_create(&dim, &arguments, argument_memory_.data());
    d_ocp_qp_ipm_arg_set_default(SPEED, &arguments);
    int most = 100;
    d_ocp_qp_ipm_arg_set_iter_max(&most, &arguments);
    d_ocp_qp_ipm_arg_set_tol_stat(&tolerance, &arguments);
    d_ocp_qp_ipm_arg_set_tol_eq(&tolerance, &arguments);
    d_ocp_qp_ipm_arg_set_tol_ineq(&tolerance, &arguments);
    d_ocp_qp_ipm_arg_set_tol_comp(&tolerance, &arguments);
  }

  std::vector<char> dim_memory_, qp_memory_, solution_memory_, argument_memory_, work_memory_;
};

/// Rows of one node in its QP: of single entries of x or u, and of anything.
struct NodeRows {
  std::vector<ConstraintRow> of_x, of_u, general, all_general;
  std::vector<int> x_entries, u_entries;
};

class SqpHpipm final : public Solver {
 public:
  SqpHpipm(const Ocp& ocp, double tolerance)
      : ocp_(ocp),
        tolerance_(tolerance),
        n_(ocp.dof()),
        evaluation_(ocp),
        rows_(ocp.horizon() + 1),
        memory_(ocp.horizon()),
        before_(ocp.dof(), ocp.horizon()) {
    for (int k = 0; k <= ocp.horizon(); ++k) sort_rows(k);
    memory_.tolerance = 0.1 * tolerance;
    for (int k = 0; k <= ocp.horizon(); ++k) set_sizes(k, static_cast<int>(rows_[k].all_general.size()));
    memory_.take();
    next_.prepare(ocp);
    x_step_.resize(ocp.horizon() + 1);
    u_step_.resize(ocp.horizon());
  }

  std::string_view name() const override { return "sqp-hpipm"; }

  void solve(const OcpInstance& instance, const Trajectory& guess, const Multipliers*, const SolveBudget& budget,
             Solution& solution) override {
    const Clock::time_point start = Clock::now();
    evaluation_.set_instance(instance);
    Trajectory& at = solution.trajectory;
    at.u = guess.u;
    roll_out(instance, at);
    evaluation_.set_trajectory(at);
    solution.multipliers.prepare(ocp_);
    for (NodeRows& rows : rows_) rows.general.clear();
    add_rows(false);
    const int most = budget.iterations.value_or(usual_iterations(ocp_.horizon()));
    double penalty = 0.0;
    int iteration = 0;
    for (;; ++iteration) {
      if (converged(solution) && !add_rows(true)) break;
      if (iteration == most) break;
      const auto step = [&](bool exact) {
        return solve_qp(solution.multipliers, exact) && take_step(instance, solution, penalty);
      };
      if (!step(true) && !step(false)) break;
    }
    solution.iterations = iteration;
    solution.time_us = std::chrono::duration<double, std::micro>(Clock::now() - start).count();
    solution.objective = objective();
    solution.violation = evaluation_.violation();
    solution.kkt_error = kkt_error(evaluation_, at, solution.multipliers);
    solution.status = solution.kkt_error <= tolerance_   ? SolveStatus::kSolved
                      : solution.violation <= tolerance_ ? SolveStatus::kFeasible
                                                         : SolveStatus::kInfeasible;
  }

 private:
  void sort_rows(int k) {
    NodeRows& rows = rows_[k];
    const auto first_of = [](std::vector<int>& entries, int entry) {
      if (std::find(entries.begin(), entries.end(), entry) != entries.end()) return false;
      entries.push_back(entry);
      return true;
    };
    for (const ConstraintRow row : evaluation_.rows(k)) {
      const int entry = ocp_.constraints()[row.constraint]->entry(row.row);
      if (entry >= 2 * n_ && first_of(rows.u_entries, entry - 2 * n_)) {
        rows.of_u.push_back(row);
      } else if (entry >= 0 && entry < 2 * n_ && first_of(rows.x_entries, entry)) {
        rows.of_x.push_back(row);
      } else {
        rows.all_general.push_back(row);
      }
    }
  }

  void set_sizes(int k, int general) {
    d_ocp_qp_dim* dim = &memory_.dim;
    d_ocp_qp_dim_set_nx(k, k == 0 ? 0 : 2 * n_, dim);  // x_0 is given
    d_ocp_qp_dim_set_nu(k, k < ocp_.horizon() ? n_ : 0, dim);
    d_ocp_qp_dim_set_nbx(k, static_cast<int>(rows_[k].of_x.size()), dim);
    d_ocp_qp_dim_set_nbu(k, static_cast<int>(rows_[k].of_u.size()), dim);
    d_ocp_qp_dim_set_ng(k, general, dim);
  }

  void roll_out(const OcpInstance& instance, Trajectory& at) const {
    at.x[0] = instance.x0;
    for (int k = 0; k < ocp_.horizon(); ++k) at.x[k + 1] = ocp_.next(at.x[k], at.u[k]);
  }

  double objective() const {
    double sum = 0.0;
    for (int k = 0; k <= ocp_.horizon(); ++k) sum += evaluation_.objective(k);
    return sum;
  }

  /// How far the row is inside its bounds.
  double room(int k, ConstraintRow row) const {
    const double value = evaluation_.constraint(k, row);
    const Bounds bounds = evaluation_.bounds(k, row);
    return std::min(value - bounds.lower, bounds.upper - value);
  }

  /// Takes up general rows that are within their margins, or only those that are violated. Whether there were any.
  bool add_rows(bool violated) {
    bool added = false;
    for (int k = 0; k <= ocp_.horizon(); ++k) {
      std::vector<ConstraintRow>& general = rows_[k].general;
      for (const ConstraintRow row : rows_[k].all_general) {
        const double margin = ocp_.constraints()[row.constraint]->activation_margin(row.row);
        if (room(k, row) > (violated ? -tolerance_ : margin)) continue;
        const auto same = [&](ConstraintRow r) { return r.constraint == row.constraint && r.row == row.row; };
        if (std::any_of(general.begin(), general.end(), same)) continue;
        general.push_back(row);
        added = true;
      }
    }
    return added;
  }

  template <typename Do>
  void for_each_row(const Do& act) const {
    for (int k = 0; k <= ocp_.horizon(); ++k) {
      for (const auto* list : {&rows_[k].of_x, &rows_[k].of_u, &rows_[k].general}) {
        for (const ConstraintRow row : *list) act(k, row);
      }
    }
  }

  /// The conditions of kkt_error() over the rows that are taken up.
  bool converged(const Solution& solution) const {
    bool good = true;
    for_each_row([&](int k, ConstraintRow row) {
      const double value = evaluation_.constraint(k, row), multiplier = solution.multipliers.at(k, row);
      const Bounds bounds = evaluation_.bounds(k, row);
      const double slack = multiplier < 0.0 ? value - bounds.lower : bounds.upper - value;
      good = good && std::min(value - bounds.lower, bounds.upper - value) >= -tolerance_ &&
             (multiplier == 0.0 || std::abs(multiplier * slack) <= tolerance_);
    });
    if (!good) return false;
    StateVector costate = StateVector::Zero(2 * n_);
    for (int k = ocp_.horizon(); k >= 0; --k) {
      NodeGradient gradient = NodeGradient::Zero(3 * n_);
      evaluation_.add_objective_gradient(k, 1.0, gradient);
      for (const auto* list : {&rows_[k].of_x, &rows_[k].of_u, &rows_[k].general}) {
        for (const ConstraintRow row : *list) {
          const double multiplier = solution.multipliers.at(k, row);
          if (multiplier != 0.0) evaluation_.add_constraint_gradient(k, row, multiplier, gradient);
        }
      }
      StateVector before = gradient.head(2 * n_);
      if (k < ocp_.horizon()) {
        const double dt = ocp_.dt();
        const JointVector by_u = gradient.tail(n_) + 0.5 * dt * dt * costate.head(n_) + dt * costate.tail(n_);
        if (by_u.cwiseAbs().maxCoeff() > tolerance_) return false;
        before += costate;
        before.tail(n_) += dt * costate.head(n_);
      }
      costate = before;
    }
    return true;
  }

  void pose_bounds(int k, const std::vector<ConstraintRow>& rows, void (*lower)(int, double*, d_ocp_qp*),
                   void (*lower_mask)(int, double*, d_ocp_qp*), void (*upper)(int, double*, d_ocp_qp*),
                   void (*upper_mask)(int, double*, d_ocp_qp*)) {
    for (auto* list : {&lower_, &lower_mask_, &upper_, &upper_mask_}) list->assign(rows.size(), 0.0);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double value = evaluation_.constraint(k, rows[i]);
      const Bounds bounds = evaluation_.bounds(k, rows[i]);
      lower_mask_[i] = std::isfinite(bounds.lower);
      upper_mask_[i] = std::isfinite(bounds.upper);
      lower_[i] = lower_mask_[i] > 0.0 ? bounds.lower - value : 0.0;
      upper_[i] = upper_mask_[i] > 0.0 ? bounds.upper - value : 0.0;
    }
    lower(k, lower_.data(), &memory_.qp);
    lower_mask(k, lower_mask_.data(), &memory_.qp);
    upper(k, upper_.data(), &memory_.qp);
    upper_mask(k, upper_mask_.data(), &memory_.qp);
  }

  void pose_node(int k, const Multipliers& multipliers, bool exact) {
    const int n = n_;
    d_ocp_qp* qp = &memory_.qp;
    NodeRows& rows = rows_[k];
    NodeGradient gradient = NodeGradient::Zero(3 * n);
    NodeHessian hessian = NodeHessian::Zero(3 * n, 3 * n);
    evaluation_.add_objective_gradient(k, 1.0, gradient);
    if (exact) {
      evaluation_.add_objective_hessian(k, 1.0, hessian);
      for (const ConstraintRow row : rows.general) {
        if (const double m = multipliers.at(k, row); m != 0.0) evaluation_.add_constraint_hessian(k, row, m, hessian);
      }
    } else {
      evaluation_.add_objective_convex_hessian(k, 1.0, hessian);
    }
    hessian.triangularView<Eigen::StrictlyLower>() = hessian.transpose();  // terms fill the upper one
    const auto general = static_cast<int>(rows.general.size());
    Eigen::MatrixXd C(general, 2 * n), D(general, n);
    for (int i = 0; i < general; ++i) {
      NodeGradient row = NodeGradient::Zero(3 * n);
      evaluation_.add_constraint_gradient(k, rows.general[i], 1.0, row);
      C.row(i) = row.head(2 * n).transpose();
      D.row(i) = row.tail(n).transpose();
    }
    if (k > 0) {
      Eigen::MatrixXd Q = hessian.topLeftCorner(2 * n, 2 * n);
      Eigen::VectorXd q = gradient.head(2 * n);
      d_ocp_qp_set_Q(k, Q.data(), qp);
      d_ocp_qp_set_q(k, q.data(), qp);
      d_ocp_qp_set_idxbx(k, rows.x_entries.data(), qp);
      pose_bounds(k, rows.of_x, d_ocp_qp_set_lbx, d_ocp_qp_set_lbx_mask, d_ocp_qp_set_ubx, d_ocp_qp_set_ubx_mask);
      d_ocp_qp_set_C(k, C.data(), qp);
    }
    if (k < ocp_.horizon()) {
      const double dt = ocp_.dt();
      Eigen::MatrixXd R = hessian.bottomRightCorner(n, n), B(2 * n, n);
      Eigen::VectorXd r = gradient.tail(n), b = Eigen::VectorXd::Zero(2 * n);
      B << 0.5 * dt * dt * Eigen::MatrixXd::Identity(n, n), dt * Eigen::MatrixXd::Identity(n, n);
      if (k > 0) {
        Eigen::MatrixXd S = hessian.bottomLeftCorner(n, 2 * n), A = Eigen::MatrixXd::Identity(2 * n, 2 * n);
        A.topRightCorner(n, n).diagonal().setConstant(dt);
        d_ocp_qp_set_S(k, S.data(), qp);
        d_ocp_qp_set_A(k, A.data(), qp);
      }
      d_ocp_qp_set_B(k, B.data(), qp);
      d_ocp_qp_set_b(k, b.data(), qp);
      d_ocp_qp_set_R(k, R.data(), qp);
      d_ocp_qp_set_r(k, r.data(), qp);
      d_ocp_qp_set_idxbu(k, rows.u_entries.data(), qp);
      pose_bounds(k, rows.of_u, d_ocp_qp_set_lbu, d_ocp_qp_set_lbu_mask, d_ocp_qp_set_ubu, d_ocp_qp_set_ubu_mask);
      d_ocp_qp_set_D(k, D.data(), qp);
    }
    pose_bounds(k, rows.general, d_ocp_qp_set_lg, d_ocp_qp_set_lg_mask, d_ocp_qp_set_ug, d_ocp_qp_set_ug_mask);
  }

  void read_multipliers(int k, const std::vector<ConstraintRow>& rows, void (*lower)(int, d_ocp_qp_sol*, double*),
                        void (*upper)(int, d_ocp_qp_sol*, double*)) {
    lower_.assign(rows.size() + 1, 0.0);
    upper_.assign(rows.size() + 1, 0.0);
    lower(k, &memory_.solution, lower_.data());
    upper(k, &memory_.solution, upper_.data());
    for (std::size_t i = 0; i < rows.size(); ++i) next_.set(k, rows[i], upper_[i] - lower_[i]);
  }

  /// The step from where the evaluation stands, and its multipliers; false if HPIPM found none.
  bool solve_qp(const Multipliers& multipliers, bool exact) {
    for (int k = 0; k <= ocp_.horizon(); ++k) set_sizes(k, static_cast<int>(rows_[k].general.size()));
    memory_.lay_out();
    for (int k = 0; k <= ocp_.horizon(); ++k) pose_node(k, multipliers, exact);
    d_ocp_qp_ipm_solve(&memory_.qp, &memory_.solution, &memory_.arguments, &memory_.work);
    int status = 0;
    d_ocp_qp_ipm_get_status(&memory_.work, &status);
    if (status != SUCCESS && status != MAX_ITER && status != MIN_STEP) return false;
    next_.prepare(ocp_);
    for (int k = 0; k <= ocp_.horizon(); ++k) {
      x_step_[k] = StateVector::Zero(2 * n_);
      if (k > 0) d_ocp_qp_sol_get_x(k, &memory_.solution, x_step_[k].data());
      if (k < ocp_.horizon()) {
        u_step_[k] = JointVector::Zero(n_);
        d_ocp_qp_sol_get_u(k, &memory_.solution, u_step_[k].data());
        if (!u_step_[k].allFinite()) return false;
        read_multipliers(k, rows_[k].of_u, d_ocp_qp_sol_get_lam_lbu, d_ocp_qp_sol_get_lam_ubu);
      }
      if (k > 0) read_multipliers(k, rows_[k].of_x, d_ocp_qp_sol_get_lam_lbx, d_ocp_qp_sol_get_lam_ubx);
      read_multipliers(k, rows_[k].general, d_ocp_qp_sol_get_lam_lg, d_ocp_qp_sol_get_lam_ug);
    }
    return true;
  }

  double merit(double penalty) const {
    double excess = 0.0;
    for_each_row([&](int k, ConstraintRow row) { excess += std::max(0.0, -room(k, row)); });
    return objective() + penalty * excess;
  }

  /// False, and nothing changed, if no share of the step lowers the merit.
  bool take_step(const OcpInstance& instance, Solution& solution, double& penalty) {
    for_each_row([&](int k, ConstraintRow row) { penalty = std::max(penalty, 1.1 * std::abs(next_.at(k, row))); });
    Trajectory& at = solution.trajectory;
    const double before = merit(penalty);
    before_.u = at.u;
    double share = 1.0;
    const auto go = [&] {
      for (int k = 0; k < ocp_.horizon(); ++k) at.u[k] = before_.u[k] + share * u_step_[k];
      roll_out(instance, at);
      evaluation_.set_trajectory(at);
    };
    for (go(); merit(penalty) > before + kRounding * std::abs(before); go()) {
      share = share > kLeast ? 0.5 * share : 0.0;
    }
    if (share == 0.0) return false;
    for_each_row([&](int k, ConstraintRow row) {
      const double old = solution.multipliers.at(k, row);
      solution.multipliers.set(k, row, old + share * (next_.at(k, row) - old));
    });
    return true;
  }

  const Ocp& ocp_;
  double tolerance_;
  int n_;
  Evaluation evaluation_;
  std::vector<NodeRows> rows_;
  QpMemory memory_;
  Trajectory before_;
  Multipliers next_;
  std::vector<StateVector> x_step_;
  std::vector<JointVector> u_step_;
  std::vector<double> lower_, lower_mask_, upper_, upper_mask_;
};

}  // namespace

std::unique_ptr<Solver> make_sqp_hpipm(const Ocp& ocp, double tolerance) {
  return std::make_unique<SqpHpipm>(ocp, tolerance);
}

}  // namespace steadyhand::bench

#pragma once

#include <array>
#include <vector>

#include "steadyhand/planning/ocp/slosh.hpp"
#include "steadyhand/planning/solve/realtime/node_table.hpp"

namespace steadyhand::realtime {

/// Joints of a problem, side by side, and the tools that only they move.
struct JointRange {
  int first = 0;       ///< joint
  int dof = 0;         ///< n: how many
  int first_tool = 0;  ///< index
  int tools = 0;       ///< how many
};

/// The Newton step of a sum of quadratic models under the double integrator (docs/explanation/solver.md, "Riccati"):
/// minimises
///   sum_k 1/2 dw_k' H_k dw_k + g_k' dw_k   over du,   with   dq+ = dq + dt dv + dt^2/2 du,  dv+ = dv + dt du,  dx_0 =
///   0.
/// Node k's model is by w = [u; q; dq], row-major, rows of width(): the Hessian in the first columns, then the
/// gradient. In a problem with liquids their states s follow dq, with ds+ = S_k ds + F_k G_k [dq; dv; du] for each
/// (SloshStep). Only the diagonal and the entries right of it are read. The kernels are compiled for each n of an
/// arm; one kernel does any number of joints and liquids. The constructor allocates all memory.
class Riccati {
 public:
  /// Steps of each tool's liquid by interval; null where its state is not part of the models.
  using Steps = std::array<const SloshStep*, kMaxTools>;

  /// @param joints those of the models, of a problem with `all` of them
  /// @param liquid whether the models may have states of liquids
  Riccati(JointRange joints, int all, bool liquid, int horizon, double dt);

  const JointRange& joints() const { return joints_; }
  /// Row i of node k's model, to be filled before factorise(), which overwrites it. At k = N the rows of u are not
  /// read.
  double* row(int k, int i) { return numbers_.data() + (static_cast<std::size_t>(k) * size() + i) * width_; }
  int width() const { return width_; }
  /// Rows of a model.
  int size() const { return static_cast<int>(entries_.size()); }
  /// Entries of z = [q; dq; u; states of the liquids] of the problem, in the order of w.
  const std::vector<int>& entries() const { return entries_; }
  /// Room for rows of a model that are never read.
  double* padding() { return row(horizon_ + 1, 0); }
  /// Column of the gradient.
  int gradient() const { return size(); }
  /// Sets the liquids' steps over each interval, of all tools or of none; factorise() and solve() read them when they
  /// are called. Default: none.
  void use_slosh(const Steps& steps);

  /// Eliminates du_{N-1} .. du_0. False if a pivot is not above `smallest_pivot`: the Hessian on the space of the
  /// accelerations is not positive definite, and there is no step.
  bool factorise(double smallest_pivot);
  /// Forward sweep after factorise(): sets the joints' part of step, [q; dq; u; states of the liquids] x nodes.
  void solve(NodeTable& step) const;

 private:
  bool factorise_any(double smallest_pivot);
  void solve_any(NodeTable& step) const;
  void pull_back_any(int k);

  JointRange joints_;
  int all_, horizon_, width_;
  double dt_;
  Steps steps_{};
  std::vector<int> entries_;
  std::vector<double> numbers_;
  // Of the kernel for any number of joints:
  bool any_size_;
  std::vector<double> cost_, moved_, by_force_;
};

}  // namespace steadyhand::realtime

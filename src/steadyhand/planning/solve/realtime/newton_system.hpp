#pragma once

#include <vector>

#include "steadyhand/planning/ocp/slosh.hpp"
#include "steadyhand/planning/solve/realtime/node_table.hpp"

namespace steadyhand::realtime {

/// The Newton step of a sum of quadratic models under the double integrator (docs/explanation/solver.md, "Riccati"):
/// minimises
///   sum_k 1/2 dw_k' H_k dw_k + g_k' dw_k   over du,   with   dq+ = dq + dt dv + dt^2/2 du,  dv+ = dv + dt du,  dx_0 =
///   0.
/// Node k's model is by w = [u; q; dq], row-major, rows of width(): the Hessian in the first columns, then the
/// gradient. In a problem with a liquid its state s follows dq, with ds+ = S_k ds + F_k G_k [dq; dv; du]
/// (SloshStep). Only the diagonal and the entries right of it are read. The kernels are compiled for each n. The
/// constructor allocates all memory.
class NewtonSystem {
 public:
  /// @param slosh_states 0 or kSloshStates, at most
  NewtonSystem(int dof, int slosh_states, int horizon, double dt);

  /// Row i of node k's model, to be filled before factorise(), which overwrites it. At k = N the rows of u are not
  /// read.
  double* row(int k, int i) { return numbers_.data() + (static_cast<std::size_t>(k) * size_ + i) * width_; }
  int width() const { return width_; }
  /// Room for rows of a model that are never read.
  double* padding() { return row(horizon_ + 1, 0); }
  /// Column of the gradient.
  int gradient() const { return size_; }
  /// Sets the liquid's step over each interval; factorise() and solve() read `steps` when they are called. Null (the
  /// default): the liquid's state is not part of the models.
  void use_slosh(const SloshStep* steps);

  /// Eliminates du_{N-1} .. du_0. False if a pivot is not above `smallest_pivot`: the Hessian on the space of the
  /// accelerations is not positive definite, and there is no step.
  bool factorise(double smallest_pivot);
  /// Forward sweep after factorise(). step: [q; dq; u] x nodes.
  void solve(NodeTable& step) const;

 private:
  int dof_, size_, horizon_, width_;
  double dt_;
  std::vector<double> numbers_;
  const SloshStep* slosh_steps_ = nullptr;
};

}  // namespace steadyhand::realtime

#include "steadyhand/solve/realtime/newton_system.hpp"

#include <array>

#include "steadyhand/core/lanes.hpp"
#include "steadyhand/core/math.hpp"

namespace steadyhand::realtime {
namespace {

constexpr int padded_width(int dof) { return (3 * dof + 1 + kLanes - 1) / kLanes * kLanes; }

/// The recursion for n joints. The cost to go of node k + 1, pulled back through the dynamics, adds to the model of
/// node k; eliminating du_k from the sum by symmetric Gaussian elimination leaves the cost to go of node k in the rows
/// of [q; dq]. Everything happens in place, rows in steps of Lanes from the one that holds the diagonal on.
template <int n>
struct Kernels {
  static constexpr int kSize = 3 * n, kGradient = 3 * n, kWidth = padded_width(n);
  using Row = double[kWidth];
  using Model = Row[kSize];

  static constexpr int block_of(int column) { return column / kLanes * kLanes; }

  /// to += factor * from, from the block of column `first` on.
  static void add(double* to, double factor, const double* from, int first) {
    for (int j = block_of(first); j < kWidth; j += kLanes) {
      (Lanes::load(to + j) + factor * Lanes::load(from + j)).store(to + j);
    }
  }

  /// The rows of P, the Hessian by [q; dq], and the gradient: by columns q_0.., dq_0.., gradient; both triangles.
  static void cost_to_go(const Model& next, double (&P)[2 * n][2 * n + 1]) {
    for (int i = 0; i < 2 * n; ++i) {
      for (int j = i; j < 2 * n; ++j) P[i][j] = P[j][i] = next[n + i][n + j];
      P[i][2 * n] = next[n + i][kGradient];
    }
  }

  /// model += [B A]' P [B A], and the gradient likewise. P stands in the rows and columns of [q; dq] of `next`.
  static void pull_back(const Model& next, double dt, Model& model) {
    const double h = 0.5 * dt * dt;
    double P[2 * n][2 * n + 1];
    cost_to_go(next, P);
    for (int i = 0; i < n; ++i) {
      alignas(64) double of_q[kWidth] = {}, of_v[kWidth] = {};  // rows of P [B A] for q+_i and dq+_i, by [u; q; dq]
      for (int j = 0; j < n; ++j) {
        of_q[j] = h * P[i][j] + dt * P[i][n + j];
        of_v[j] = h * P[n + i][j] + dt * P[n + i][n + j];
      }
      for (int j = 0; j < n; ++j) {
        of_q[n + j] = P[i][j];
        of_v[n + j] = P[n + i][j];
      }
      for (int j = 0; j < n; ++j) {
        of_q[2 * n + j] = dt * P[i][j] + P[i][n + j];
        of_v[2 * n + j] = dt * P[n + i][j] + P[n + i][n + j];
      }
      of_q[kGradient] = P[i][2 * n];
      of_v[kGradient] = P[n + i][2 * n];
      add(model[i], h, of_q, i);
      add(model[i], dt, of_v, i);
      add(model[n + i], 1.0, of_q, n + i);
      add(model[2 * n + i], dt, of_q, 2 * n + i);
      add(model[2 * n + i], 1.0, of_v, 2 * n + i);
    }
  }

  /// Gaussian elimination of u: its rows keep what the forward sweep needs.
  static bool eliminate(Model& model, double smallest_pivot, bool state_too) {
    std::array<double, n> inverse;
    for (int p = 0; p < n; ++p) {
      if (!(model[p][p] > smallest_pivot)) return false;
      inverse[p] = 1.0 / model[p][p];
      for (int i = p + 1; i < n; ++i) add(model[i], -model[p][i] * inverse[p], model[p], i);
    }
    if (!state_too) return true;
    for (int i = n; i < kSize; ++i) {
      std::array<double, n> factor;
      for (int p = 0; p < n; ++p) factor[p] = model[p][i] * inverse[p];
      for (int j = block_of(i); j < kWidth; j += kLanes) {
        Lanes sum = Lanes::load(model[i] + j);
        for (int p = 0; p < n; ++p) sum -= factor[p] * Lanes::load(model[p] + j);
        sum.store(model[i] + j);
      }
    }
    return true;
  }

  static bool factorise(double* numbers, int horizon, double dt, double smallest_pivot) {
    Model* models = reinterpret_cast<Model*>(numbers);
    for (int k = horizon - 1; k >= 0; --k) {
      pull_back(models[k + 1], dt, models[k]);
      if (!eliminate(models[k], smallest_pivot, k > 0)) return false;
    }
    return true;
  }

  static void solve(const double* numbers, int horizon, double dt, NodeTable& step) {
    const Model* models = reinterpret_cast<const Model*>(numbers);
    std::array<double, 2 * n> x{};
    for (int k = 0;; ++k) {
      for (int i = 0; i < 2 * n; ++i) step.set(i, k, x[i]);
      if (k == horizon) return;
      std::array<double, n> u;
      for (int i = n - 1; i >= 0; --i) {
        const double* row = models[k][i];
        double sum = row[kGradient];
        for (int j = 0; j < 2 * n; ++j) sum += row[n + j] * x[j];
        for (int j = i + 1; j < n; ++j) sum += row[j] * u[j];
        u[i] = -sum / row[i];
      }
      for (int i = 0; i < n; ++i) {
        step.set(2 * n + i, k, u[i]);
        x[i] += dt * x[n + i] + 0.5 * dt * dt * u[i];
        x[n + i] += dt * u[i];
      }
    }
  }
};

/// Calls f with the Kernels of this number of joints.
template <int n = 1, typename F>
auto with_kernels(int dof, const F& f) {
  if constexpr (n < kMaxJoints) {
    if (dof != n) return with_kernels<n + 1>(dof, f);
  }
  return f(Kernels<n>());
}

}  // namespace

NewtonSystem::NewtonSystem(int dof, int horizon, double dt)
    : dof_(dof),
      horizon_(horizon),
      width_(padded_width(dof)),
      dt_(dt),
      numbers_(static_cast<std::size_t>(horizon + 1) * 3 * dof * width_, 0.0) {}

bool NewtonSystem::factorise(double smallest_pivot) {
  return with_kernels(dof_, [&](auto k) { return k.factorise(numbers_.data(), horizon_, dt_, smallest_pivot); });
}

void NewtonSystem::solve(NodeTable& step) const {
  with_kernels(dof_, [&](auto k) { k.solve(numbers_.data(), horizon_, dt_, step); });
}

}  // namespace steadyhand::realtime

#include "solve/realtime/newton_system.hpp"

#include <array>

#include "core/math.hpp"

namespace steadyhand::realtime {
namespace {

constexpr int padded_width(int dof) { return (3 * dof + 1 + 3) / 4 * 4; }

/// The recursion for n joints. The cost to go of node k + 1, pulled back through the dynamics, adds to the model of
/// node k; eliminating du_k from the sum by symmetric Gaussian elimination leaves the cost to go of node k in the rows
/// of [q; dq]. Everything happens in place.
template <int n>
struct Kernels {
  static constexpr int kSize = 3 * n, kGradient = 3 * n, kWidth = padded_width(n);
  using Model = double[kSize][kWidth];

  static double symmetric(const Model& model, int i, int j) { return i <= j ? model[i][j] : model[j][i]; }

  /// model += [B A]' P [B A], and the gradient likewise. P stands in the rows and columns of [q; dq] of `next`.
  static void pull_back(const Model& next, double dt, Model& model) {
    const double h = 0.5 * dt * dt;
    for (int i = 0; i < n; ++i) {
      double of_q[kWidth], of_v[kWidth];  // rows of P [B A] for q+_i and dq+_i, by columns [u | q | dq | gradient]
      for (int j = 0; j < n; ++j) {
        const double qq = symmetric(next, n + i, n + j), qv = next[n + i][2 * n + j];
        const double vq = next[n + j][2 * n + i], vv = symmetric(next, 2 * n + i, 2 * n + j);
        of_q[j] = h * qq + dt * qv;
        of_q[n + j] = qq;
        of_q[2 * n + j] = dt * qq + qv;
        of_v[j] = h * vq + dt * vv;
        of_v[n + j] = vq;
        of_v[2 * n + j] = dt * vq + vv;
      }
      for (int j = kGradient; j < kWidth; ++j) {
        of_q[j] = next[n + i][j];
        of_v[j] = next[2 * n + i][j];
      }
      for (int j = 0; j < kWidth; ++j) {
        model[i][j] += h * of_q[j] + dt * of_v[j];
        model[n + i][j] += of_q[j];
        model[2 * n + i][j] += dt * of_q[j] + of_v[j];
      }
    }
  }

  /// Gaussian elimination of u: its rows keep what the forward sweep needs.
  static bool eliminate(Model& model, double smallest_pivot, bool state_too) {
    std::array<double, n> inverse;
    for (int p = 0; p < n; ++p) {
      if (!(model[p][p] > smallest_pivot)) return false;
      inverse[p] = 1.0 / model[p][p];
      for (int i = p + 1; i < n; ++i) {
        const double factor = model[p][i] * inverse[p];
        for (int j = 0; j < kWidth; ++j) model[i][j] -= factor * model[p][j];
      }
    }
    if (!state_too) return true;
    for (int i = n; i < kSize; ++i) {
      double sum[kWidth] = {};
      for (int p = 0; p < n; ++p) {
        const double factor = model[p][i] * inverse[p];
        for (int j = 0; j < kWidth; ++j) sum[j] += factor * model[p][j];
      }
      for (int j = 0; j < kWidth; ++j) model[i][j] -= sum[j];
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

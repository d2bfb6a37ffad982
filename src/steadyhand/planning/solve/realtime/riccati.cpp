#include "steadyhand/planning/solve/realtime/riccati.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "steadyhand/core/lanes.hpp"
#include "steadyhand/core/math.hpp"

namespace steadyhand::realtime {
namespace {

/// Lane i gets what was in lane i + 1, and the other way round, for each even i.
Lanes with_pairs_swapped(Lanes x) {
  return [&]<int... i>(std::integer_sequence<int, i...>) {
    return Lanes(Lanes::Vector{x[i ^ 1]...});
  }(std::make_integer_sequence<int, kLanes>());
}

constexpr int padded_width(int size) { return (size + 1 + kLanes - 1) / kLanes * kLanes; }

/// Steps of a liquid by interval, and where a recursion finds its joints in them.
struct Interval {
  const SloshStep* steps;
  int first, all;  ///< joint, of how many
  double dt;       ///< s

  /// df / d entry i of [q; dq; u] of n joints, along an axis
  double by_motion(int k, int axis, int part, int i) const { return steps[k].by_motion(axis, part * all + first + i); }
};

/// The step of a liquid's state over interval k, in place. x = [q; dq], u: of n joints.
inline void advance_slosh(const Interval& interval, int k, int n, const double* u, const double* x, double* state) {
  const SloshStep& step = interval.steps[k];
  double force[3];
  for (int m = 0; m < 3; ++m) {
    force[m] = 0.0;
    for (int i = 0; i < n; ++i) {
      force[m] += interval.by_motion(k, m, 0, i) * x[i] + interval.by_motion(k, m, 1, i) * x[n + i] +
                  interval.by_motion(k, m, 2, i) * u[i];
    }
  }
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const double* t = step.transition.mode(mode);
    for (int axis = 0; axis < 2; ++axis) {
      const int i = slosh_entry(mode, axis);
      const double deflection = state[i], rate = state[i + 1];
      state[i] = t[0] * deflection + t[1] * rate;
      state[i + 1] = t[3] * deflection + t[4] * rate;
    }
  }
  for (int axis = 0; axis < 3; ++axis) state[slosh_force_entry(axis)] = 0.0;
  for (int i = 0; i < kSloshStates; ++i) {
    for (int m = 0; m < 3; ++m) state[i] += step.by_force(i, m) * force[m];
  }
}

/// The recursion for n joints and a liquid of `s` numbers. The cost to go of node k + 1, pulled back through the
/// dynamics, adds to the model of node k; eliminating du_k from the sum by symmetric Gaussian elimination leaves the
/// cost to go of node k in the rows of [q; dq]. Everything happens in place, rows in steps of Lanes from the one that
/// holds the diagonal on.
template <int n, int s>
struct Kernels {
  static constexpr int kSize = 3 * n + s, kGradient = kSize, kWidth = padded_width(kSize);
  using Row = double[kWidth];
  using Model = Row[kSize];

  static constexpr int block_of(int column) { return column / kLanes * kLanes; }

  /// to += factor * from, from the block of column `first` on.
  static void add(double* to, double factor, const double* from, int first) {
    for (int j = block_of(first); j < kWidth; j += kLanes) {
      (Lanes::load(to + j) + factor * Lanes::load(from + j)).store(to + j);
    }
  }

  /// The same with two.
  static void add(double* to, double factor, const double* from, double factor2, const double* from2, int first) {
    for (int j = block_of(first); j < kWidth; j += kLanes) {
      (Lanes::load(to + j) + (factor * Lanes::load(from + j) + factor2 * Lanes::load(from2 + j))).store(to + j);
    }
  }

  /// The rows of P, the Hessian by [q; dq], and the gradient: by columns q_0.., dq_0.., gradient; both triangles.
  static void cost_to_go(const Model& next, double (&P)[2 * n][2 * n + 1]) {
    for (int i = 0; i < 2 * n; ++i) {
      for (int j = i; j < 2 * n; ++j) P[i][j] = P[j][i] = next[n + i][n + j];
      P[i][2 * n] = next[n + i][kGradient];
    }
  }

  /// model += [B A]' P [B A], and the gradient likewise. P is in the rows and columns of [q; dq] of `next`.
  static void pull_back(const Model& next, double dt, Model& model, bool state_too) {
    const double h = 0.5 * dt * dt;
    double P[2 * n][2 * n + 1];
    cost_to_go(next, P);
    alignas(64) double of_q[kWidth] = {}, of_v[kWidth] = {};  // rows of P [B A] for q+_i and dq+_i, by [u; q; dq]
    for (int i = 0; i < n; ++i) {
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
      add(model[i], h, of_q, dt, of_v, i);
      if (!state_too) continue;
      add(model[n + i], 1.0, of_q, n + i);
      add(model[2 * n + i], dt, of_q, 1.0, of_v, 2 * n + i);
    }
  }

  // Rows by the liquid's numbers, behind which the gradient stands as it does in a model's.
  static constexpr int kSlosh = s + 1, kArm = (2 * n + kLanes - 1) / kLanes * kLanes;
  static_assert(s == 0 || kSlosh % kLanes == 0);
  using SloshRow = double[kSlosh];

  /// S of one interval, which takes each pair of deflection and rate for itself; the gradient is let through.
  struct Turn {
    alignas(64) SloshRow same = {}, other = {};

    explicit Turn(const SloshStep& step) {
      same[s] = 1.0;
      for (int mode = 0; mode < kSloshModes; ++mode) {
        const double* t = step.transition.mode(mode);
        for (int axis = 0; axis < 2; ++axis) {
          const int i = slosh_entry(mode, axis);
          same[i] = t[0];
          other[i] = t[3];
          same[i + 1] = t[4];
          other[i + 1] = t[1];
        }
      }
    }
    /// Numbers j to j + kLanes - 1 of S' row.
    Lanes of(const double* row, int j) const {
      const Lanes x = Lanes::load(row + j);
      return Lanes::load(same + j) * x + Lanes::load(other + j) * with_pairs_swapped(x);
    }
  };

  /// What the cost to go says of the liquid's state. It is P by [q; dq; state].
  struct SloshCost {
    alignas(64) SloshRow P[s];             // by the liquid's state, both triangles, and the gradient
    alignas(64) SloshRow of_arm[2 * n];    // by the arm's and the liquid's; the gradient is pull_back()'s
    alignas(64) double of_state[s][kArm];  // the same, transposed, filled up with zeros

    explicit SloshCost(const Model& next) {
      for (int i = 0; i < s; ++i) {
        const double* row = next[3 * n + i] + 3 * n;
        for (int j = i; j < kSlosh; ++j) P[i][j] = row[j];
        for (int j = i + 1; j < s; ++j) P[j][i] = row[j];
        for (int j = 2 * n; j < kArm; ++j) of_state[i][j] = 0.0;
      }
      for (int i = 0; i < 2 * n; ++i) {
        const double* row = next[n + i] + 3 * n;
        for (int j = 0; j < s; ++j) of_state[j][i] = of_arm[i][j] = row[j];
        of_arm[i][s] = 0.0;
      }
    }
  };

  /// How the forces of an interval come into it, by rows of w = [u; q; dq].
  struct SloshForce {
    alignas(64) SloshRow by_force[3];                            // F' P by the liquid, with F' p behind
    alignas(64) double G[3][kWidth] = {}, half[3][kWidth] = {};  // half: what with G makes its share of the Hessian

    SloshForce(const SloshCost& cost, const Interval& interval, int k) {
      const SloshStep& step = interval.steps[k];
      const double dt = interval.dt;
      alignas(64) double arm_by_force[3][kArm];
      const auto force_times = [&](const auto& rows, auto& products) {
        for (int j = 0; j < std::ssize(products[0]); j += kLanes) {
          std::array<Lanes, 3> sums{0.0, 0.0, 0.0};
          for (int i = 0; i < s; ++i) {
            const Lanes x = Lanes::load(rows[i] + j);
            for (int m = 0; m < 3; ++m) sums[m] += step.by_force(i, m) * x;
          }
          for (int m = 0; m < 3; ++m) sums[m].store(products[m] + j);
        }
      };
      force_times(cost.P, by_force);
      force_times(cost.of_state, arm_by_force);
      const double h = 0.5 * dt * dt;
      for (int m = 0; m < 3; ++m) {
        for (int i = 0; i < n; ++i) {
          G[m][i] = interval.by_motion(k, m, 2, i);
          G[m][n + i] = interval.by_motion(k, m, 0, i);
          G[m][2 * n + i] = interval.by_motion(k, m, 1, i);
          half[m][i] = h * arm_by_force[m][i] + dt * arm_by_force[m][n + i];
          half[m][n + i] = arm_by_force[m][i];
          half[m][2 * n + i] = dt * arm_by_force[m][i] + arm_by_force[m][n + i];
        }
      }
      for (int m = 0; m < 3; ++m) {
        for (int b = 0; b < 3; ++b) {
          double Q = 0.0;
          for (int j = 0; j < s; ++j) Q += step.by_force(j, m) * by_force[b][j];
          for (int j = 0; j < 3 * n; j += kLanes) {
            (Lanes::load(half[m] + j) + 0.5 * Q * Lanes::load(G[b] + j)).store(half[m] + j);
          }
        }
      }
    }
  };

  /// The same for the liquid's state: what the cost to go says of it, pulled back through state+ = S state + F G w with
  /// G of rank 3.
  static void pull_back_slosh(const Model& next, const Interval& interval, int k, Model& model, bool state_too) {
    const SloshCost cost(next);
    const SloshForce force(cost, interval, k);
    const Turn turn(interval.steps[k]);
    const double dt = interval.dt, h = 0.5 * dt * dt;
    for (int i = 0; i < (state_too ? 3 * n : n); ++i) {
      for (int j = block_of(i); j < 3 * n; j += kLanes) {
        Lanes sum = Lanes::load(model[i] + j);
        for (int m = 0; m < 3; ++m) {
          sum += force.half[m][i] * Lanes::load(force.G[m] + j) + force.G[m][i] * Lanes::load(force.half[m] + j);
        }
        sum.store(model[i] + j);
      }
      // By the liquid: E S with E = [B A]' P + G' F' P.
      const double of_q = i < n ? h : i < 2 * n ? 1.0 : dt, of_v = i < n ? dt : i < 2 * n ? 0.0 : 1.0;
      const double *q = cost.of_arm[i % n], *v = cost.of_arm[n + i % n];
      alignas(64) SloshRow E;
      for (int j = 0; j < kSlosh; j += kLanes) {
        Lanes sum = of_q * Lanes::load(q + j) + of_v * Lanes::load(v + j);
        for (int m = 0; m < 3; ++m) sum += force.G[m][i] * Lanes::load(force.by_force[m] + j);
        sum.store(E + j);
      }
      double* row = model[i] + 3 * n;
      for (int j = 0; j < kSlosh; j += kLanes) (Lanes::load(row + j) + turn.of(E, j)).store(row + j);
    }
    if (!state_too) return;

    // S' P S and S' p. S takes nothing from the forces of the interval before.
    constexpr int kSwinging = 4 * kSloshModes;
    alignas(64) SloshRow turned[kSwinging];
    for (int i = 0; i < kSwinging; ++i) {
      for (int j = 0; j < kSlosh; j += kLanes) turn.of(cost.P[i], j).store(turned[i] + j);
    }
    for (int i = 0; i < kSwinging; ++i) {
      double* row = model[3 * n + i] + 3 * n;
      for (int j = block_of(i); j < kSlosh; j += kLanes) {
        const Lanes add = turn.same[i] * Lanes::load(turned[i] + j) + turn.other[i] * Lanes::load(turned[i ^ 1] + j);
        (Lanes::load(row + j) + add).store(row + j);
      }
    }
  }

  /// Gaussian elimination of u: its rows keep what the forward sweep needs. Each row is finished at once, in registers.
  static bool eliminate(Model& model, double smallest_pivot, bool state_too) {
    alignas(64) Row scaled[n];  // rows of u over their pivots
    return eliminate_from<0>(model, scaled, smallest_pivot, state_too);
  }

  /// The rows whose diagonal is in the register `block` of a row, and those behind them.
  template <int block>
  static bool eliminate_from(Model& model, Row* scaled, double smallest_pivot, bool state_too) {
    if constexpr (block * kLanes < kSize) {
      for (int i = block * kLanes; i < std::min((block + 1) * kLanes, state_too ? kSize : n); ++i) {
        reduce<block>(model, scaled, i);
        if (i >= n) continue;
        if (!(model[i][i] > smallest_pivot)) return false;
        const double inverse = 1.0 / model[i][i];
        for (int j = block * kLanes; j < kWidth; j += kLanes) {
          (inverse * Lanes::load(model[i] + j)).store(scaled[i] + j);
        }
      }
      return eliminate_from<block + 1>(model, scaled, smallest_pivot, state_too);
    }
    return true;
  }

  /// Takes from row i what eliminating the numbers of u before it leaves of it.
  template <int block>
  static void reduce(Model& model, const Row* scaled, int i) {
    constexpr int kCount = kWidth / kLanes - block;
    std::array<Lanes, kCount> row;
#pragma GCC unroll 16
    for (int j = 0; j < kCount; ++j) row[j] = Lanes::load(model[i] + (block + j) * kLanes);
    const auto take = [&](int p) {
      const Lanes factor = scaled[p][i];
#pragma GCC unroll 16
      for (int j = 0; j < kCount; ++j) row[j] -= factor * Lanes::load(model[p] + (block + j) * kLanes);
    };
    if (i >= n) {
#pragma GCC unroll 8
      for (int p = 0; p < n; ++p) take(p);
    } else {
      for (int p = 0; p < i; ++p) take(p);
    }
#pragma GCC unroll 16
    for (int j = 0; j < kCount; ++j) row[j].store(model[i] + (block + j) * kLanes);
  }

  static bool factorise(double* numbers, const Interval& interval, int horizon, double smallest_pivot) {
    Model* models = reinterpret_cast<Model*>(numbers);
    for (int k = horizon - 1; k >= 0; --k) {
      pull_back(models[k + 1], interval.dt, models[k], k > 0);
      if constexpr (s > 0) pull_back_slosh(models[k + 1], interval, k, models[k], k > 0);
      if (!eliminate(models[k], smallest_pivot, k > 0)) return false;
    }
    return true;
  }

  static void solve(const double* numbers, const Interval& interval, int horizon, const std::vector<int>& entries,
                    NodeTable& step) {
    const Model* models = reinterpret_cast<const Model*>(numbers);
    const double dt = interval.dt;
    std::array<double, 2 * n + s> x{};
    for (int k = 0;; ++k) {
      for (int i = 0; i < 2 * n + s; ++i) step.set(entries[n + i], k, x[i]);
      if (k == horizon) return;
      std::array<double, n> u;
      for (int i = n - 1; i >= 0; --i) {
        const double* row = models[k][i];
        double sum = row[kGradient];
        for (int j = 0; j < 2 * n + s; ++j) sum += row[n + j] * x[j];
        for (int j = i + 1; j < n; ++j) sum += row[j] * u[j];
        u[i] = -sum / row[i];
      }
      if constexpr (s > 0) advance_slosh(interval, k, n, u.data(), x.data(), x.data() + 2 * n);
      for (int i = 0; i < n; ++i) {
        step.set(entries[i], k, u[i]);
        x[i] += dt * x[n + i] + 0.5 * dt * dt * u[i];
        x[n + i] += dt * u[i];
      }
    }
  }
};

/// Most joints for which kernels are compiled.
constexpr int kUsualJoints = 8;

/// Calls f with the Kernels of this number of joints.
template <int n = 1, typename F>
auto with_kernels(int dof, bool slosh, const F& f) {
  if constexpr (n < kUsualJoints) {
    if (dof != n) return with_kernels<n + 1>(dof, slosh, f);
  }
  return slosh ? f(Kernels<n, kSloshStates>()) : f(Kernels<n, 0>());
}

}  // namespace

Riccati::Riccati(JointRange joints, int all, bool liquid, int horizon, double dt)
    : joints_(joints),
      all_(all),
      horizon_(horizon),
      width_(0),
      dt_(dt),
      any_size_(joints.dof > kUsualJoints || (liquid && joints.tools > 1)) {
  const int size = 3 * joints.dof + (liquid ? joints.tools * kSloshStates : 0), width = padded_width(size);
  entries_.reserve(size);
  numbers_.assign(static_cast<std::size_t>(horizon + 2) * size * width, 0.0);
  if (any_size_) {
    cost_.assign(static_cast<std::size_t>(size) * size, 0.0);
    moved_.assign(static_cast<std::size_t>(size) * width, 0.0);
    by_force_.assign(static_cast<std::size_t>(3 * kMaxTools) * width, 0.0);
  }
  use_slosh({});
}

void Riccati::use_slosh(const Steps& steps) {
  steps_ = steps;
  entries_.clear();
  for (const int part : {2, 0, 1}) {  // u, q, dq
    for (int i = 0; i < joints_.dof; ++i) entries_.push_back(part * all_ + joints_.first + i);
  }
  for (int t = joints_.first_tool; steps[0] && t < joints_.first_tool + joints_.tools; ++t) {
    for (int i = 0; i < kSloshStates; ++i) entries_.push_back(slosh_begin(all_, t) + i);
  }
  width_ = padded_width(size());
}

bool Riccati::factorise(double smallest_pivot) {
  if (any_size_) return factorise_any(smallest_pivot);
  const Interval interval{steps_[joints_.first_tool], joints_.first, all_, dt_};
  return with_kernels(joints_.dof, interval.steps != nullptr,
                      [&](auto k) { return k.factorise(numbers_.data(), interval, horizon_, smallest_pivot); });
}

void Riccati::solve(NodeTable& step) const {
  if (any_size_) return solve_any(step);
  const Interval interval{steps_[joints_.first_tool], joints_.first, all_, dt_};
  with_kernels(joints_.dof, interval.steps != nullptr, [&](auto k) {
    k.solve(numbers_.data(), interval, horizon_, entries_, step);
    return true;
  });
}

// ---- any number of joints and liquids. Of w = [u; q; dq; s] and the next node's [q; dq; s], both as above.

/// moved_ <- P W, with P the cost to go of node k + 1 and W = d [q+; dq+; s+] / dw; then model k += W' P W.
void Riccati::pull_back_any(int k) {
  const int n = joints_.dof, arm = 2 * n, states = size() - n, liquids = (size() - 3 * n) / kSloshStates;
  const double dt = dt_, h = 0.5 * dt * dt;
  const auto P = [&](int i) { return cost_.data() + static_cast<std::size_t>(i) * states; };
  const auto E = [&](int i) { return moved_.data() + static_cast<std::size_t>(i) * width_; };
  const auto force = [&](int m) { return by_force_.data() + static_cast<std::size_t>(m) * width_; };
  const auto step = [&](int liquid) -> const SloshStep& { return steps_[joints_.first_tool + liquid][k]; };
  const auto G = [&](int liquid, int axis, int i) { return step(liquid).by_motion(axis, entries_[i]); };
  for (int i = 0; i < states; ++i) {
    for (int j = i; j < states; ++j) P(i)[j] = P(j)[i] = row(k + 1, n + i)[n + j];
  }
  for (int r = 0; r < states; ++r) {
    const double* p = P(r);
    double* e = E(r);
    for (int j = 0; j < n; ++j) {
      e[j] = h * p[j] + dt * p[n + j];
      e[n + j] = p[j];
      e[arm + j] = dt * p[j] + p[n + j];
    }
    for (int t = 0; t < liquids; ++t) {
      const SloshState costate = Eigen::Map<const SloshState>(p + arm + t * kSloshStates);
      const Vector3 by_force = step(t).by_force.transpose() * costate;
      for (int i = 0; i < 3 * n; ++i) e[i] += by_force.dot(step(t).by_motion.col(entries_[i]));
      Eigen::Map<SloshState>(e + 3 * n + t * kSloshStates) = step(t).pull_back(costate);
    }
    e[gradient()] = row(k + 1, n + r)[gradient()];
  }
  const auto add = [&](double* to, double factor, const double* from, int first) {
    for (int j = first / kLanes * kLanes; j < width_; j += kLanes)
      (Lanes::load(to + j) + factor * Lanes::load(from + j)).store(to + j);
  };
  for (int t = 0; t < liquids; ++t) {
    for (int axis = 0; axis < 3; ++axis) {
      double* f = force(3 * t + axis);
      std::fill_n(f, width_, 0.0);
      for (int i = 0; i < kSloshStates; ++i) {
        const double factor = step(t).by_force(i, axis);
        if (factor != 0.0) add(f, factor, E(arm + t * kSloshStates + i), 0);
      }
    }
  }
  const int rows = k > 0 ? size() : n;
  for (int i = 0; i < std::min(rows, 3 * n); ++i) {
    double* to = row(k, i);
    const int joint = i % n;
    const double of_q = i < n ? h : i < arm ? 1.0 : dt, of_v = i < n ? dt : i < arm ? 0.0 : 1.0;
    add(to, of_q, E(joint), i);
    if (of_v != 0.0) add(to, of_v, E(n + joint), i);
    for (int m = 0; m < 3 * liquids; ++m) {
      if (const double factor = G(m / 3, m % 3, i); factor != 0.0) add(to, factor, force(m), i);
    }
  }
  for (int i = 3 * n; i < rows; ++i) {  // S' E, which takes a deflection and its rate together
    const int state = (i - 3 * n) % kSloshStates, t = (i - 3 * n) / kSloshStates;
    if (state >= slosh_force_entry(0)) continue;
    const double* turn = step(t).transition.mode(state / 4);
    const bool rate = state % 2 != 0;
    const int pair = arm + t * kSloshStates + state - (rate ? 1 : 0);
    add(row(k, i), turn[rate ? 1 : 0], E(pair), i);
    add(row(k, i), turn[rate ? 4 : 3], E(pair + 1), i);
  }
}

bool Riccati::factorise_any(double smallest_pivot) {
  const int n = joints_.dof;
  for (int k = horizon_ - 1; k >= 0; --k) {
    pull_back_any(k);
    const int rows = k > 0 ? size() : n;
    for (int i = 0; i < rows; ++i) {
      double* to = row(k, i);
      for (int p = 0; p < std::min(i, n); ++p) {
        const double* pivot = row(k, p);
        const Lanes factor = pivot[i] / pivot[p];
        for (int j = i / kLanes * kLanes; j < width_; j += kLanes)
          (Lanes::load(to + j) - factor * Lanes::load(pivot + j)).store(to + j);
      }
      if (i < n && !(to[i] > smallest_pivot)) return false;
    }
  }
  return true;
}

void Riccati::solve_any(NodeTable& step) const {
  const int n = joints_.dof, states = size() - n;
  const auto row_of = [&](int k, int i) {
    return numbers_.data() + (static_cast<std::size_t>(k) * size() + i) * width_;
  };
  std::array<double, kMaxEntries> x{}, u{};
  for (int k = 0;; ++k) {
    for (int i = 0; i < states; ++i) step.set(entries_[n + i], k, x[i]);
    if (k == horizon_) return;
    for (int i = n - 1; i >= 0; --i) {
      const double* row = row_of(k, i);
      double sum = row[gradient()];
      for (int j = 0; j < states; ++j) sum += row[n + j] * x[j];
      for (int j = i + 1; j < n; ++j) sum += row[j] * u[j];
      u[i] = -sum / row[i];
    }
    for (int t = 0; t < (states - 2 * n) / kSloshStates; ++t) {
      const Interval interval{steps_[joints_.first_tool + t], joints_.first, all_, dt_};
      advance_slosh(interval, k, n, u.data(), x.data(), x.data() + 2 * n + t * kSloshStates);
    }
    for (int i = 0; i < n; ++i) {
      step.set(entries_[i], k, u[i]);
      x[i] += dt_ * x[n + i] + 0.5 * dt_ * dt_ * u[i];
      x[n + i] += dt_ * u[i];
    }
  }
}

}  // namespace steadyhand::realtime

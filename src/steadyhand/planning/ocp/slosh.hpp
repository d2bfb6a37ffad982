#pragma once

#include <array>

#include "steadyhand/core/lanes.hpp"
#include "steadyhand/core/math.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"

namespace steadyhand {

/// Copies of the liquid's first mode in one problem, of different frequencies: a plan that is right for each of them is
/// right for a liquid whose frequency is not known exactly.
inline constexpr int kSloshModes = 3;
/// Numbers of the liquid's state: for each mode and each lateral axis of the glass a deflection and its rate, then the
/// specific force of the interval before.
inline constexpr int kSloshStates = 4 * kSloshModes + 3;

/// Where in z the state of a tool's liquid begins.
constexpr int slosh_begin(int dof, int tool) { return 3 * dof + tool * kSloshStates; }

/// The liquid at a node. Deflections are accelerations: a liquid at rest under a constant specific force f has the
/// deflection f of the axis, times g / f_z. Rates are divided by the mode's frequency, so all is in m/s^2, tool frame.
template <typename Scalar>
using SloshStateOf = Eigen::Matrix<Scalar, kSloshStates, 1>;
using SloshState = SloshStateOf<double>;  ///< at one node
/// Where in a SloshState the deflection of a mode along an axis (0: x, 1: y) is; its rate is the next one.
constexpr int slosh_entry(int mode, int axis) { return 4 * mode + 2 * axis; }
/// Where the force along an axis (0 to 2) is.
constexpr int slosh_force_entry(int axis) { return 4 * kSloshModes + axis; }

/// How the liquid's state goes over one interval of constant force, by the part of it along the axis of the glass:
/// coefficients for each mode.
struct SloshTransition {
  static constexpr int kSize = 6;                             ///< by row: x+ by x, v and f, then v+ by x, v and f
  alignas(64) std::array<double, kSize * kSloshModes> value;  ///< mode by mode

  /// The coefficients of a mode.
  const double* mode(int i) const { return value.data() + kSize * i; }
};

/// One interval of the liquid's motion, with derivatives at a state. The specific force f (3, tool frame, m/s^2) is
/// constant, with its value at the interval's middle.
struct SloshStep {
  Vector3 force = Vector3::Zero();  ///< f, m/s^2
  SloshTransition transition;       ///< at f_z
  SloshTransition by_vertical;      ///< its first derivative by f_z
  SloshTransition by_vertical2;     ///< its second
  /// f by [q; dq; u] of the interval's begin.
  Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 3 * kMaxJoints> by_motion;
  Eigen::Matrix<double, kSloshStates, 3> by_force;  ///< state+ by f, see differentiate()

  SloshState next(const SloshState& state) const;  ///< state+
  /// Sets by_force.
  void differentiate(const SloshState& state);
  /// (d state+ / d state)' costate
  SloshState pull_back(const SloshState& costate) const;
  /// Second derivatives of costate . state+ by f.
  Matrix3 curvature_by_force(const SloshState& state, const SloshState& costate) const;
  /// Second derivatives of costate . state+ by the state and f_z; by the other forces they are 0.
  SloshState curvature_by_vertical(const SloshState& costate) const;
};

/// The liquid's first sloshing mode, driven by the glass's motion. For each axis, with f the lateral specific force,
///   x'' = w^2 (f - (f_z / g) x) - 2 zeta w x',
/// and the wave at the wall e = (R / g) (c x + (1 - c) f), c = 0.837: the first mode has this share of the surface
/// under constant acceleration, the higher ones follow at once. docs/explanation/formulation.md.
class SloshModel {
 public:
  /// Of no liquid: all zero.
  SloshModel() = default;
  /// @param dt s, of an interval
  /// @param factors the modes' frequencies, times slosh_frequency(glass)
  SloshModel(const GlassSettings& glass, double dt, const std::array<double, kSloshModes>& factors);

  /// The state of a liquid at rest under this specific force.
  SloshState at_rest(const Vector3& force) const;
  /// Sets force and transition, and unless `derivatives` is false those by f_z.
  void set_step(const Vector3& force, bool derivatives, SloshStep& step) const;

  /// m, along both axes of the glass: height of the wave at the wall, above the liquid at rest; then how high it would
  /// swing from there by its rate alone.
  template <typename S>
  std::array<S, 4> wave(const SloshStateOf<S>& state, int mode) const {
    const S c(height_by_deflection_), d(height_by_force_);
    const int x = slosh_entry(mode, 0), y = slosh_entry(mode, 1);
    return {c * state[x] + d * state[slosh_force_entry(0)], c * state[y] + d * state[slosh_force_entry(1)],
            c * state[x + 1], c * state[y + 1]};
  }
  double height_by_deflection() const { return height_by_deflection_; }  ///< m per m/s^2
  double height_by_force() const { return height_by_force_; }            ///< the same
  double dt() const { return dt_; }                                      ///< s, of an interval

 private:
  /// The transition is a polynomial in f_z / g - 1; what multiplies its powers.
  static constexpr int kDegree = 7;
  std::array<SloshTransition, kDegree + 1> coefficients_{};
  double height_by_deflection_ = 0.0, height_by_force_ = 0.0, dt_ = 0.0;
};

/// The problem's data of one tool's liquid at node 0.
struct LiquidInstance {
  SloshModel model;     ///< of intervals of the problem's dt
  GlassSettings glass;  ///< for the model
  /// False: the liquid does not count. Its rows are far inside their bounds, and a solver may leave out its states.
  bool counts = true;
  double room = 0.0;                      ///< m, how high a wave may be
  SloshState state = SloshState::Zero();  ///< at node 0
};

}  // namespace steadyhand

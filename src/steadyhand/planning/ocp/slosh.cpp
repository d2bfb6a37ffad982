#include "steadyhand/planning/ocp/slosh.hpp"

#include <Eigen/LU>
#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

namespace steadyhand {

namespace {

/// f_z / g between which the polynomials are made: falling faster than the liquid, and up as arms can.
constexpr double kLeastGamma = -1.0, kMostGamma = 3.0;

/// The exact transition at f_z / g = gamma, by row: x+ and v+ by x, v, f.
std::array<double, SloshTransition::kSize> exact_transition(double frequency, double damping, double gamma, double dt) {
  Matrix3 rate = Matrix3::Zero();  // of x, v = x' / w and f
  rate.row(0) << 0.0, frequency, 0.0;
  rate.row(1) << -frequency * gamma, -2.0 * damping * frequency, frequency;
  const Matrix3 over_interval = Matrix3(dt * rate).exp();
  return {over_interval(0, 0), over_interval(0, 1), over_interval(0, 2),
          over_interval(1, 0), over_interval(1, 1), over_interval(1, 2)};
}

}  // namespace

SloshModel::SloshModel(const GlassSettings& glass, double dt, const std::array<double, kSloshModes>& factors)
    : dt_(dt) {
  const double g = kGravity.z();
  height_by_deflection_ = glass.radius / g * kShareOfFirstMode;
  height_by_force_ = glass.radius / g * (1.0 - kShareOfFirstMode);
  constexpr int kCount = kDegree + 1;
  Eigen::Matrix<double, kCount, kCount> powers;
  Eigen::Matrix<double, kCount, SloshTransition::kSize> values;
  for (int mode = 0; mode < kSloshModes; ++mode) {
    for (int i = 0; i < kCount; ++i) {  // Chebyshev's points
      const double gamma = 0.5 * (kLeastGamma + kMostGamma) +
                           0.5 * (kMostGamma - kLeastGamma) * std::cos(M_PI * (2 * i + 1) / (2.0 * kCount));
      for (int j = 0; j < kCount; ++j) powers(i, j) = std::pow(gamma - 1.0, j);
      const auto exact = exact_transition(factors[mode] * slosh_frequency(glass), slosh_damping(glass), gamma, dt);
      for (int j = 0; j < SloshTransition::kSize; ++j) values(i, j) = exact[j];
    }
    const Eigen::Matrix<double, kCount, SloshTransition::kSize> found = powers.partialPivLu().solve(values);
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j < SloshTransition::kSize; ++j) {
        coefficients_[i].value[SloshTransition::kSize * mode + j] = found(i, j);
      }
    }
  }
}

SloshState SloshModel::at_rest(const Vector3& force) const {
  SloshState state = SloshState::Zero();
  const double gamma = std::max(0.1, force.z() / kGravity.z());
  for (int mode = 0; mode < kSloshModes; ++mode) {
    for (int axis = 0; axis < 2; ++axis) state[slosh_entry(mode, axis)] = force[axis] / gamma;
  }
  state.tail<3>() = force;
  return state;
}

void SloshModel::set_step(const Vector3& force, bool derivatives, SloshStep& step) const {
  const double g = kGravity.z(), s = force.z() / g - 1.0;
  step.force = force;
  const auto horner = [&](SloshTransition& to, double scale, const auto& factor, int lowest) {
    for (std::size_t j = 0; j < to.value.size(); ++j) {
      double sum = factor(kDegree) * coefficients_[kDegree].value[j];
      for (int i = kDegree - 1; i >= lowest; --i) sum = sum * s + factor(i) * coefficients_[i].value[j];
      to.value[j] = scale * sum;
    }
  };
  horner(step.transition, 1.0, [](int) { return 1.0; }, 0);
  if (!derivatives) return;
  horner(step.by_vertical, 1.0 / g, [](int i) { return double(i); }, 1);
  horner(step.by_vertical2, 1.0 / (g * g), [](int i) { return double(i * (i - 1)); }, 2);
}

SloshState SloshStep::next(const SloshState& state) const {
  SloshState result;
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const double* t = transition.mode(mode);
    for (int axis = 0; axis < 2; ++axis) {
      const int i = slosh_entry(mode, axis);
      result[i] = t[0] * state[i] + t[1] * state[i + 1] + t[2] * force[axis];
      result[i + 1] = t[3] * state[i] + t[4] * state[i + 1] + t[5] * force[axis];
    }
  }
  result.tail<3>() = force;
  return result;
}

void SloshStep::differentiate(const SloshState& state) {
  by_force.setZero();
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const double *t = transition.mode(mode), *d = by_vertical.mode(mode);
    for (int axis = 0; axis < 2; ++axis) {
      const int i = slosh_entry(mode, axis);
      for (int row = 0; row < 2; ++row) {
        by_force(i + row, axis) = t[3 * row + 2];
        by_force(i + row, 2) = d[3 * row] * state[i] + d[3 * row + 1] * state[i + 1] + d[3 * row + 2] * force[axis];
      }
    }
  }
  by_force.bottomRows<3>().setIdentity();
}

SloshState SloshStep::pull_back(const SloshState& costate) const {
  SloshState result = SloshState::Zero();
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const double* t = transition.mode(mode);
    for (int axis = 0; axis < 2; ++axis) {
      const int i = slosh_entry(mode, axis);
      result[i] = t[0] * costate[i] + t[3] * costate[i + 1];
      result[i + 1] = t[1] * costate[i] + t[4] * costate[i + 1];
    }
  }
  return result;
}

Matrix3 SloshStep::curvature_by_force(const SloshState& state, const SloshState& costate) const {
  Matrix3 result = Matrix3::Zero();
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const double *d = by_vertical.mode(mode), *dd = by_vertical2.mode(mode);
    for (int axis = 0; axis < 2; ++axis) {
      const int i = slosh_entry(mode, axis);
      for (int row = 0; row < 2; ++row) {
        result(axis, 2) += costate[i + row] * d[3 * row + 2];
        result(2, 2) += costate[i + row] *
                        (dd[3 * row] * state[i] + dd[3 * row + 1] * state[i + 1] + dd[3 * row + 2] * force[axis]);
      }
    }
  }
  result(2, 0) = result(0, 2);
  result(2, 1) = result(1, 2);
  return result;
}

SloshState SloshStep::curvature_by_vertical(const SloshState& costate) const {
  SloshState result = SloshState::Zero();
  for (int mode = 0; mode < kSloshModes; ++mode) {
    const double* d = by_vertical.mode(mode);
    for (int axis = 0; axis < 2; ++axis) {
      const int i = slosh_entry(mode, axis);
      result[i] = d[0] * costate[i] + d[3] * costate[i + 1];
      result[i + 1] = d[1] * costate[i] + d[4] * costate[i + 1];
    }
  }
  return result;
}

}  // namespace steadyhand

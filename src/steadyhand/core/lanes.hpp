#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "steadyhand/core/configuration.hpp"

namespace steadyhand {

/// Doubles in one register of the processor that the library is built for.
inline constexpr int kLanes = STEADYHAND_LANES;

/// kLanes doubles that go through the same arithmetic at once: a Scalar for Eigen and for the terms, one node of the
/// horizon per lane. Made of the compiler's vector type, so any width compiles on any processor; aligned and passed to
/// functions alike for each. How the vector type itself is passed depends on the processor, so functions that take or
/// return it are always inlined.
class alignas(kLanes * sizeof(double)) Lanes {
 public:
  /// The compiler's own.
  using Vector [[gnu::vector_size(kLanes * sizeof(double))]] = double;
  using Mask [[gnu::vector_size(kLanes * sizeof(std::int64_t))]] = std::int64_t;  ///< -1 or 0 in each lane

  Lanes() = default;
  /// @{ Lanes, or a number in each of them.
  // Written out, so that calls pass Lanes in memory. If they were passed in registers, a caller compiled for another
  // register width would not agree with the library.
  Lanes(const Lanes& other) : v_(other.v_) {}
  Lanes& operator=(const Lanes& other) {
    v_ = other.v_;
    return *this;
  }
  Lanes(double all) : v_(Vector{} + all) {}  // NOLINT(google-explicit-constructor): a number fills all lanes
  [[gnu::always_inline]] explicit Lanes(Vector v) : v_(v) {}
  /// @}
  /// @{ From and to kLanes numbers.
  static Lanes load(const double* from) {
    Lanes result;
    std::memcpy(&result.v_, from, sizeof(Vector));
    return result;
  }
  void store(double* to) const { std::memcpy(to, &v_, sizeof(Vector)); }
  /// @}

  /// @{ One lane's, or all.
  double operator[](int lane) const { return v_[lane]; }
  void set(int lane, double value) { v_[lane] = value; }
  [[gnu::always_inline]] Vector vector() const { return v_; }
  /// @}

  /// @{ Lane by lane.
  Lanes& operator+=(Lanes b) { return *this = Lanes(v_ + b.v_); }
  Lanes& operator-=(Lanes b) { return *this = Lanes(v_ - b.v_); }
  Lanes& operator*=(Lanes b) { return *this = Lanes(v_ * b.v_); }
  Lanes& operator/=(Lanes b) { return *this = Lanes(v_ / b.v_); }
  friend Lanes operator+(Lanes a, Lanes b) { return Lanes(a.v_ + b.v_); }
  friend Lanes operator-(Lanes a, Lanes b) { return Lanes(a.v_ - b.v_); }
  friend Lanes operator*(Lanes a, Lanes b) { return Lanes(a.v_ * b.v_); }
  friend Lanes operator/(Lanes a, Lanes b) { return Lanes(a.v_ / b.v_); }
  friend Lanes operator-(Lanes a) { return Lanes(-a.v_); }
  [[gnu::always_inline]] friend Mask operator<(Lanes a, Lanes b) { return a.v_ < b.v_; }
  [[gnu::always_inline]] friend Mask operator>(Lanes a, Lanes b) { return a.v_ > b.v_; }

  [[gnu::always_inline]] friend Lanes select(Mask mask, Lanes yes, Lanes no) { return Lanes(mask ? yes.v_ : no.v_); }
  /// @}
  /// @{ Lane by lane. NaN in b is passed on.
  friend Lanes max(Lanes a, Lanes b) { return select(a > b, a, b); }
  friend Lanes min(Lanes a, Lanes b) { return select(a < b, a, b); }
  friend Lanes abs(Lanes a) { return max(a, -a); }
  friend Lanes sqrt(Lanes a) {
    for (int i = 0; i < kLanes; ++i) a.v_[i] = std::sqrt(a.v_[i]);
    return a;
  }
  /// @}
  /// @{ Over the lanes.
  friend double sum(Lanes a) {
    double result = 0.0;
    for (int i = 0; i < kLanes; ++i) result += a.v_[i];
    return result;
  }
  friend double largest(Lanes a) {
    double result = a.v_[0];
    for (int i = 1; i < kLanes; ++i) result = a.v_[i] > result ? a.v_[i] : result;
    return result;
  }
  /// @}

 private:
  Vector v_;
};

static_assert(!std::is_trivially_copy_constructible_v<Lanes>, "see the copy constructor");

/// @{ As for lanes, so that code can be written once for both.
inline double select(bool mask, double yes, double no) { return mask ? yes : no; }
inline bool any(bool mask) { return mask; }
[[gnu::always_inline]] inline bool any(Lanes::Mask mask) {
  std::int64_t result = 0;
  for (int i = 0; i < kLanes; ++i) result |= mask[i];
  return result != 0;
}
/// @}

/// sin and cos of a joint's angle; to 1e-15 for |x| up to 1e4 rad.
inline void sin_cos(double x, double& s, double& c) {
  s = std::sin(x);
  c = std::cos(x);
}

/// Reduction to [-pi/4, pi/4] by a pi/2 of three parts, then the Taylor series, which end below half a unit in the last
/// place there.
inline void sin_cos(Lanes angle, Lanes& s, Lanes& c) {
  constexpr double kRound = 0x1.8p52;  // adding it leaves an integer in the low bits
  constexpr double kHalfPi1 = 0x1.921fb54400000p0, kHalfPi2 = 0x1.0b4611a600000p-34, kHalfPi3 = 0x1.3198a2e037073p-69;
  const Lanes shifted = angle * (2.0 / M_PI) + kRound;
  const Lanes quarter = shifted - kRound;
  const Lanes x = ((angle - quarter * kHalfPi1) - quarter * kHalfPi2) - quarter * kHalfPi3, xx = x * x;
  const auto series = [&](double first, int last) {  // 1 - xx / (f (f+1)) (1 - xx / ((f+2) (f+3)) (...
    Lanes result = 1.0;
    for (double f = first + last; f >= first; f -= 2.0) result = 1.0 - xx * (1.0 / (f * (f + 1.0))) * result;
    return result;
  };
  const Lanes sine = x * series(2.0, 14), cosine = series(1.0, 14);
  Lanes::Mask quadrant;
  const Lanes::Vector bits = shifted.vector();
  std::memcpy(&quadrant, &bits, sizeof quadrant);
  const Lanes::Mask odd = -(quadrant & 1), sine_sign = -((quadrant >> 1) & 1),
                    cosine_sign = -(((quadrant + 1) >> 1) & 1);
  s = select(odd, cosine, sine);
  c = select(odd, sine, cosine);
  s = select(sine_sign, -s, s);
  c = select(cosine_sign, -c, c);
}

}  // namespace steadyhand

namespace Eigen {

template <>
struct NumTraits<steadyhand::Lanes> : NumTraits<double> {
  using Real = steadyhand::Lanes;
  using NonInteger = steadyhand::Lanes;
  using Nested = steadyhand::Lanes;
  using Literal = double;
  enum { RequireInitialization = 0, ReadCost = 1, AddCost = 1, MulCost = 1 };
};
template <typename Operation>
struct ScalarBinaryOpTraits<steadyhand::Lanes, double, Operation> {
  using ReturnType = steadyhand::Lanes;
};
template <typename Operation>
struct ScalarBinaryOpTraits<double, steadyhand::Lanes, Operation> {
  using ReturnType = steadyhand::Lanes;
};

namespace internal {
/// An array of Lanes is aligned as Lanes are: Eigen would ask for EIGEN_MAX_ALIGN_BYTES, which may be less.
template <int kSize>
struct compute_default_alignment<steadyhand::Lanes, kSize> {
  enum { value = 0 };
};
}  // namespace internal

}  // namespace Eigen

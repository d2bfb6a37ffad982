#pragma once

#include "steadyhand/core/math.hpp"

namespace steadyhand {

/// An upright cylindrical glass, partly filled.
struct GlassSettings {
  double radius = 0.035;  ///< m, inside, > 0
  double height = 0.11;   ///< m, inside, > fill
  double fill = 0.08;     ///< m of liquid, > 0
  double damping = 0.03;  ///< share of critical damping, 0 to 1
};

/// The liquid in the glass: its surface as a plane that swings.
struct LiquidState {
  double tilt_x = 0.0, tilt_y = 0.0;  ///< rad, of the surface's normal about the glass's x and y axes
  double freeboard = 0.0;             ///< m, from the surface's highest point to the rim; negative: over the rim
  bool spilled = false;               ///< has gone over the rim since the last reset
};

/// Natural frequency of the first lateral sloshing mode of a cylinder, rad/s:
/// omega^2 = g (1.841 / R) tanh(1.841 h / R), 1.841 the first zero of the Bessel function J1's derivative (Ibrahim,
/// Liquid Sloshing Dynamics, 2005). The curvature of the surface by its tension, which matters below some 10 mm, is
/// left out.
double slosh_frequency(const GlassSettings& glass);

/// The liquid's surface as a plane across a pendulum of that frequency, free to swing about two axes: it hangs where
/// the glass is, in the base frame, so a glass that turns slides around it. Large angles are allowed; waves that break,
/// and higher modes, are not in it. Allocates nothing.
class Liquid {
 public:
  explicit Liquid(const GlassSettings& glass);

  /// At rest, nothing spilled.
  void reset();
  /// Moves on by dt s (at most a few ms) in which the glass has this rotation and this local acceleration R' (p'' + g),
  /// glass frame, m/s^2.
  void update(double dt, const Quaternion& q_base_glass, const Vector3& local_acceleration);

  const LiquidState& state() const { return state_; }

 private:
  GlassSettings glass_;
  double frequency_;
  Vector3 up_ = Vector3::UnitZ();   ///< normal of the surface, base frame, unit
  Vector3 rate_ = Vector3::Zero();  ///< its derivative, 1/s
  LiquidState state_;
};

}  // namespace steadyhand

#pragma once

namespace steadyhand {

/// An upright glass, partly filled: a cylinder, or another container by the radius of its surface and a frequency of
/// its own.
struct GlassSettings {
  double radius = 0.035;    ///< m, inside, of the liquid's surface, > 0
  double height = 0.1;      ///< m, inside, > fill
  double fill = 0.09;       ///< m of liquid, > 0
  double viscosity = 1e-6;  ///< m^2/s, kinematic, >= 0; water's
  /// Of the first mode, over that of a cylinder of this radius and fill; from 0.2 to 5. `python bench/containers.py`
  /// computes it from the shape.
  double frequency_factor = 1.0;

  double freeboard() const { return height - fill; }  ///< m, from the liquid at rest to the rim
  bool operator==(const GlassSettings&) const = default;
};

/// Of the surface under constant acceleration this share is the first mode's; the higher modes follow at once.
inline constexpr double kShareOfFirstMode = 0.837;

/// Natural frequency of the first lateral sloshing mode of a cylinder, rad/s:
/// omega^2 = g (xi / R) tanh(xi h / R), xi = 1.841 the first zero of the Bessel function J1's derivative (Ibrahim,
/// Liquid Sloshing Dynamics, 2005). The curvature of the surface by its tension, which matters below some 10 mm, is
/// left out. Times the glass's factor.
double slosh_frequency(const GlassSettings& glass);

/// Share of critical damping of that mode, by the liquid's viscosity (Dodge, The New "Dynamic Behavior of Liquids in
/// Moving Containers", 2000): 0.006 for water in a drinking glass, so a wave takes seconds to die.
double slosh_damping(const GlassSettings& glass);

}  // namespace steadyhand

#pragma once

#include <array>

#include "steadyhand/core/math.hpp"

namespace steadyhand {

/// An upright glass, partly filled: a cylinder, or another container by the radius of its surface and its
/// frequency.
struct GlassSettings {
  double radius = 0.035;    ///< m, inside, of the liquid's surface, > 0
  double height = 0.1;      ///< m, inside, > fill
  double fill = 0.09;       ///< m of liquid, > 0
  double viscosity = 1e-6;  ///< m^2/s, kinematic, >= 0; water's
  /// Frequency of the first mode, relative to a cylinder of this radius and fill; from 0.2 to 5. `python
  /// bench/containers.py` computes it from the shape.
  double frequency_factor = 1.0;

  double freeboard() const { return height - fill; }      ///< m, from the liquid at rest to the rim
  bool operator==(const GlassSettings&) const = default;  ///< compares all members
};

/// Share of the first mode in the surface under constant acceleration; the higher modes follow at once.
inline constexpr double kShareOfFirstMode = 0.837;

/// Natural frequency of the first lateral sloshing mode of a cylinder, rad/s:
/// omega^2 = g (xi / R) tanh(xi h / R), xi = 1.841 the first zero of the Bessel function J1's derivative (Ibrahim,
/// Liquid Sloshing Dynamics, 2005). The curvature of the surface by its tension, which matters below some 10 mm, is
/// left out. Times the glass's factor.
double slosh_frequency(const GlassSettings& glass);

/// Share of critical damping of that mode, by the liquid's viscosity (Dodge, The New "Dynamic Behavior of Liquids in
/// Moving Containers", 2000): 0.006 for water in a drinking glass, so a wave takes seconds to die.
double slosh_damping(const GlassSettings& glass);

/// State of the liquid in the glass: the surface is a plane that swings.
struct LiquidState {
  double tilt_x = 0.0;           ///< rad, tilt of the surface's normal about the glass's x axis
  double tilt_y = 0.0;           ///< rad, about its y axis
  double freeboard = 0.0;        ///< m, from the surface's highest point to the rim; negative: over the rim
  bool spilled = false;          ///< liquid has gone over the rim since the last reset
  double spilled_share = 0.0;    ///< share of the liquid at the last reset that was lost
  double least_freeboard = 0.0;  ///< m, the smallest since the last reset: the largest wave
  /// m/s^2, lateral specific force, the largest of the last 20 ms and a little more: a reader at 60 Hz misses no peak.
  double lateral = 0.0;
};

/// The first sloshing mode, free to swing along the glass's x and y axes, with the equations of
/// docs/explanation/formulation.md that the planner's `no_spill` has, in small steps of the measured motion.
/// Liquid of the surface's plane above the rim is lost, and the surface sinks by as much. Breaking waves, higher modes
/// and splashes are not modelled: in a fluid simulation crests are 3 to 4 mm above the plane. Allocates nothing.
class Liquid {
 public:
  /// At rest in an upright glass.
  explicit Liquid(const GlassSettings& glass);

  /// At rest, nothing spilled. A glass that leans is as full as it can be, an upside-down one is empty.
  /// @param local_acceleration of the glass at rest, see update()
  void reset(const Vector3& local_acceleration = kGravity);
  /// Advances by dt s, of any length, at this local acceleration R' (p'' + g) of the glass, glass frame, m/s^2.
  void update(double dt, const Vector3& local_acceleration);

  const LiquidState& state() const { return state_; }  ///< after the last update

 private:
  void step(double dt, const Vector3& local_acceleration);

  GlassSettings glass_;
  double frequency_, damping_;
  Eigen::Vector2d deflection_ = Eigen::Vector2d::Zero();  ///< m/s^2, of the mode
  Eigen::Vector2d rate_ = Eigen::Vector2d::Zero();        ///< m/s^3
  double lost_ = 0.0;                                     ///< m^3, of a glass that is as full as an upright one
  double never_in_ = 0.0;                                 ///< m^3 of it, which a glass that leaned could not hold
  /// The largest lateral force of each of the last parts of the time that LiquidState::lateral looks back.
  std::array<double, 5> felt_{};
  double felt_for_ = 0.0;  ///< s, of the present part
  LiquidState state_;
};

}  // namespace steadyhand

#pragma once

#include <array>

#include "steadyhand/core/glass.hpp"
#include "steadyhand/core/math.hpp"

namespace steadyhand {

/// The liquid in the glass: its surface as a plane that swings.
struct LiquidState {
  double tilt_x = 0.0, tilt_y = 0.0;  ///< rad, of the surface's normal about the glass's x and y axes
  double freeboard = 0.0;             ///< m, from the surface's highest point to the rim; negative: over the rim
  bool spilled = false;               ///< has gone over the rim since the last reset
  double spilled_share = 0.0;         ///< of the liquid that was in it at the last reset, so far
  double least_freeboard = 0.0;       ///< m, the smallest since the last reset: the largest wave
  /// m/s^2, sideways force on it, the largest of the last 20 ms and a little more: who looks 60 times a second misses
  /// no peak.
  double lateral = 0.0;
};

/// The first sloshing mode, free to swing along the glass's x and y axes, with the equations of
/// docs/explanation/formulation.md that the planner's `no_spill` has, in small steps of the motion that came about.
/// What of the surface's plane stands over the rim is lost, and the surface sinks by as much. Waves that break, higher
/// modes and splashes are not in it: in a fluid simulation crests stand 3 to 4 mm above the plane. Allocates nothing.
class Liquid {
 public:
  explicit Liquid(const GlassSettings& glass);

  /// At rest, nothing spilled. In a glass that leans as full as that one can be, upside down empty.
  /// @param local_acceleration of the glass at rest, as of update()
  void reset(const Vector3& local_acceleration = kGravity);
  /// Moves on by dt s, of any length, in which the glass has this local acceleration R' (p'' + g), glass frame, m/s^2.
  void update(double dt, const Vector3& local_acceleration);

  const LiquidState& state() const { return state_; }

 private:
  void step(double dt, const Vector3& local_acceleration);

  GlassSettings glass_;
  double frequency_, damping_;
  Eigen::Vector2d deflection_ = Eigen::Vector2d::Zero();  ///< m/s^2, of the mode
  Eigen::Vector2d rate_ = Eigen::Vector2d::Zero();        ///< m/s^3
  double lost_ = 0.0;                                     ///< m^3, of a glass that is as full as one that stands
  double never_in_ = 0.0;                                 ///< m^3 of it, which a glass that leaned could not hold
  /// The largest lateral force of each of the last parts of the time that LiquidState::lateral looks back.
  std::array<double, 5> felt_{};
  double felt_for_ = 0.0;  ///< s, of the part that goes on
  LiquidState state_;
};

}  // namespace steadyhand

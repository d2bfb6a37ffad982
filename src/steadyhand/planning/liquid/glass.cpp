#include <algorithm>
#include <cmath>

#include "steadyhand/core/math.hpp"
#include "steadyhand/planning/liquid/liquid.hpp"

namespace steadyhand {

namespace {
constexpr double kBesselZero = 1.8411837813;
}

double slosh_frequency(const GlassSettings& glass) {
  const double k = kBesselZero / glass.radius;
  return glass.frequency_factor * std::sqrt(kGravity.z() * k * std::tanh(k * glass.fill));
}

double slosh_damping(const GlassSettings& glass) {
  const double R = glass.radius, depth = glass.fill / R;
  const double boundary_layer = std::sqrt(glass.viscosity / std::sqrt(kGravity.z() * R * R * R));
  const double shallow = 0.318 / std::sinh(1.84 * depth) * (1.0 + (1.0 - depth) / std::cosh(1.84 * depth));
  return std::min(1.0, 0.79 * boundary_layer * (1.0 + shallow));
}

}  // namespace steadyhand

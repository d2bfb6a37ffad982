#include "steadyhand/arm/liquid.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

/// m^3, of a plane of this slope through the middle of a cylinder, between it and a lid `above` the middle.
double volume_above(double radius, double slope, double above) {
  const double edge = std::min(radius, above / slope), width = std::sqrt(radius * radius - edge * edge);
  return slope * 2.0 / 3.0 * width * width * width -
         above * (radius * radius * std::acos(edge / radius) - edge * width);
}

}  // namespace

Liquid::Liquid(const GlassSettings& glass)
    : glass_(glass), frequency_(slosh_frequency(glass)), damping_(slosh_damping(glass)) {
  reset();
}

void Liquid::reset() {
  deflection_.setZero();
  rate_.setZero();
  lost_ = 0.0;
  state_ = {};
  state_.freeboard = glass_.freeboard();
}

void Liquid::update(double dt, const Vector3& local_acceleration) {
  const double g = kGravity.z(), w = frequency_;
  const Eigen::Vector2d lateral = local_acceleration.head<2>();
  rate_ += dt * (w * w * (lateral - local_acceleration.z() / g * deflection_) - 2.0 * damping_ * w * rate_);
  deflection_ += dt * rate_;
  // In a glass that is upside down, or falls, the mode only grows: nothing that matters is beyond this.
  constexpr double kMost = 20.0;  // g
  if (const double most = kMost * g; deflection_.norm() > most) {
    deflection_ *= most / deflection_.norm();
    rate_.setZero();
  }

  const Eigen::Vector2d slope = (kShareOfFirstMode * deflection_ + (1.0 - kShareOfFirstMode) * lateral) / g;
  state_.tilt_x = std::atan(-slope.y());
  state_.tilt_y = std::atan(slope.x());
  const double area = M_PI * glass_.radius * glass_.radius, steepness = slope.norm();
  double above = glass_.freeboard() + lost_ / area;
  if (steepness * glass_.radius > above) {
    const double left = area * glass_.fill - lost_;
    lost_ += std::min(volume_above(glass_.radius, steepness, above), left);
    above = glass_.freeboard() + lost_ / area;
    state_.spilled = true;
    state_.spilled_share = lost_ / (area * glass_.fill);
  }
  state_.freeboard = above - glass_.radius * steepness;
}

}  // namespace steadyhand

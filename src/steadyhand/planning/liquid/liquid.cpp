#include "steadyhand/planning/liquid/liquid.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

namespace {

constexpr double kLooksBack = 0.02;  ///< s, of LiquidState::lateral
constexpr double kEmpty = 1e-9;      ///< share of a full glass; less is a rounding error, not liquid

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

void Liquid::reset(const Vector3& local_acceleration) {
  const double g = kGravity.z(), down = std::max(local_acceleration.z(), 0.1 * g);
  deflection_ = g / down * local_acceleration.head<2>();
  rate_.setZero();
  lost_ = never_in_ = 0.0;
  state_ = {};
  state_.freeboard = state_.least_freeboard = glass_.freeboard();
  felt_.fill(0.0);
  felt_for_ = 0.0;
  const bool hangs = local_acceleration.z() <= 0.0;
  if (hangs) lost_ = M_PI * glass_.radius * glass_.radius * glass_.fill;
  if (deflection_.isZero(1e-9) && !hangs) return;
  for (int i = 0; i < 1000 && (i == 0 || state_.freeboard < -1e-5); ++i) {  // runs off until it is as full as it can be
    step(0.0, local_acceleration);
  }
  never_in_ = lost_;
  state_.spilled = false;
  state_.spilled_share = 0.0;
  state_.least_freeboard = state_.freeboard;
}

void Liquid::update(double dt, const Vector3& local_acceleration) {
  constexpr double kCalm = 120.0;  // s, after which waves have decayed: the program may have been suspended for a day
  const double longest = std::min(0.004, 0.5 / frequency_);  // s: explicit steps are stable below 2 / frequency
  const double duration = std::min(dt, kCalm);
  const int steps = std::max(1, static_cast<int>(std::ceil(duration / longest)));
  for (int i = 0; i < steps; ++i) step(duration / steps, local_acceleration);
}

/// @param dt s, at most a few ms
void Liquid::step(double dt, const Vector3& local_acceleration) {
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
  const double full = area * glass_.fill, left = full - lost_;
  if (steepness * glass_.radius > above && left > kEmpty * full) {
    lost_ += std::min(volume_above(glass_.radius, steepness, above), left);
    above = glass_.freeboard() + lost_ / area;
    state_.spilled = true;
    state_.spilled_share = (lost_ - never_in_) / (full - never_in_);
  }
  state_.freeboard = above - glass_.radius * steepness;
  state_.least_freeboard = std::min(state_.least_freeboard, state_.freeboard);

  felt_for_ += dt;
  if (felt_for_ > kLooksBack / (felt_.size() - 1)) {
    std::rotate(felt_.rbegin(), felt_.rbegin() + 1, felt_.rend());
    felt_[0] = felt_for_ = 0.0;
  }
  felt_[0] = std::max(felt_[0], lateral.norm());
  state_.lateral = *std::max_element(felt_.begin(), felt_.end());
}

}  // namespace steadyhand

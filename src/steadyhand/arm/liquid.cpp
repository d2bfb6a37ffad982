#include "steadyhand/arm/liquid.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

double slosh_frequency(const GlassSettings& glass) {
  constexpr double kZero = 1.8411837813;
  const double k = kZero / glass.radius;
  return std::sqrt(kGravity.z() * k * std::tanh(k * glass.fill));
}

Liquid::Liquid(const GlassSettings& glass) : glass_(glass), frequency_(slosh_frequency(glass)) { reset(); }

void Liquid::reset() {
  up_ = Vector3::UnitZ();
  rate_.setZero();
  state_ = {};
  state_.freeboard = glass_.height - glass_.fill;
}

void Liquid::update(double dt, const Quaternion& q_base_glass, const Vector3& local_acceleration) {
  // A pendulum of length g / omega^2 whose pivot feels `pull`: the bob is at -up.
  const Vector3 pull = q_base_glass * local_acceleration;
  const Vector3 torque = frequency_ * frequency_ / kGravity.z() * (pull - pull.dot(up_) * up_);
  rate_ += dt * (torque - 2.0 * glass_.damping * frequency_ * rate_);
  up_ = (up_ + dt * rate_).normalized();
  rate_ -= rate_.dot(up_) * up_;

  const Vector3 normal = q_base_glass.conjugate() * up_;  // glass frame
  state_.tilt_x = std::atan2(-normal.y(), normal.z());
  state_.tilt_y = std::atan2(normal.x(), normal.z());
  const double slope = normal.head<2>().norm() / std::max(normal.z(), 1e-3);
  state_.freeboard = glass_.height - glass_.fill - glass_.radius * slope;
  state_.spilled = state_.spilled || state_.freeboard < 0.0;
}

}  // namespace steadyhand

#include <algorithm>
#include <cmath>

#include "steadyhand/planning/predict/predictor.hpp"

namespace steadyhand {

namespace {

// Fitted on half of the hands of bench/carrying.py, validated on the other half.
constexpr double kNoise = 0.002;             // m, of the measurements
constexpr double kAcceleration = 6.0;        // m/s^2, RMS
constexpr double kCorrelated = 0.4;          // s, decay time of accelerations
constexpr double kVelocityStays = 0.4;       // s, decay time of a hand's velocity
constexpr double kAccelerationStays = 0.05;  // s, of its acceleration
constexpr double kFirstVelocity = 0.3;       // m/s
constexpr double kFirstAcceleration = 3.0;   // m/s^2

/// Standard deviation of a prediction t s ahead: at first `noise`, then (rest + speed |v| + change |a|) t^growth.
struct SpreadLaw {
  double noise, rest, speed, change, growth;

  double at(double t, double velocity, double acceleration) const {
    return std::hypot(noise, (rest + speed * velocity + change * acceleration) * std::pow(std::max(0.0, t), growth));
  }
};
// Fitted on the training hands of bench/carrying.py at the scale of the tool, so that the shares inside 1 and 2 of them
// are those of a normal distribution; docs/reference/profiles.md has the shares on the others.
constexpr SpreadLaw kAlong{0.135e-3, 0.0109, 0.306, 0.0756, 1.51}, kAcross{0.135e-3, 0.0083, 0.0868, 0.0640, 1.526};

}  // namespace

Vector3 rotation_vector(const Quaternion& q) {
  const Vector3 v = q.w() < 0.0 ? Vector3(-q.vec()) : Vector3(q.vec());
  const double sine = v.norm();
  if (sine < 1e-12) return 2.0 * v;
  return (2.0 * std::atan2(sine, std::abs(q.w())) / sine) * v;
}

Quaternion rotation(const Vector3& vector) {
  const double angle = vector.norm();
  if (angle < 1e-12) return Quaternion(1.0, 0.5 * vector.x(), 0.5 * vector.y(), 0.5 * vector.z()).normalized();
  return Quaternion(Eigen::AngleAxisd(angle, vector / angle));
}

void MotionFilter::start(const Pose& pose) {
  *this = MotionFilter();
  pose_ = pose;
  covariance_.diagonal() << 1.0, kFirstVelocity * kFirstVelocity / (kNoise * kNoise),
      kFirstAcceleration * kFirstAcceleration / (kNoise * kNoise);
}

void MotionFilter::update(const Pose& pose, double elapsed) {
  const double t = std::max(0.0, elapsed), left = std::exp(-t / kCorrelated);
  Matrix3 F;
  F << 1.0, t, kCorrelated * (t - kCorrelated * (1.0 - left)), 0.0, 1.0, kCorrelated * (1.0 - left), 0.0, 0.0, left;
  const double density = 2.0 * kAcceleration * kAcceleration / kCorrelated / (kNoise * kNoise);
  const double t2 = t * t, t3 = t2 * t;
  Matrix3 Q;  // of accelerations that wander
  Q << t2 * t3 / 20.0, t2 * t2 / 8.0, t3 / 6.0, t2 * t2 / 8.0, t3 / 3.0, t2 / 2.0, t3 / 6.0, t2 / 2.0, t;
  covariance_ = (F * covariance_ * F.transpose() + density * Q).eval();
  const Vector3 gain = covariance_.col(0) / (covariance_(0, 0) + 1.0);
  covariance_ -= (gain * covariance_.row(0)).eval();

  pose_.p += F(0, 1) * velocity_ + F(0, 2) * acceleration_;
  velocity_ += F(1, 2) * acceleration_;
  acceleration_ *= left;
  const Vector3 off = pose.p - pose_.p;
  pose_.p += gain[0] * off;
  velocity_ += gain[1] * off;
  acceleration_ += gain[2] * off;

  pose_.q = rotation(F(0, 1) * angular_velocity_ + F(0, 2) * angular_acceleration_) * pose_.q;
  angular_velocity_ += F(1, 2) * angular_acceleration_;
  angular_acceleration_ *= left;
  const Vector3 turned = rotation_vector(pose.q * pose_.q.conjugate());
  pose_.q = (rotation(gain[0] * turned) * pose_.q).normalized();
  angular_velocity_ += gain[1] * turned;
  angular_acceleration_ += gain[2] * turned;
}

Spread MotionFilter::spread(double t) const {
  const double v = velocity_.norm(), a = acceleration_.norm();
  return {kAlong.at(t, v, a), kAcross.at(t, v, a)};
}

Pose MotionFilter::ahead(double t) const {
  const auto reached = [](double time, double stays) { return stays * (1.0 - std::exp(-time / stays)); };
  const double by_velocity = t < 0.0 ? t : reached(t, kVelocityStays);
  const double by_acceleration = t < 0.0 ? 0.0 : kAccelerationStays * (t - reached(t, kAccelerationStays));
  return {pose_.p + by_velocity * velocity_ + by_acceleration * acceleration_,
          rotation(by_velocity * angular_velocity_ + by_acceleration * angular_acceleration_) * pose_.q};
}

}  // namespace steadyhand

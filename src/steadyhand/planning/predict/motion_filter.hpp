#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// A Kalman filter of a pose with its velocity and acceleration: the Singer model, in which accelerations come at
/// random and decay. Stamps may be uneven: what comes after a stall counts for as much as it then tells. Positions and
/// turns have the same ratio of noise to acceleration, and so the same gains. Allocates nothing.
class MotionFilter {
 public:
  /// At rest here.
  void start(const Pose& pose);
  /// What was measured, and how long after the last, s (0 or more).
  void update(const Pose& pose, double elapsed);

  /// Where it will be, s after the last measurement: velocity and acceleration decay, as hands come to rest.
  Pose ahead(double t) const;
  /// How far off ahead(t).p may be. It grows with the time, and with how fast the hand is and how fast that changes.
  Spread spread(double t) const;
  const Vector3& velocity() const { return velocity_; }                  ///< m/s
  const Vector3& angular_velocity() const { return angular_velocity_; }  ///< rad/s, in the frame of the pose

 private:
  Matrix3 covariance_ = Matrix3::Identity();  ///< of position, velocity, acceleration over the noise's variance
  Pose pose_;
  Vector3 velocity_ = Vector3::Zero(), acceleration_ = Vector3::Zero();
  Vector3 angular_velocity_ = Vector3::Zero(), angular_acceleration_ = Vector3::Zero();
};

/// Rotation vector of a rotation by at most half a turn, rad.
Vector3 rotation_vector(const Quaternion& q);
/// Inverse of rotation_vector.
Quaternion rotation(const Vector3& vector);

}  // namespace steadyhand

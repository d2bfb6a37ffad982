#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// How the motion of a hand is predicted.
enum class Prediction {
  kConstantVelocity,  ///< along a straight line, as in the paper
  kDecaying           ///< with velocity and acceleration of a Kalman filter, which decay: MotionFilter
};
/// Its name in profiles.
std::string_view to_string(Prediction prediction);
/// Absent if the name is unknown.
std::optional<Prediction> prediction_of(std::string_view name);

/// A Kalman filter of a pose with its velocity and acceleration: the Singer model, in which accelerations come at
/// random and decay. Stamps may be uneven: a sample after a stall gets the weight that fits the gap. Positions and
/// rotations have the same ratio of noise to acceleration, and so the same gains. Allocates nothing.
class MotionFilter {
 public:
  /// Starts at rest at this pose.
  void start(const Pose& pose);
  /// A measurement, and the time since the last one, s (0 or more).
  void update(const Pose& pose, double elapsed);

  /// Predicted pose, s after the last measurement: velocity and acceleration decay, because hands stop.
  Pose ahead(double t) const;
  /// Uncertainty of ahead(t).p. It grows with the time and with the hand's speed and acceleration.
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

/// Horizon and model of the prediction. complete() sets horizon, dt and reach from the problem and the arm.
struct PredictorSettings {
  int horizon = 8;                                   ///< N, nodes of the reference; at most kMaxHorizon
  double dt = 0.05;                                  ///< s between them
  Prediction model = Prediction::kConstantVelocity;  ///< prediction of the hand
  /// s, of targets from which velocities are estimated; longer is smoother and later. On recorded hands at 90 Hz the
  /// position 0.1 s ahead is off by 20 mm RMS with 0.10 s, 17 mm with 0.06 s and 15 mm with 0.03 s.
  double window = 0.06;
  double max_gap =
      0.25;  ///< s without targets after which the hand counts as lost: it is at rest, and starts again from rest
  Vector3 reach_center = Vector3::Zero();  ///< m, base frame
  double reach = 1e9;                      ///< m, about reach_center: positions beyond are clipped to it
};

/// Prediction of the hand, clipped to the arm's reach: from the newest target on constant velocity along a straight
/// line and constant angular velocity, or by MotionFilter. Constant velocities are slopes of weighted
/// least-squares lines through the targets of the last `window` seconds, at their own time stamps, so that noise and
/// uneven stamps do little; the weight falls linearly from 1 at the newest target to 0 at the window's far end, so that
/// the velocity lags little. A window that holds fewer than three targets grows to hold three. After engaging the
/// velocity stays 0 until the targets span a third of `window`: the slope between two noisy targets a millisecond apart
/// says nothing. Allocates nothing.
class Predictor {
 public:
  /// From now on; any time, as the next.
  void set_model(Prediction model) { settings_.model = model; }
  /// Nodes of the reference, at most kMaxHorizon, and s between them.
  void set_horizon(int horizon, double dt) {
    settings_.horizon = horizon;
    settings_.dt = dt;
  }
  /// Has no target yet.
  explicit Predictor(const PredictorSettings& settings) : settings_(settings) {}

  /// Adds the next target. Drops a target that is not finite, or not newer than the last, unless it is older by more
  /// than max_gap (the clock was set back). A disengaged target clears the motion.
  void update(const Target& target);
  /// Has no target again.
  void forget() { count_ = 0; }
  /// Predicted target at time t; not clipped. Before any target: the identity.
  Pose at(Time t) const;
  /// Uncertainty of at(t).p; not known for constant velocities and before any target.
  Spread spread(Time t) const;
  /// Nodes 1..N at start + k * dt. Before any target: nodes = 0. If the newest target is older than max_gap at the
  /// start: at rest where the hand was seen last.
  Reference predict(Time start) const;

  const Target& newest() const { return newest_; }  ///< the last target that was not dropped
  Vector3 velocity() const;                         ///< m/s, base frame
  Vector3 angular_velocity() const;                 ///< rad/s, base frame

 private:
  void estimate();

  static constexpr int kCapacity = 64;
  PredictorSettings settings_;
  std::array<Target, kCapacity> history_;  ///< ring, newest at head_
  int head_ = 0, count_ = 0;
  Target newest_;
  Vector3 velocity_ = Vector3::Zero(), angular_velocity_ = Vector3::Zero();
  MotionFilter filter_;
};

}  // namespace steadyhand

#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace steadyhand {

/// Largest arm that the fixed-size types below hold.
inline constexpr int kMaxJoints = 8;
/// Longest horizon, in intervals.
inline constexpr int kMaxHorizon = 128;

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
/// Orientation as a unit quaternion; files and messages store it in the order x, y, z, w.
using Quaternion = Eigen::Quaterniond;

/// One value per joint (n <= kMaxJoints); lives on the stack, never allocates.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;
/// State x = [q; dq], size 2n.
using StateVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 2 * kMaxJoints, 1>;
/// One column per joint, 3 x n.
using JointMatrix3 = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxJoints>;

/// Position and orientation of one frame in another; a variable's name says which: X_base_tool maps tool coordinates to
/// base.
struct Pose {
  Vector3 p = Vector3::Zero();            ///< m
  Quaternion q = Quaternion::Identity();  ///< unit

  Vector3 operator*(const Vector3& point) const { return p + q * point; }
  Pose operator*(const Pose& other) const { return {p + q * other.p, (q * other.q).normalized()}; }
  Pose inverse() const { return {q.conjugate() * -p, q.conjugate()}; }
};

/// Standard gravity as the formulation writes it, m/s^2: the acceleration that a glass at rest feels, base frame, z up.
inline const Vector3 kGravity{0.0, 0.0, 9.81};

}  // namespace steadyhand

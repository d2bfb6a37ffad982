#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>

namespace steadyhand {

// These types must have the layout of the compiled library, also in code that is compiled for another processor.
static_assert(EIGEN_MAX_ALIGN_BYTES == 16, "define EIGEN_MAX_ALIGN_BYTES=16, as CMake's steadyhand::planning does");
#if EIGEN_ARCH_i386_OR_x86_64 || EIGEN_ARCH_ARM_OR_ARM64  // elsewhere Eigen aligns no members
static_assert(EIGEN_MAX_STATIC_ALIGN_BYTES == 16, "EIGEN_DONT_VECTORIZE or EIGEN_DONT_ALIGN_STATICALLY moves members");
#endif
static_assert(EIGEN_DEFAULT_MATRIX_STORAGE_ORDER_OPTION == Eigen::ColMajor,
              "EIGEN_DEFAULT_TO_ROW_MAJOR turns matrices");
static_assert(sizeof(Eigen::Index) == sizeof(std::ptrdiff_t), "EIGEN_DEFAULT_DENSE_INDEX_TYPE moves members");

/// Most joints of one robot, all of its arms together.
inline constexpr int kMaxJoints = 16;
/// Most arms of one robot, each with a tool.
inline constexpr int kMaxTools = 2;
/// Most entries of z = [q; dq; u; states of the liquids] at a node.
inline constexpr int kMaxEntries = 3 * kMaxJoints + 15 * kMaxTools;
/// Longest horizon, in intervals.
inline constexpr int kMaxHorizon = 128;
/// Most objectives of one problem.
inline constexpr int kMaxObjectives = 16;

/// Most bodies of one arm.
inline constexpr int kMaxBodies = 128;
/// Most pairs of a body and an obstacle that one problem sees.
inline constexpr int kMaxObstacleRows = 64;
inline constexpr double kMostClearance = 0.02;  ///< m, see OcpInstance::clearance
inline constexpr int kUsualObstacleRows = 24;   ///< see OcpSettings::obstacle_rows

/// Terms are computed in `double` or `Lanes`, see core/lanes.hpp.
template <typename Scalar>
using Vector3Of = Eigen::Matrix<Scalar, 3, 1>;
/// 3 x 3, likewise.
template <typename Scalar>
using Matrix3Of = Eigen::Matrix<Scalar, 3, 3>;
/// One value per joint, likewise.
template <typename Scalar>
using JointVectorOf = Eigen::Matrix<Scalar, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;

using Vector3 = Vector3Of<double>;  ///< 3
using Matrix3 = Matrix3Of<double>;  ///< 3 x 3
/// Orientation as a unit quaternion; files and messages store it in the order x, y, z, w.
using Quaternion = Eigen::Quaterniond;

/// One value per joint (n <= kMaxJoints); lives on the stack, never allocates.
using JointVector = JointVectorOf<double>;
/// State x = [q; dq], size 2n.
using StateVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 2 * kMaxJoints, 1>;

/// Position and orientation of one frame in another; a variable's name says which: X_base_tool maps tool coordinates to
/// base.
struct Pose {
  Vector3 p = Vector3::Zero();            ///< m
  Quaternion q = Quaternion::Identity();  ///< unit

  /// A point of the one frame in the other, m.
  Vector3 operator*(const Vector3& point) const { return p + q * point; }
  /// X_a_b * X_b_c = X_a_c.
  Pose operator*(const Pose& other) const { return {p + q * other.p, (q * other.q).normalized()}; }
  Pose inverse() const { return {q.conjugate() * -p, q.conjugate()}; }  ///< X_a_b to X_b_a
};

/// Standard gravity as the formulation writes it, m/s^2: the specific force on a glass at rest, base frame, z up.
inline const Vector3 kGravity{0.0, 0.0, 9.81};

}  // namespace steadyhand

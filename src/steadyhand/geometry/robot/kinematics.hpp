#pragma once

#include <array>
#include <vector>

#include "steadyhand/core/lanes.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Rigid motion in the tool frame: angular part first. Joint k's unit twist is S_k, the arm's twist V = sum_k S_k dq_k.
template <typename Scalar>
struct TwistOf {
  Vector3Of<Scalar> angular = Vector3Of<Scalar>::Zero();  ///< rad/s
  Vector3Of<Scalar> linear = Vector3Of<Scalar>::Zero();   ///< m/s, of the frame's origin

  /// Twists in the same frame add up.
  friend TwistOf operator+(const TwistOf& a, const TwistOf& b) { return {a.angular + b.angular, a.linear + b.linear}; }
  /// The same.
  friend TwistOf operator-(const TwistOf& a, const TwistOf& b) { return {a.angular - b.angular, a.linear - b.linear}; }
  /// Twist of a motion that is s times as fast.
  friend TwistOf operator*(const Scalar& s, const TwistOf& a) { return {s * a.angular, s * a.linear}; }
  /// Sum over all six components.
  Scalar dot(const TwistOf& b) const { return angular.dot(b.angular) + linear.dot(b.linear); }
};
/// One twist.
using Twist = TwistOf<double>;

/// Second derivatives by z = [q; dq; ddq], 3n x 3n and room for what else a problem has, on the stack. Only the upper
/// triangle (row <= column) is filled.
template <typename Scalar>
using MotionHessianOf =
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxEntries, kMaxEntries>;
/// Of one configuration.
using MotionHessian = MotionHessianOf<double>;

/// Translation and rotation of a joint at q: joint frame at q in joint frame at 0.
Eigen::Isometry3d motion(const Joint& joint, double q);

/// Forward kinematics and derivatives of one configuration (Scalar = double), or of kLanes configurations at once
/// (Lanes). Memory is taken by the constructor; nothing after it allocates. Mutable scratch of one thread, next to the
/// const RobotModel.
template <typename Scalar>
class KinematicsOf {
 public:
  using Vector = Vector3Of<Scalar>;      ///< 3
  using Matrix = Matrix3Of<Scalar>;      ///< 3 x 3
  using Joints = JointVectorOf<Scalar>;  ///< n

  /// The model must outlive it.
  explicit KinematicsOf(const RobotModel& model);

  /// Tool pose and Jacobian, bodies. q: n.
  void set_position(const Joints& q);
  /// Adds velocity and acceleration of the tool: twists and their derivatives. Call set_position(q) before.
  void set_motion(const Joints& dq, const Joints& ddq);

  const RobotModel& model() const { return *model_; }  ///< whose configurations these are
  int dof() const { return dof_; }                     ///< n

  // ---- after set_position
  const Joints& q() const { return q_; }  ///< rad (m)
  const Vector& p() const { return p_; }  ///< m, tool in the base
  const Matrix& R() const { return R_; }  ///< tool to base
  /// Angular velocity of everything behind joint k for dq_k = 1, base frame (0 for a prismatic joint).
  const Vector& axis(int k) const { return axes_[k]; }
  /// dp/dq_k, m/rad (m/m), base frame.
  const Vector& dp(int k) const { return dp_[k]; }
  /// d2p / dq_i dq_j; symmetric.
  Vector d2p(int i, int j) const { return i <= j ? axes_[i].cross(dp_[j]) : axes_[j].cross(dp_[i]); }

  const PlacedOf<Scalar>& body(int i) const { return placed_[i]; }  ///< where body i is in the base
  /// Derivative of a point that is fixed to a link behind joint k with respect to q_k; `point` in the base.
  Vector dpoint(int k, const Vector& point) const {
    return model_->joints[k].type == JointType::kRevolute ? Vector(axes_[k].cross(point - origins_[k])) : dp_[k];
  }

  // ---- after set_motion
  /// a_local = R' (p'' + g): what an accelerometer in the tool frame reads, m/s^2.
  const Vector& local_acceleration() const { return y_; }
  const Vector& dy_dq(int k) const { return dy_dq_[k]; }      ///< its derivative with respect to q_k
  const Vector& dy_dv(int k) const { return dy_dv_[k]; }      ///< with respect to dq_k
  const Vector& dy_ddq(int k) const { return S_[k].linear; }  ///< with respect to ddq_k
  /// Adds the second derivatives of weight . a_local to the upper triangle of H. weight: 3, tool frame.
  void add_local_acceleration_hessian(const Vector& weight, MotionHessianOf<Scalar>& H) const;

 private:
  using Twist = TwistOf<Scalar>;

  /// The chain in internal frames whose z is the joint's axis, so that turning a joint mixes two columns.
  struct Link {
    Matrix3 R;  ///< joint frame k in frame k - 1, at q = 0
    Vector3 p;
    bool turns;
  };
  /// A body in our frame of its link.
  struct LinkBody {
    int body, link;
    ShapeKind kind;
    Vector3 p;
    Matrix3 R;
  };

  const RobotModel* model_;
  int dof_;
  std::vector<LinkBody> link_bodies_;  ///< sorted by link
  Matrix3 tool_R_;                     ///< tool in our last frame
  Vector3 tool_p_;
  std::vector<Link> links_;

  Joints q_;
  Vector p_;
  Matrix R_;
  std::array<Vector, kMaxJoints> axes_, origins_, dp_;
  std::vector<PlacedOf<Scalar>> placed_;

  std::array<Twist, kMaxJoints> S_;      ///< unit twists of the joints, tool frame
  std::array<Twist, kMaxJoints + 1> V_;  ///< V_[k]: twist from the first k joints
  std::array<Twist, kMaxJoints> B_, C_;  ///< see kinematics.cpp
  std::array<Vector, kMaxJoints> dy_dq_, dy_dv_;
  Vector y_;
};

extern template class KinematicsOf<double>;
extern template class KinematicsOf<Lanes>;
/// Of one configuration.
using Kinematics = KinematicsOf<double>;

}  // namespace steadyhand

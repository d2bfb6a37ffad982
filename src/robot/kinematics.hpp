#pragma once

#include <array>
#include <vector>

#include "robot/model.hpp"

namespace steadyhand {

/// Rigid motion in the tool frame: angular part first. Joint k's unit twist is X_k, the arm's twist V = sum_k X_k dq_k.
struct Twist {
  Vector3 angular = Vector3::Zero();
  Vector3 linear = Vector3::Zero();

  Twist& operator+=(const Twist& b) {
    angular += b.angular;
    linear += b.linear;
    return *this;
  }
  friend Twist operator+(Twist a, const Twist& b) { return a += b; }
  friend Twist operator-(const Twist& a, const Twist& b) { return {a.angular - b.angular, a.linear - b.linear}; }
  friend Twist operator*(double s, const Twist& a) { return {s * a.angular, s * a.linear}; }
};

/// Second derivatives by z = [q; dq; ddq], 3n x 3n, on the stack.
using MotionHessian =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 3 * kMaxJoints, 3 * kMaxJoints>;

/// Translation and rotation of a joint at q: joint frame at q in joint frame at 0.
Eigen::Isometry3d motion(const Joint& joint, double q);

/// Lie bracket of se(3). It differentiates the unit twists: dX_j / dq_k = bracket(X_j, X_k) for k > j, else 0.
Twist bracket(const Twist& a, const Twist& b);

/// Forward kinematics and derivatives of one configuration. Memory is taken by the constructor; nothing after it
/// allocates. Mutable scratch of one thread, beside the const RobotModel.
class Kinematics {
 public:
  explicit Kinematics(const RobotModel& model);

  /// Link poses, tool pose and Jacobian, spheres. q: n.
  void set_position(const JointVector& q);
  /// Adds velocity and acceleration of the tool: twists and their derivatives. Call set_position(q) before.
  void set_motion(const JointVector& dq, const JointVector& ddq);

  const RobotModel& model() const { return *model_; }
  int dof() const { return dof_; }

  // ---- after set_position
  // --------------------------------------------------------------------------------------------------
  const JointVector& q() const { return q_; }
  /// Pose of link k in the base, k = 0..n.
  const Eigen::Isometry3d& link(int k) const { return links_[k]; }
  const Vector3& p() const { return p_; }  ///< m, tool in the base
  const Matrix3& R() const { return R_; }  ///< tool to base
  /// Angular velocity of everything behind joint k for dq_k = 1, base frame (0 for a prismatic joint).
  const Vector3& axis(int k) const { return axes_[k]; }
  /// dp/dq_k, m/rad (m/m), base frame.
  const Vector3& dp(int k) const { return dp_[k]; }
  /// d2p / dq_i dq_j; symmetric.
  Vector3 ddp(int i, int j) const { return i <= j ? axes_[i].cross(dp_[j]) : axes_[j].cross(dp_[i]); }

  const Vector3& sphere(int i) const { return spheres_[i]; }  ///< m, centre of sphere i in the base
  /// Derivative of a point that is fixed to a link behind joint k with respect to q_k; `point` in the base.
  Vector3 dpoint(int k, const Vector3& point) const {
    return model_->joints[k].type == JointType::kRevolute ? axes_[k].cross(point - origins_[k]) : slides_[k];
  }
  /// ||c_i - c_j||^2 of a pair, m^2.
  double squared_distance(const SpherePair& pair) const {
    return (sphere(pair.first) - sphere(pair.second)).squaredNorm();
  }
  /// Smallest gap between the surfaces of the model's pairs, m; negative when two overlap; infinity without pairs.
  double clearance() const;

  // ---- after set_motion
  // ----------------------------------------------------------------------------------------------------
  /// a_local = R' (p'' + g): what an accelerometer in the tool frame reads, m/s^2.
  const Vector3& local_acceleration() const { return y_; }
  /// Its derivatives by joint k: with respect to q_k, dq_k and ddq_k.
  Vector3 dy_dq(int k) const;
  Vector3 dy_ddq(int k) const;  ///< by the joint's acceleration
  Vector3 dy_dv(int k) const;   ///< by the joint's velocity
  /// Adds the second derivatives of weight . a_local to H. weight: 3, tool frame.
  void add_local_acceleration_hessian(const Vector3& weight, MotionHessian& H) const;

 private:
  const RobotModel* model_;
  int dof_;
  JointVector q_;
  std::array<Eigen::Isometry3d, kMaxJoints + 1> links_;
  Vector3 p_;
  Matrix3 R_;
  std::array<Vector3, kMaxJoints> axes_, origins_, slides_, dp_;
  std::vector<Vector3> spheres_;

  std::array<Twist, kMaxJoints> X_;      ///< unit twists of the joints, tool frame
  std::array<Twist, kMaxJoints + 1> V_;  ///< V_[k]: twist from the first k joints
  std::array<Twist, kMaxJoints + 1> A_;  ///< A_[k]: its rate, from the first k joints, plus gravity
  std::array<Twist, kMaxJoints> B_;      ///< dV/dq_k = [V_[k], X_k]
  std::array<Twist, kMaxJoints> dA_dq_, dA_dv_;
  Vector3 y_;
};

}  // namespace steadyhand

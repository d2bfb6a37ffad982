#pragma once

#include <array>
#include <type_traits>
#include <vector>

#include "steadyhand/core/lanes.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// Rigid motion in a tool's frame: angular part first. Joint k's unit twist is S_k, the tool's twist V = sum_k S_k
/// dq_k.
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

/// Second derivatives of kLanes configurations, by columns; too large for the stack, so it allocates when it is made.
class LanesMatrix {
 public:
  /// All 0.
  LanesMatrix(int rows, int columns) : rows_(rows), numbers_(static_cast<std::size_t>(rows) * columns, Lanes(0.0)) {}
  static LanesMatrix Zero(int rows, int columns) { return {rows, columns}; }  ///< as Eigen's

  Lanes& operator()(int i, int j) { return numbers_[i + static_cast<std::size_t>(j) * rows_]; }              ///< entry
  const Lanes& operator()(int i, int j) const { return numbers_[i + static_cast<std::size_t>(j) * rows_]; }  ///< entry
  int rows() const { return rows_; }                                      ///< how many
  int cols() const { return static_cast<int>(numbers_.size()) / rows_; }  ///< the same
  int size() const { return static_cast<int>(numbers_.size()); }          ///< of all entries
  Lanes* data() { return numbers_.data(); }                               ///< all entries

 private:
  int rows_;
  std::vector<Lanes> numbers_;
};

/// Second derivatives by z = [q; dq; ddq], 3n x 3n and room for what else a problem has; of one configuration on the
/// stack. Only the upper triangle (row <= column) is filled.
template <typename Scalar>
using MotionHessianOf = std::conditional_t<
    std::is_same_v<Scalar, Lanes>, LanesMatrix,
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxEntries, kMaxEntries>>;
/// Of one configuration.
using MotionHessian = MotionHessianOf<double>;

/// Translation and rotation of a joint at q: joint frame at q in joint frame at 0.
Eigen::Isometry3d motion(const Joint& joint, double q);

/// Forward kinematics and derivatives of one configuration (Scalar = double), or of kLanes configurations at once
/// (Lanes). Memory is taken by the constructor; nothing after it allocates. Mutable scratch of one thread, next to the
/// const RobotModel. Members that concern a tool take its index, below RobotModel::tool_count(), as the last argument.
template <typename Scalar>
class KinematicsOf {
 public:
  using Vector = Vector3Of<Scalar>;      ///< 3
  using Matrix = Matrix3Of<Scalar>;      ///< 3 x 3
  using Joints = JointVectorOf<Scalar>;  ///< n

  /// The model must outlive it.
  explicit KinematicsOf(const RobotModel& model);

  /// Poses and Jacobians of tools, bodies. q: n.
  void set_position(const Joints& q);
  /// Adds velocity and acceleration of the tools: twists and their derivatives. Call set_position(q) before.
  void set_motion(const Joints& dq, const Joints& ddq);

  const RobotModel& model() const { return *model_; }                 ///< whose configurations these are
  int dof() const { return dof_; }                                    ///< n
  int tool_count() const { return static_cast<int>(tools_.size()); }  ///< how many tools
  /// Joints that move a tool, from the base on: indices increase. Derivatives by others are 0.
  const std::vector<int>& chain(int tool = 0) const { return tools_[tool].chain; }

  // ---- after set_position
  const Joints& q() const { return q_; }                          ///< rad (m)
  const Vector& p(int tool = 0) const { return tools_[tool].p; }  ///< m, tool in the base
  const Matrix& R(int tool = 0) const { return tools_[tool].R; }  ///< tool to base
  /// Angular velocity of everything behind joint k for dq_k = 1, base frame (0 for a prismatic joint).
  const Vector& axis(int k) const { return axes_[k]; }
  /// dp/dq_k, m/rad (m/m), base frame.
  const Vector& dp(int k, int tool = 0) const { return tools_[tool].dp[k]; }
  /// d2p / dq_i dq_j, of joints of the tool's chain; symmetric.
  Vector d2p(int i, int j, int tool = 0) const {
    return i <= j ? axes_[i].cross(dp(j, tool)) : axes_[j].cross(dp(i, tool));
  }

  const PlacedOf<Scalar>& body(int i) const { return placed_[i]; }  ///< where body i is in the base
  /// Derivative of a point that is fixed to a link behind joint k with respect to q_k; `point` in the base.
  Vector dpoint(int k, const Vector& point) const {
    return links_[k].turns ? Vector(axes_[k].cross(point - origins_[k])) : slides_[k];
  }
  /// Origin of joint k's frame at q_k = 0, m, base frame.
  const Vector& origin(int k) const { return origins_[k]; }

  // ---- after set_motion
  /// a_local = R' (p'' + g): what an accelerometer in the tool frame reads, m/s^2.
  const Vector& local_acceleration(int tool = 0) const { return tools_[tool].y; }
  const Vector& dy_dq(int k, int tool = 0) const { return tools_[tool].dy_dq[k]; }      ///< its derivative by q_k
  const Vector& dy_dv(int k, int tool = 0) const { return tools_[tool].dy_dv[k]; }      ///< by dq_k
  const Vector& dy_ddq(int k, int tool = 0) const { return tools_[tool].S[k].linear; }  ///< by ddq_k
  /// Adds the second derivatives of weight . a_local to the upper triangle of H. weight: 3, tool frame.
  void add_local_acceleration_hessian(const Vector& weight, MotionHessianOf<Scalar>& H, int tool = 0) const;

 private:
  using Twist = TwistOf<Scalar>;

  /// A link in internal frames whose z is the axis of the joint before it, so that turning mixes two columns.
  struct Link {
    Matrix3 R;  ///< joint frame k in our frame of the parent, at q = 0
    Vector3 p;
    bool turns;
    int begins_at;  ///< in branches_: the parent's; -1: the parent is the link before
    int branch;     ///< in branches_: where its own is kept for links that begin at it; -1: there are none
  };
  /// Where a link is, from which several begin.
  struct Branch {
    Matrix R;
    Vector p;
  };
  /// A body in our frame of its link.
  struct LinkBody {
    int body, link;
    ShapeKind kind;
    Vector3 p;
    Matrix3 R;
  };
  /// A tool, and its motion as sums over its joints; see kinematics.cpp. By index of the joint.
  struct ToolState {
    int link = 0;
    Matrix3 R_link;  ///< in our frame of the link
    Vector3 p_link;
    std::vector<int> chain;
    Vector p;
    Matrix R;
    std::array<Vector, kMaxJoints> dp;
    std::array<Twist, kMaxJoints> S;  ///< unit twists of the joints, tool frame
    std::array<Twist, kMaxJoints> V;  ///< twist from the joints before
    std::array<Twist, kMaxJoints> B, C;
    std::array<Vector, kMaxJoints> dy_dq, dy_dv;
    Twist twist;  ///< from all joints
    Vector y;
  };

  void set_tool_motion(ToolState& tool, const Joints& dq, const Joints& ddq);

  const RobotModel* model_;
  int dof_;
  std::vector<LinkBody> link_bodies_;  ///< sorted by link
  std::vector<Link> links_;
  std::vector<Branch> branches_;  ///< the first is the base

  Joints q_;
  std::array<Vector, kMaxJoints> axes_, origins_;
  std::array<Vector, kMaxJoints> slides_;  ///< direction of a prismatic joint
  std::vector<PlacedOf<Scalar>> placed_;
  std::vector<ToolState> tools_;
};

extern template class KinematicsOf<double>;
extern template class KinematicsOf<Lanes>;
/// Of one configuration.
using Kinematics = KinematicsOf<double>;

}  // namespace steadyhand

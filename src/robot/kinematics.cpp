#include "robot/kinematics.hpp"

#include <cmath>
#include <limits>

namespace steadyhand {

Twist bracket(const Twist& a, const Twist& b) {
  return {a.angular.cross(b.angular), a.angular.cross(b.linear) + a.linear.cross(b.angular)};
}

Eigen::Isometry3d motion(const Joint& joint, double q) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (joint.type == JointType::kRevolute) {
    T.linear() = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
  } else {
    T.translation() = q * joint.axis;
  }
  return T;
}

Kinematics::Kinematics(const RobotModel& model)
    : model_(&model), dof_(model.dof()), spheres_(model.spheres.size(), Vector3::Zero()) {
  set_position(JointVector::Zero(dof_));
  set_motion(JointVector::Zero(dof_), JointVector::Zero(dof_));
}

void Kinematics::set_position(const JointVector& q) {
  q_ = q;
  links_[0].setIdentity();
  for (int k = 0; k < dof_; ++k) {
    const Joint& joint = model_->joints[k];
    const Eigen::Isometry3d joint_frame = links_[k] * joint.origin;
    const bool turns = joint.type == JointType::kRevolute;
    const Vector3 axis = joint_frame.linear() * joint.axis;
    axes_[k] = turns ? axis : Vector3::Zero();
    slides_[k] = turns ? Vector3::Zero() : axis;
    origins_[k] = joint_frame.translation();
    links_[k + 1] = joint_frame * motion(joint, q[k]);
  }
  const Eigen::Isometry3d tool = links_[dof_] * model_->tool.origin;
  p_ = tool.translation();
  R_ = tool.linear();
  for (int k = 0; k < dof_; ++k) dp_[k] = axes_[k].cross(p_ - origins_[k]) + slides_[k];
  for (std::size_t i = 0; i < spheres_.size(); ++i) {
    spheres_[i] = links_[model_->spheres[i].link] * model_->spheres[i].center;
  }
}

double Kinematics::clearance() const {
  double smallest = std::numeric_limits<double>::infinity();
  for (const SpherePair& pair : model_->pairs) {
    const double radii = model_->spheres[pair.first].radius + model_->spheres[pair.second].radius;
    smallest = std::min(smallest, std::sqrt(squared_distance(pair)) - radii);
  }
  return smallest;
}

// The tool's twist and acceleration in its own frame are sums over the joints (docs/formulation.md derives what
// follows):
//   V_[k]   = sum_{j<k} X_j dq_j,   A_[k] = (0, R'g) + sum_{j<k} ( X_j ddq_j + [V_[j], X_j] dq_j ),
//   a_local = A.linear + V.angular x V.linear   with V = V_[n], A = A_[n].
// Turning joint m moves only what stands before it, so dV_[k]/dq_m = [V_[m], X_m] = B_m for every k > m.

void Kinematics::set_motion(const JointVector& dq, const JointVector& ddq) {
  const Matrix3 to_tool = R_.transpose();
  V_[0] = {};
  A_[0] = {Vector3::Zero(), to_tool * kGravity};
  for (int k = 0; k < dof_; ++k) {
    X_[k] = {to_tool * axes_[k], to_tool * dp_[k]};
    B_[k] = bracket(V_[k], X_[k]);
    V_[k + 1] = V_[k] + dq[k] * X_[k];
    A_[k + 1] = A_[k] + ddq[k] * X_[k] + dq[k] * B_[k];
  }
  const Twist& V = V_[dof_];
  for (int m = 0; m < dof_; ++m) {
    dA_dq_[m] = bracket(A_[m], X_[m]) + bracket(B_[m], V - V_[m]);
    dA_dv_[m] = B_[m] + bracket(X_[m], V - V_[m + 1]);
  }
  y_ = A_[dof_].linear + V.angular.cross(V.linear);
}

namespace {

/// First derivative of a_local = A.linear + V.angular x V.linear when V and A change at rates dV and dA.
Vector3 local_acceleration_rate(const Twist& V, const Twist& dV, const Twist& dA) {
  return dA.linear + dV.angular.cross(V.linear) + V.angular.cross(dV.linear);
}

/// The part of its second derivative that comes from the product of first ones.
Vector3 mixed_rate(const Twist& dV_a, const Twist& dV_b) {
  return dV_a.angular.cross(dV_b.linear) + dV_b.angular.cross(dV_a.linear);
}

void add_symmetric(MotionHessian& H, int row, int column, double value) {
  H(row, column) += value;
  if (row != column) H(column, row) += value;
}

}  // namespace

Vector3 Kinematics::dy_dq(int k) const { return local_acceleration_rate(V_[dof_], B_[k], dA_dq_[k]); }
Vector3 Kinematics::dy_dv(int k) const { return local_acceleration_rate(V_[dof_], X_[k], dA_dv_[k]); }
Vector3 Kinematics::dy_ddq(int k) const { return X_[k].linear; }

void Kinematics::add_local_acceleration_hessian(const Vector3& weight, MotionHessian& H) const {
  const int n = dof_;
  const Twist& V = V_[n];
  const auto second = [&](const Twist& ddV, const Twist& ddA, const Twist& dV_a, const Twist& dV_b) {
    return weight.dot(local_acceleration_rate(V, ddV, ddA) + mixed_rate(dV_a, dV_b));
  };

  for (int l = 0; l < n; ++l) {
    for (int m = 0; m <= l; ++m) {  // q_m, q_l: joint m stands before joint l
      const Twist ddV = bracket(B_[m], X_[l]);
      const Twist dA_l = bracket(A_[m], X_[m]) + bracket(B_[m], V_[l] - V_[m]);  // of A_[l]
      const Twist ddA = bracket(dA_l, X_[l]) + bracket(ddV, V - V_[l]);
      add_symmetric(H, m, l, second(ddV, ddA, B_[m], B_[l]));
    }
    for (int m = 0; m <= l; ++m) {  // q_m, dq_l
      add_symmetric(H, m, n + l, second({}, bracket(B_[m], X_[l]), B_[m], X_[l]));
    }
    for (int m = l + 1; m < n; ++m) {  // q_m, dq_l and q_m, ddq_l: joint l stands before joint m
      const Twist dX_l = bracket(X_[l], X_[m]);
      const Twist ddA = bracket(B_[l] + bracket(X_[l], V_[m] - V_[l + 1]), X_[m]) + bracket(dX_l, V - V_[m]);
      add_symmetric(H, m, n + l, second(dX_l, ddA, B_[m], X_[l]));
      add_symmetric(H, m, 2 * n + l, weight.dot(dX_l.linear));
    }
    for (int m = 0; m < l; ++m) {  // dq_m, dq_l
      add_symmetric(H, n + m, n + l, second({}, bracket(X_[m], X_[l]), X_[m], X_[l]));
    }
    H(n + l, n + l) += weight.dot(mixed_rate(X_[l], X_[l]));
  }
}

}  // namespace steadyhand

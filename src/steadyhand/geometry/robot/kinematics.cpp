#include "steadyhand/geometry/robot/kinematics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "steadyhand/core/turn.hpp"

namespace steadyhand {

Eigen::Isometry3d motion(const Joint& joint, double q) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  if (joint.type == JointType::kRevolute) {
    T.linear() = Eigen::AngleAxisd(q, joint.axis).toRotationMatrix();
  } else {
    T.translation() = q * joint.axis;
  }
  return T;
}

template <typename Scalar>
KinematicsOf<Scalar>::KinematicsOf(const RobotModel& model)
    : model_(&model), dof_(model.dof()), placed_(model.bodies.size(), {Vector::Zero(), Matrix::Identity()}) {
  // From our frame of link k to the model's: our z is the joint's axis.
  std::vector<Matrix3> to_ours{Matrix3::Identity()};
  for (const Joint& joint : model.joints) {
    const Matrix3 turn = turn_between(Vector3::UnitZ(), joint.axis).toRotationMatrix();
    links_.push_back({to_ours.back() * joint.origin.linear() * turn, to_ours.back() * joint.origin.translation(),
                      joint.type == JointType::kRevolute});
    to_ours.push_back(turn.transpose());
  }
  tool_R_ = to_ours.back() * model.tool.origin.linear();
  tool_p_ = to_ours.back() * model.tool.origin.translation();
  for (int i = 0; i < std::ssize(model.bodies); ++i) {
    const Body& body = model.bodies[i];
    const Matrix3& turn = to_ours[body.link];
    link_bodies_.push_back(
        {i, body.link, body.shape.kind, turn * body.origin.translation(), turn * body.origin.linear()});
  }
  std::stable_sort(link_bodies_.begin(), link_bodies_.end(),
                   [](const LinkBody& a, const LinkBody& b) { return a.link < b.link; });
  set_position(Joints::Zero(dof_));
  set_motion(Joints::Zero(dof_), Joints::Zero(dof_));
}

template <typename Scalar>
void KinematicsOf<Scalar>::set_position(const Joints& q) {
  q_ = q;
  Matrix R = Matrix::Identity();
  Vector p = Vector::Zero();
  auto body = link_bodies_.begin();
  const auto place_bodies = [&](int link) {
    for (; body != link_bodies_.end() && body->link == link; ++body) {
      PlacedOf<Scalar>& placed = placed_[body->body];
      placed.p = p + R * body->p;
      if (body->kind == ShapeKind::kCapsule) {
        placed.R.col(2) = R * body->R.col(2);
      } else if (body->kind != ShapeKind::kSphere) {
        placed.R = R * body->R;
      }
    }
  };
  place_bodies(0);
  for (int k = 0; k < dof_; ++k) {
    const Link& link = links_[k];
    p += R * link.p;
    R = (R * link.R).eval();
    origins_[k] = p;
    if (link.turns) {
      Scalar s, c;
      sin_cos(q[k], s, c);
      const Vector x = R.col(0);
      R.col(0) = c * x + s * R.col(1);
      R.col(1) = c * R.col(1) - s * x;
      axes_[k] = R.col(2);
    } else {
      p += q[k] * R.col(2);
      axes_[k] = Vector::Zero();
      dp_[k] = R.col(2);
    }
    place_bodies(k + 1);
  }
  p_ = p + R * tool_p_;
  R_ = R * tool_R_;
  for (int k = 0; k < dof_; ++k) {
    if (links_[k].turns) dp_[k] = axes_[k].cross(p_ - origins_[k]);
  }
}

// docs/explanation/formulation.md derives what follows. The tool's twist and acceleration in its own frame are sums
// over the joints:
//   V_[k]   = sum_{j<k} S_j dq_j,   A_k = (0, R'g) + sum_{j<k} ( S_j ddq_j + B_j dq_j ),   B_k = [V_[k], S_k],
//   a_local = A_n.linear + V.angular x V.linear   with V = V_[n].
// Turning joint m moves only what stands before it, so dV_[k]/dq_m = B_m for every k > m; with C_m = [A_m, S_m] -
// [B_m, V_[m]] the derivatives of A_k, k > m, are C_m + [B_m, V_[k]] by q_m and 2 B_m + [S_m, V_[k]] by dq_m.

namespace {

// Inlined everywhere: they are called dozens of times for each configuration.

/// Lie bracket of se(3). It differentiates the unit twists: dS_j / dq_k = [S_j, S_k] for k > j, else 0.
template <typename Scalar>
[[gnu::always_inline]] inline TwistOf<Scalar> bracket(const TwistOf<Scalar>& a, const TwistOf<Scalar>& b) {
  return {a.angular.cross(b.angular), a.angular.cross(b.linear) + a.linear.cross(b.angular)};
}

/// Its dual: pull(f, a) . b = f . [b, a] for every twist b.
template <typename Scalar>
[[gnu::always_inline]] inline TwistOf<Scalar> pull(const TwistOf<Scalar>& f, const TwistOf<Scalar>& a) {
  return {a.angular.cross(f.angular) + a.linear.cross(f.linear), a.angular.cross(f.linear)};
}

/// mix(w, a) . b = w . (a.angular x b.linear + b.angular x a.linear): the second derivative of w . (V.angular x
/// V.linear).
template <typename Scalar>
[[gnu::always_inline]] inline TwistOf<Scalar> mix(const Vector3Of<Scalar>& w, const TwistOf<Scalar>& a) {
  return {a.linear.cross(w), w.cross(a.angular)};
}

}  // namespace

template <typename Scalar>
void KinematicsOf<Scalar>::set_motion(const Joints& dq, const Joints& ddq) {
  Twist A{Vector::Zero(), kGravity[2] * R_.row(2).transpose()};
  V_[0] = {};
  for (int k = 0; k < dof_; ++k) {
    S_[k] = {R_.transpose() * axes_[k], R_.transpose() * dp_[k]};
    B_[k] = bracket(V_[k], S_[k]);
    C_[k] = bracket(A, S_[k]) - bracket(B_[k], V_[k]);
    V_[k + 1] = V_[k] + dq[k] * S_[k];
    A = A + ddq[k] * S_[k] + dq[k] * B_[k];
  }
  const Twist& V = V_[dof_];
  y_ = A.linear + V.angular.cross(V.linear);
  for (int k = 0; k < dof_; ++k) {
    dy_dq_[k] = C_[k].linear + 2.0 * B_[k].angular.cross(V.linear);
    dy_dv_[k] = 2.0 * (B_[k].linear + S_[k].angular.cross(V.linear));
  }
}

template <typename Scalar>
void KinematicsOf<Scalar>::add_local_acceleration_hessian(const Vector& weight, MotionHessianOf<Scalar>& H) const {
  const int n = dof_;
  const Twist& V = V_[n];
  const Twist of_A{Vector::Zero(), weight};
  for (int l = 0; l < n; ++l) {
    const Twist alpha = pull(of_A, S_[l]), delta = alpha + mix(weight, S_[l]);
    const Twist gamma = mix(weight, V) + pull(of_A, V - V_[l]);
    const Twist beta = pull(alpha, V_[l]) + pull(gamma, S_[l]) + mix(weight, B_[l]);
    for (int m = 0; m <= l; ++m) {
      H(m, l) += alpha.dot(C_[m]) + beta.dot(B_[m]);
      H(m, n + l) += delta.dot(B_[m]);
      H(n + m, n + l) += delta.dot(S_[m]);
    }
    for (int m = 0; m < l; ++m) {
      H(l, n + m) += 2.0 * alpha.dot(B_[m]) + beta.dot(S_[m]);
      H(l, 2 * n + m) += alpha.dot(S_[m]);
    }
  }
}

template class KinematicsOf<double>;
template class KinematicsOf<Lanes>;

}  // namespace steadyhand

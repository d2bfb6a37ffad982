#include "steadyhand/geometry/robot/kinematics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>

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
    : model_(&model),
      dof_(model.dof()),
      branches_{{Matrix::Identity(), Vector::Zero()}},
      placed_(model.bodies.size(), {Vector::Zero(), Matrix::Identity()}) {
  axes_.fill(Vector::Zero());
  // From our frame of link k to the model's: our z is the joint's axis.
  std::vector<Matrix3> to_ours{Matrix3::Identity()};
  for (int k = 0; k < dof_; ++k) {
    const Joint& joint = model.joints[k];
    const int parent = model.parent(k);
    int begins_at = -1;
    if (parent == 0 && k > 0) begins_at = 0;
    if (parent > 0 && parent < k) {
      Link& link = links_[parent - 1];
      if (link.branch < 0) {
        link.branch = static_cast<int>(branches_.size());
        branches_.push_back(branches_.front());
      }
      begins_at = link.branch;
    }
    const Matrix3 turn = turn_between(Vector3::UnitZ(), joint.axis).toRotationMatrix();
    links_.push_back({to_ours[parent] * joint.origin.linear() * turn, to_ours[parent] * joint.origin.translation(),
                      joint.type == JointType::kRevolute, begins_at, -1});
    to_ours.push_back(turn.transpose());
  }
  for (const Tool& tool : model.tools) {
    ToolState& state = tools_.emplace_back();
    state.link = tool.link;
    state.R_link = to_ours[tool.link] * tool.origin.linear();
    state.p_link = to_ours[tool.link] * tool.origin.translation();
    state.chain = model.chain(tool.link);
    for (auto* derivatives : {&state.dp, &state.dy_dq, &state.dy_dv}) derivatives->fill(Vector::Zero());
    state.S.fill({});
  }
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
    if (link.begins_at >= 0) {
      R = branches_[link.begins_at].R;
      p = branches_[link.begins_at].p;
    }
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
      slides_[k] = R.col(2);
      p += q[k] * R.col(2);
    }
    if (link.branch >= 0) branches_[link.branch] = {R, p};
    place_bodies(k + 1);
    for (ToolState& tool : tools_) {
      if (tool.link != k + 1) continue;
      tool.p = p + R * tool.p_link;
      tool.R = R * tool.R_link;
    }
  }
  for (ToolState& tool : tools_) {
    for (const int k : tool.chain) tool.dp[k] = dpoint(k, tool.p);
  }
}

// docs/explanation/formulation.md derives what follows. The tool's twist and acceleration in its own frame are sums
// over the joints of its chain:
//   V_k     = sum_{j<k} S_j dq_j,   A_k = (0, R'g) + sum_{j<k} ( S_j ddq_j + B_j dq_j ),   B_k = [V_k, S_k],
//   a_local = A.linear + V.angular x V.linear   with V and A the sums over all joints.
// Turning joint m moves only what stands before it, so dV_k/dq_m = B_m for every k > m; with C_m = [A_m, S_m] -
// [B_m, V_m] the derivatives of A_k, k > m, are C_m + [B_m, V_k] by q_m and 2 B_m + [S_m, V_k] by dq_m.

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
  for (ToolState& tool : tools_) set_tool_motion(tool, dq, ddq);
}

template <typename Scalar>
void KinematicsOf<Scalar>::set_tool_motion(ToolState& tool, const Joints& dq, const Joints& ddq) {
  const auto& [S, V, B, C] = std::tie(tool.S, tool.V, tool.B, tool.C);
  Twist before{}, A{Vector::Zero(), kGravity[2] * tool.R.row(2).transpose()};
  for (const int k : tool.chain) {
    S[k] = {tool.R.transpose() * axes_[k], tool.R.transpose() * tool.dp[k]};
    V[k] = before;
    B[k] = bracket(V[k], S[k]);
    C[k] = bracket(A, S[k]) - bracket(B[k], V[k]);
    before = V[k] + dq[k] * S[k];
    A = A + ddq[k] * S[k] + dq[k] * B[k];
  }
  tool.twist = before;
  const Twist& all = tool.twist;
  tool.y = A.linear + all.angular.cross(all.linear);
  for (const int k : tool.chain) {
    tool.dy_dq[k] = C[k].linear + 2.0 * B[k].angular.cross(all.linear);
    tool.dy_dv[k] = 2.0 * (B[k].linear + S[k].angular.cross(all.linear));
  }
}

template <typename Scalar>
void KinematicsOf<Scalar>::add_local_acceleration_hessian(const Vector& weight, MotionHessianOf<Scalar>& H,
                                                          int tool) const {
  const int n = dof_;
  const auto& [S, V, B, C] = std::tie(tools_[tool].S, tools_[tool].V, tools_[tool].B, tools_[tool].C);
  const Twist &all = tools_[tool].twist, of_A{Vector::Zero(), weight};
  for (const int l : tools_[tool].chain) {
    const Twist alpha = pull(of_A, S[l]), delta = alpha + mix(weight, S[l]);
    const Twist gamma = mix(weight, all) + pull(of_A, all - V[l]);
    const Twist beta = pull(alpha, V[l]) + pull(gamma, S[l]) + mix(weight, B[l]);
    for (const int m : tools_[tool].chain) {
      if (m > l) break;
      H(m, l) += alpha.dot(C[m]) + beta.dot(B[m]);
      H(m, n + l) += delta.dot(B[m]);
      H(n + m, n + l) += delta.dot(S[m]);
      if (m == l) break;
      H(l, n + m) += 2.0 * alpha.dot(B[m]) + beta.dot(S[m]);
      H(l, 2 * n + m) += alpha.dot(S[m]);
    }
  }
}

template class KinematicsOf<double>;
template class KinematicsOf<Lanes>;

}  // namespace steadyhand

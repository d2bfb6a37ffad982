#pragma once

#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

/// What drives the liquids during one interval (Scalar = double), or during kLanes of them (Lanes): the specific force
/// f at the middle, q + dt/2 dq + dt^2/8 u and dq + dt/2 u, and its derivatives by z = [q; dq; u] of the begin. Scratch
/// of one thread; memory is taken by the constructor.
template <typename Scalar>
class SloshIntervalOf {
 public:
  using Joints = JointVectorOf<Scalar>;
  using Vector = Vector3Of<Scalar>;

  SloshIntervalOf(const RobotModel& model, double dt)
      : arm_(model), half_(0.5 * dt), middle_(3 * model.dof(), 3 * model.dof()) {}

  void set(const Joints& q, const Joints& dq, const Joints& u) {
    arm_.set_position(Joints(q + Scalar(half_) * dq + Scalar(0.5 * half_ * half_) * u));
    arm_.set_motion(Joints(dq + Scalar(half_) * u), u);
  }
  /// m/s^2, tool frame.
  const Vector& force(int tool) const { return arm_.local_acceleration(tool); }

  /// df / d entry i of z
  Vector force_by(int i, int tool) const {
    const int n = arm_.dof(), k = i % n;
    const Scalar h(half_), square(0.5 * half_ * half_);
    if (i < n) return arm_.dy_dq(k, tool);
    if (i < 2 * n) return h * arm_.dy_dq(k, tool) + arm_.dy_dv(k, tool);
    return square * arm_.dy_dq(k, tool) + h * arm_.dy_dv(k, tool) + arm_.dy_ddq(k, tool);
  }

  /// Adds the second derivatives of weight . f to the upper triangle of H.
  void add_hessian(const Vector& weight, MotionHessianOf<Scalar>& H, int tool) const {
    const int n = arm_.dof();
    const Scalar h(half_), s(0.5 * half_ * half_);
    MotionHessianOf<Scalar>& middle = middle_;
    for (int j = 0; j < 3 * n; ++j) {
      for (int i = 0; i <= j; ++i) middle(i, j) = Scalar(0.0);
    }
    arm_.add_local_acceleration_hessian(weight, middle, tool);
    // By q, dq and u of the middle; those of u by u are 0.
    const auto qq = [&](int i, int j) -> const Scalar& { return i <= j ? middle(i, j) : middle(j, i); };
    const auto qv = [&](int i, int j) -> const Scalar& { return middle(i, n + j); };
    const auto qu = [&](int i, int j) -> const Scalar& { return middle(i, 2 * n + j); };
    const auto vv = [&](int i, int j) -> const Scalar& { return i <= j ? middle(n + i, n + j) : middle(n + j, n + i); };
    for (const int j : arm_.chain(tool)) {
      for (const int i : arm_.chain(tool)) {
        const Scalar by_v = h * qq(i, j) + qv(i, j), by_u = s * qq(i, j) + h * qv(i, j) + qu(i, j);
        const Scalar v_by_u = s * qv(j, i) + h * vv(i, j);  // without d2f / dv du, which is 0
        H(i, n + j) += by_v;
        H(i, 2 * n + j) += by_u;
        H(n + i, 2 * n + j) += h * by_u + v_by_u;
        if (i > j) continue;
        H(i, j) += qq(i, j);
        H(n + i, n + j) += h * by_v + h * qv(j, i) + vv(i, j);
        H(2 * n + i, 2 * n + j) += s * by_u + h * v_by_u + s * qu(j, i);
      }
    }
  }

 private:
  KinematicsOf<Scalar> arm_;  ///< at the middle
  double half_;               ///< s, of the interval
  mutable MotionHessianOf<Scalar> middle_;
};

}  // namespace steadyhand

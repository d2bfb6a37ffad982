#include "steadyhand/geometry/robot/kinematics.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"

namespace steadyhand {
namespace {

constexpr double kStep = 1e-5;

/// Central difference of a function of the joint vector along joint k.
template <typename F>
auto difference(F f, JointVector q, int k) {
  const double q_k = q[k];
  q[k] = q_k + kStep;
  const auto plus = f(q).eval();
  q[k] = q_k - kStep;
  const auto minus = f(q).eval();
  return ((plus - minus) / (2.0 * kStep)).eval();
}

class RandomArms : public testing::TestWithParam<int> {};

TEST_P(RandomArms, PositionDerivatives) {
  std::mt19937 random(GetParam());
  const RobotModel model = random_arm(GetParam(), random);
  Kinematics kinematics(model), other(model);
  for (int trial = 0; trial < 200; ++trial) {
    const JointVector q = random_joints(model.dof(), 3.0, random);
    kinematics.set_position(q);
    for (int k = 0; k < model.dof(); ++k) {
      const auto p = [&](const JointVector& at) {
        other.set_position(at);
        return other.p();
      };
      EXPECT_LT((kinematics.dp(k) - difference(p, q, k)).norm(), 1e-8);
      const auto R = [&](const JointVector& at) {
        other.set_position(at);
        return other.R();
      };
      Matrix3 turn;
      for (int c = 0; c < 3; ++c) turn.col(c) = kinematics.axis(k).cross(kinematics.R().col(c));
      EXPECT_LT((turn - difference(R, q, k)).norm(), 1e-8);
      for (int i = 0; i < model.dof(); ++i) {
        const auto dp = [&](const JointVector& at) {
          other.set_position(at);
          return other.dp(i);
        };
        EXPECT_LT((kinematics.d2p(i, k) - difference(dp, q, k)).norm(), 1e-8);
      }
      for (std::size_t s = 0; s < model.bodies.size(); ++s) {
        const auto center = [&](const JointVector& at) {
          other.set_position(at);
          return other.body(s).p;
        };
        const Vector3 expected =
            model.bodies[s].link > k ? kinematics.dpoint(k, kinematics.body(s).p) : Vector3::Zero();
        EXPECT_LT((expected - difference(center, q, k)).norm(), 1e-8);
      }
    }
  }
}

/// p'' from positions alone: the second time derivative along q(t) = q + dq t + ddq t^2 / 2, by a five-point stencil.
TEST_P(RandomArms, LocalAccelerationIsThatOfTheMovingPoint) {
  std::mt19937 random(100 + GetParam());
  const RobotModel model = random_arm(GetParam(), random);
  Kinematics kinematics(model), other(model);
  for (int trial = 0; trial < 500; ++trial) {
    const JointVector q = random_joints(model.dof(), 3.0, random), dq = random_joints(model.dof(), 2.0, random),
                      ddq = random_joints(model.dof(), 5.0, random);
    kinematics.set_position(q);
    kinematics.set_motion(dq, ddq);
    const double h = 2e-3;
    const auto p = [&](double t) -> Vector3 {
      other.set_position(q + t * dq + 0.5 * t * t * ddq);
      return other.p();
    };
    const Vector3 acceleration = (-p(2 * h) + 16 * p(h) - 30 * p(0) + 16 * p(-h) - p(-2 * h)) / (12 * h * h);
    const Vector3 expected = kinematics.R().transpose() * (acceleration + kGravity);
    EXPECT_LT((kinematics.local_acceleration() - expected).norm(), 1e-5 * (1.0 + expected.norm()));
  }
}

TEST_P(RandomArms, LocalAccelerationDerivatives) {
  const int n = GetParam();
  std::mt19937 random(200 + n);
  const RobotModel model = random_arm(n, random);
  Kinematics kinematics(model), other(model);
  for (int trial = 0; trial < 100; ++trial) {
    Eigen::VectorXd z(3 * n);
    z << random_joints(n, 3.0, random), random_joints(n, 2.0, random), random_joints(n, 5.0, random);
    const auto set = [n](Kinematics& k, const Eigen::VectorXd& at) {
      k.set_position(at.head(n));
      k.set_motion(at.segment(n, n), at.tail(n));
    };
    const auto jacobian = [&](const Kinematics& k) {
      Eigen::MatrixXd J(3, 3 * n);
      for (int j = 0; j < n; ++j) {
        J.col(j) = k.dy_dq(j);
        J.col(n + j) = k.dy_dv(j);
        J.col(2 * n + j) = k.dy_ddq(j);
      }
      return J;
    };
    set(kinematics, z);
    const Vector3 weight = Vector3::Random();
    MotionHessian H = MotionHessian::Zero(3 * n, 3 * n);
    kinematics.add_local_acceleration_hessian(weight, H);
    H = MotionHessian(H.selfadjointView<Eigen::Upper>());
    const Eigen::MatrixXd J = jacobian(kinematics);
    const double scale = 1.0 + z.squaredNorm();
    for (int i = 0; i < 3 * n; ++i) {
      Eigen::VectorXd at = z;
      at[i] = z[i] + kStep;
      set(other, at);
      const Vector3 y_plus = other.local_acceleration();
      const Eigen::RowVectorXd g_plus = weight.transpose() * jacobian(other);
      at[i] = z[i] - kStep;
      set(other, at);
      const Eigen::RowVectorXd g_minus = weight.transpose() * jacobian(other);
      EXPECT_LT((J.col(i) - (y_plus - other.local_acceleration()) / (2 * kStep)).norm(), 1e-7 * scale);
      EXPECT_LT((H.row(i) - (g_plus - g_minus) / (2 * kStep)).norm(), 1e-7 * scale) << "row " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Dof, RandomArms, testing::Values(1, 2, 3, 6, 8));

}  // namespace
}  // namespace steadyhand

#include "steadyhand/planning/ocp/slosh.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"

namespace steadyhand {
namespace {

const GlassSettings kFullGlass;
constexpr double kSloshInterval = 0.05, kSmallChange = 1e-5;

SloshModel slosh_model() { return {kFullGlass, kSloshInterval, {0.92, 1.0, 1.08}}; }

SloshStep step_at(const SloshModel& slosh, const Vector3& force, const SloshState& state) {
  SloshStep step;
  slosh.set_step(force, true, step);
  step.differentiate(state);
  return step;
}

/// x'' = w^2 (f - (f_z / g) x) - 2 zeta w x' by Runge and Kutta's steps, for a force that is a function of time.
template <typename Force>
SloshState integrate(SloshState state, const Force& force, double duration) {
  const double zeta = slosh_damping(kFullGlass), w0 = slosh_frequency(kFullGlass);
  const double factors[] = {0.92, 1.0, 1.08};
  const auto rate = [&](const SloshState& s, double t) {
    SloshState result = SloshState::Zero();
    const Vector3 f = force(t);
    for (int mode = 0; mode < kSloshModes; ++mode) {
      const double w = factors[mode] * w0;
      for (int axis = 0; axis < 2; ++axis) {
        const int i = slosh_entry(mode, axis);
        result[i] = w * s[i + 1];
        result[i + 1] = w * (f[axis] - f.z() / kGravity.z() * s[i]) - 2.0 * zeta * w * s[i + 1];
      }
    }
    return result;
  };
  constexpr int kSteps = 400;
  const double h = duration / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double t = i * h;
    const SloshState a = rate(state, t), b = rate(state + 0.5 * h * a, t + 0.5 * h);
    const SloshState c = rate(state + 0.5 * h * b, t + 0.5 * h), d = rate(state + h * c, t + h);
    state += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  return state;
}

TEST(Slosh, DampingIsThatOfWaterInADrinkingGlass) {
  EXPECT_GT(slosh_damping(kFullGlass), 0.005);
  EXPECT_LT(slosh_damping(kFullGlass), 0.0065);
  EXPECT_NEAR(slosh_damping({0.035, 0.1, 0.09, 100e-6}), 10.0 * slosh_damping(kFullGlass), 1e-9);
}

TEST(Slosh, StepIsTheOscillatorsUnderAConstantForce) {
  std::srand(1);
  for (int trial = 0; trial < 100; ++trial) {
    const SloshState state = 3.0 * SloshState::Random();
    Vector3 force = 4.0 * Vector3::Random();
    force.z() = 9.81 * (1.0 + 1.9 * Vector3::Random().x());
    const SloshState expected = integrate(state, [&](double) { return force; }, kSloshInterval);
    const SloshState next = step_at(slosh_model(), force, state).next(state);
    EXPECT_LT((next - expected).head<4 * kSloshModes>().norm(), 1e-5 * (state.norm() + force.norm()));
    EXPECT_EQ(Vector3(next.tail<3>()), force);
  }
}

TEST(Slosh, RestsUnderAConstantForce) {
  const Vector3 force(1.0, -2.0, 12.0);
  const SloshState rest = slosh_model().at_rest(force);
  EXPECT_LT((step_at(slosh_model(), force, rest).next(rest) - rest).norm(), 1e-4);
  const auto [x, y, swing_x, swing_y] = slosh_model().wave<double>(slosh_model().at_rest({1.0, 0.0, 9.81}), 1);
  EXPECT_NEAR(x, kFullGlass.radius / 9.81, 1e-9);  // the surface stands across the specific force
  EXPECT_EQ(y, 0.0);
}

TEST(Slosh, Derivatives) {
  std::srand(2);
  const SloshModel slosh = slosh_model();
  for (int trial = 0; trial < 20; ++trial) {
    const SloshState state = 3.0 * SloshState::Random(), costate = SloshState::Random();
    Vector3 force = 4.0 * Vector3::Random();
    force.z() += 9.81;
    const SloshStep step = step_at(slosh, force, state);
    const auto by_force = [&](const Vector3& f, const SloshState& s) -> Vector3 {
      return step_at(slosh, f, s).by_force.transpose() * costate;
    };
    for (int i = 0; i < 3; ++i) {
      const Vector3 to = force + kSmallChange * Vector3::Unit(i), back = force - kSmallChange * Vector3::Unit(i);
      const SloshState slope = (step_at(slosh, to, state).next(state) - step_at(slosh, back, state).next(state));
      EXPECT_LT((slope / (2.0 * kSmallChange) - step.by_force.col(i)).norm(), 1e-6);
      const Vector3 curvature = (by_force(to, state) - by_force(back, state)) / (2.0 * kSmallChange);
      EXPECT_LT((curvature - step.curvature_by_force(state, costate).col(i)).norm(), 1e-6);
    }
    for (int i = 0; i < kSloshStates; ++i) {
      const SloshState to = state + kSmallChange * SloshState::Unit(i),
                       back = state - kSmallChange * SloshState::Unit(i);
      const double slope = costate.dot(step.next(to) - step.next(back)) / (2.0 * kSmallChange);
      EXPECT_NEAR(slope, step.pull_back(costate)[i], 1e-6);
      const Vector3 curvature = (by_force(force, to) - by_force(force, back)) / (2.0 * kSmallChange);
      EXPECT_LT((curvature - Vector3(0.0, 0.0, step.curvature_by_vertical(costate)[i])).norm(), 1e-6);
    }
  }
}

struct SloshProblem {
  explicit SloshProblem(unsigned seed)
      : random(seed), robot(random_arm(6, random)), ocp(robot, settings()), evaluation(ocp) {
    instance.weights = *ocp.weights({});
    instance.x0 = StateVector::Zero(12);
    instance.reference.nodes = ocp.horizon();
    instance.reference.tools[0].p.fill(Vector3::Zero());
    instance.reference.tools[0].R.fill(Matrix3::Identity());
    instance.liquid[0].model = slosh_model();
    evaluation.set_instance(instance);
  }
  static OcpSettings settings() {
    OcpSettings result;
    result.liquid.emplace();
    return result;
  }

  std::mt19937 random;
  RobotModel robot;
  Ocp ocp;
  OcpInstance instance;
  Evaluation evaluation;
};

/// Of costate . state+ by z = [q; dq; u; state].
TEST(Slosh, DerivativesByTheArmsMotion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SloshProblem problem(seed);
    Evaluation& evaluation = problem.evaluation;
    const int n = 6, size = problem.ocp.entries();
    const SloshState costate = SloshState::Random();
    Eigen::VectorXd z(size);
    z << random_joints(n, 3.0, problem.random), random_joints(n, 2.0, problem.random),
        random_joints(n, 5.0, problem.random), 3.0 * SloshState::Random();
    const auto gradient = [&](const Eigen::VectorXd& at) {
      evaluation.set_node(0, at.head(2 * n), at.segment(2 * n, n));
      evaluation.set_slosh(0, at.tail<kSloshStates>());
      const SloshStep& step = evaluation.slosh_step(0);
      NodeGradient result(size);
      result << step.by_motion.transpose() * (step.by_force.transpose() * costate), step.pull_back(costate);
      return std::pair(costate.dot(step.next(at.tail<kSloshStates>())), result);
    };
    const NodeGradient g = gradient(z).second;
    NodeHessian H = NodeHessian::Zero(size, size);
    evaluation.add_slosh_hessian(0, costate, H);
    H = NodeHessian(H.selfadjointView<Eigen::Upper>());
    for (int i = 0; i < size; ++i) {
      Eigen::VectorXd to = z, back = z;
      to[i] += kSmallChange;
      back[i] -= kSmallChange;
      const auto [value_to, g_to] = gradient(to);
      const auto [value_back, g_back] = gradient(back);
      EXPECT_NEAR(g[i], (value_to - value_back) / (2.0 * kSmallChange), 1e-6 * (1.0 + g.norm())) << i;
      EXPECT_LT((H.col(i) - (g_to - g_back) / (2.0 * kSmallChange)).norm(), 1e-6 * (1.0 + H.norm())) << i;
    }
  }
}

/// The force at an interval's middle represents the whole interval. The error of the wave after a horizon of brisk
/// motion is small compared with the margin.
TEST(Slosh, MiddlesOfIntervalsTellTheWave) {
  double worst = 0.0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    SloshProblem problem(seed);
    Trajectory trajectory(6, 8);
    trajectory.x[0].head(6) = random_joints(6, 2.0, problem.random);
    trajectory.x[0].tail(6) = random_joints(6, 0.3, problem.random);
    problem.instance.x0 = trajectory.x[0];
    JointVector u = random_joints(6, 1.0, problem.random);
    for (int k = 0; k < 8; ++k) {
      u = 0.7 * u + random_joints(6, 0.5, problem.random);
      trajectory.u[k] = u;
      trajectory.x[k + 1] = problem.ocp.next(trajectory.x[k], u);
    }
    Kinematics arm(problem.robot);
    const auto force_in = [&](int k) {
      return [&, k](double s) -> Vector3 {
        const JointVector dq = trajectory.x[k].tail(6) + s * trajectory.u[k];
        arm.set_position(trajectory.x[k].head(6) + s * trajectory.x[k].tail(6) + 0.5 * s * s * trajectory.u[k]);
        arm.set_motion(dq, trajectory.u[k]);
        return arm.local_acceleration();
      };
    };
    SloshState state = slosh_model().at_rest(force_in(0)(0.0));
    problem.instance.liquid[0].state = state;
    problem.evaluation.set_trajectory(trajectory);
    for (int k = 0; k < 8; ++k) {
      state = integrate(state, force_in(k), kSloshInterval);
      state.tail<3>() = problem.evaluation.slosh(k + 1).tail<3>();
      for (int mode = 0; mode < kSloshModes; ++mode) {
        const auto [x, y, swing_x, swing_y] = slosh_model().wave<double>(state, mode);
        const auto near = slosh_model().wave<double>(problem.evaluation.slosh(k + 1), mode);
        worst = std::max(worst, std::hypot(x - near[0], y - near[1]) / (kFullGlass.radius + std::hypot(x, y)));
      }
    }
  }
  EXPECT_LT(worst, 0.05);
  EXPECT_GT(worst, 1e-4);  // or nothing moved
}

}  // namespace
}  // namespace steadyhand

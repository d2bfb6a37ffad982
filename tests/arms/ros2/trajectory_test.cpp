// Trajectories for a joint trajectory controller: it executes them as planned, if it behaves as documented.
#include "steadyhand/arms/ros2/trajectory.hpp"

#include <gtest/gtest.h>

#include <random>

#include "steadyhand/planning/plan/tracker.hpp"
#include "support/ros2/joint_trajectory_controller.hpp"

namespace steadyhand {
namespace {

constexpr int kJoints = 6;
constexpr double kCycle = 0.002;

JointVector random_joints(double largest, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-largest, largest);
  return JointVector::NullaryExpr(kJoints, [&] { return uniform(random); });
}

/// Random accelerations, then as much of the opposite as brings it to rest.
Plan random_plan(const StateVector& from, Time start, int intervals, std::mt19937& random) {
  Plan plan;
  plan.start = start;
  plan.joints = kJoints;
  plan.dt = 0.05;
  plan.intervals = intervals + 4;
  plan.x[0] = from;
  for (int k = 0; k < plan.intervals; ++k) {
    const JointVector dq = plan.x[k].tail(kJoints);
    plan.u[k] = k < intervals ? random_joints(10.0, random) : JointVector(-dq / (plan.dt * (plan.intervals - k)));
    plan.x[k + 1].resize(2 * kJoints);
    plan.x[k + 1] << plan.x[k].head(kJoints) + plan.dt * dq + 0.5 * plan.dt * plan.dt * plan.u[k],
        dq + plan.dt * plan.u[k];
  }
  return plan;
}

JointTrajectory message(const std::vector<JointCommand>& points, Time stamp) {
  JointTrajectory t;
  t.stamp = stamp;
  for (int i = 0; i < kJoints; ++i) t.joints.push_back("joint_" + std::to_string(i));
  for (const JointCommand& p : points) {
    t.points.push_back(
        {p.stamp.made - stamp, {p.q.begin(), p.q.end()}, {p.dq.begin(), p.dq.end()}, {p.ddq.begin(), p.ddq.end()}});
  }
  return t;
}

class TrajectoryTest : public testing::Test {
 protected:
  std::mt19937 random{5};
  StateVector rest = StateVector::Zero(2 * kJoints);
  std::vector<JointCommand> points;
};

TEST_F(TrajectoryTest, LeadsAlongThePlanToRest) {
  const Plan plan = random_plan(rest, std::chrono::seconds(7), 12, random);
  std::vector<JointCommand> commands;
  for (int i = 0; i < 20; ++i) commands.push_back(sample(plan, plan.start + from_seconds(i * kCycle)));
  make_trajectory(commands, plan, points);
  ASSERT_GT(points.size(), commands.size());
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_GT(points[i].stamp.made, points[i - 1].stamp.made);
  for (const JointCommand& point : points) {
    const JointCommand planned = sample(plan, point.stamp.made);
    EXPECT_LT((point.q - planned.q).norm() + (point.dq - planned.dq).norm(), 1e-12);
  }
  EXPECT_EQ(points.back().dq, JointVector::Zero(kJoints));  // exactly: controllers compare with zero
  EXPECT_EQ(points.back().ddq, JointVector::Zero(kJoints));
  EXPECT_GE(points.back().stamp.made, plan.start + from_seconds(plan.intervals * plan.dt));
}

TEST_F(TrajectoryTest, AnArmThatStandsIsToldToStand) {
  const Plan plan = random_plan(rest, Time(0), 0, random);
  const JointCommand command = sample(plan, std::chrono::seconds(3));
  make_trajectory({&command, 1}, plan, points);
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points.back().q, command.q);
}

/// The controller interpolates what it is sent to the plan itself: so accelerations stay what was checked.
TEST_F(TrajectoryTest, AControllerExecutesThePlanItself) {
  for (int repeat = 0; repeat < 20; ++repeat) {
    const Plan plan = random_plan(rest, std::chrono::seconds(7), 12, random);
    const JointCommand first = sample(plan, plan.start);
    make_trajectory({&first, 1}, plan, points);
    JointTrajectory t = message(points, plan.start);
    JointTrajectoryController controller({t.joints});
    controller.activate(first.q);
    ASSERT_EQ(controller.accept(t, plan.start), "");
    double largest = 0.0;
    JointVector before = first.dq;
    for (int i = 0; i * kCycle < plan.intervals * plan.dt; ++i) {
      const Time now = plan.start + from_seconds(i * kCycle);
      (void)controller.update(now, from_seconds(kCycle), first.q, first.dq);
      const auto& desired = controller.reference();
      EXPECT_LT((desired.q - sample(plan, now).q).cwiseAbs().maxCoeff(), 1e-5);
      if (i > 0) largest = std::max(largest, (desired.dq - before).cwiseAbs().maxCoeff() / kCycle);
      before = desired.dq;
    }
    double planned = 0.0;
    for (int k = 0; k < plan.intervals; ++k) planned = std::max(planned, plan.u[k].cwiseAbs().maxCoeff());
    EXPECT_LT(largest, 1.05 * planned);
  }
}

/// One plan after the other, each sent a little late: where the controller changes over there is no step, whether it
/// replaces the old trajectory at once or keeps it until the new one's stamp, and from wherever it interpolates.
TEST_F(TrajectoryTest, OneAfterTheOtherWithoutAStep) {
  for (const bool desired : {false, true}) {
    for (const bool replacement : {false, true}) {
      const Time begin = std::chrono::seconds(50), lead = from_seconds(0.05);
      Plan plan = random_plan(rest, begin, 6, random);
      std::vector<JointCommand> commands;
      JointTrajectory t = message({sample(plan, begin)}, begin);
      JointTrajectoryController controller(
          {t.joints, false, false, desired, replacement});  // the measured position is far off
      const JointVector measured = JointVector::Constant(kJoints, 0.3), still = JointVector::Zero(kJoints);
      controller.activate(rest.head(kJoints));
      double largest = 0.0;
      std::vector<JointVector> past;
      for (int i = 0; i < 1000; ++i) {
        const Time now = begin + from_seconds(i * kCycle);
        if (i % 7 == 6) {  // on from where it is, elsewhere
          const JointCommand here = sample(plan, now);
          StateVector x(2 * kJoints);
          x << here.q, here.dq;
          plan = random_plan(x, now, 6, random);
        }
        commands.push_back(sample(plan, now));
        if (commands.size() > 35) commands.erase(commands.begin());
        if (i % 5 == 0) {
          make_trajectory(commands, plan, points);
          for (JointCommand& point : points) point.stamp.made += lead;
          ASSERT_EQ(controller.accept(message(points, std::min(points.front().stamp.made, now)), now), "");
        }
        (void)controller.update(now, from_seconds(kCycle), i == 0 ? commands.back().q : measured, still);
        past.push_back(controller.reference().q);
        if (i > 60) {
          const JointVector expected = commands[commands.size() - 26].q;  // lead ago
          EXPECT_LT((past.back() - expected).cwiseAbs().maxCoeff(), 1e-5) << i;
          const JointVector change = past[i] - 2.0 * past[i - 1] + past[i - 2];
          largest = std::max(largest, change.cwiseAbs().maxCoeff() / (kCycle * kCycle));
        }
      }
      EXPECT_LT(largest, 40.0);  // the plans have up to 10; their stops need the rest
      EXPECT_GT(largest, 1.0);
    }
  }
}

}  // namespace
}  // namespace steadyhand

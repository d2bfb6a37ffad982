// The reference controller does what the source of joint_trajectory_controller does.
#include "support/ros2/joint_trajectory_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace steadyhand {
namespace {

constexpr Time kStart = std::chrono::seconds(100), kSecond = std::chrono::seconds(1);

/// From rest at (0, 0) to (1, -2) in two seconds; positions alone, with speeds, or with accelerations too.
JointTrajectory trajectory(int derivatives = 2) {
  JointTrajectory t{Time(0), {"a", "b"}, {}};
  for (const double share : {0.0, 0.5, 1.0}) {
    JointTrajectory::Point point{from_seconds(2.0 * share), {share, -2.0 * share}, {}, {}};
    const double speed = share == 0.5 ? 0.75 : 0.0;
    if (derivatives > 0) point.dq = {speed, -2.0 * speed};
    if (derivatives > 1) point.ddq = {0.0, 0.0};
    t.points.push_back(point);
  }
  return t;
}

/// A controller that is active at kStart, cycle by cycle.
class Running {
 public:
  explicit Running(const JointTrajectoryController::Settings& settings, const JointVector& q) : controller(settings) {
    controller.activate(q);
    (void)controller.update(kStart, settings.period, q, JointVector::Zero(q.size()));
  }
  std::string accept(const JointTrajectory& t) { return controller.accept(t, now()); }
  /// Its reference `seconds` after kStart, with the joints measured at q all the time.
  const JointTrajectoryController::State& at(double seconds, const JointVector& q) {
    const Time period = controller.settings().period;
    for (; to_seconds(now() - kStart) + 1e-9 < seconds; ++cycles_) {
      written = controller.update(now() + period, period, q, JointVector::Zero(q.size()));
    }
    return controller.reference();
  }
  /// Sleeps, then makes one cycle.
  void freeze(double seconds, const JointVector& q) {
    const Time period = controller.settings().period;
    const auto slept = static_cast<int>(std::lround(seconds / to_seconds(period)));
    cycles_ += slept;
    written = controller.update(now(), slept * period, q, JointVector::Zero(q.size()));
  }
  Time now() const { return kStart + cycles_ * controller.settings().period; }

  JointTrajectoryController controller;
  JointTrajectoryController::State written;

 private:
  int cycles_ = 0;
};

class ControllerTest : public testing::Test {
 protected:
  JointVector zero = JointVector::Zero(2);
  JointTrajectoryController::Settings settings{{"a", "b"}};
};

TEST_F(ControllerTest, InterpolatesByWhatPointsGive) {
  for (const int derivatives : {0, 1, 2}) {
    Running run(settings, zero);
    ASSERT_EQ(run.accept(trajectory(derivatives)), "");
    const double h = 0.002;  // begins in the next cycle
    JointTrajectoryController::State before = run.at(h, zero), here = run.at(2.0 * h, zero);
    for (double t = 2.0 * h; t < 1.99; t += h) {
      const auto after = run.at(t + h, zero);
      EXPECT_LT(((after.q - before.q) / (2.0 * h) - here.dq).norm(), derivatives == 0 ? 2.0 : 1e-2);
      EXPECT_DOUBLE_EQ(here.q[1], -2.0 * here.q[0]);
      if (std::abs(t - 0.502) < 1e-9) {
        EXPECT_NEAR(here.q[0], derivatives == 0 ? 0.25 : derivatives == 1 ? 0.15625 : 0.13281, 1e-4);
      }
      before = here, here = after;
    }
    EXPECT_NEAR(run.at(5.0, zero).q[0], 1.0, 1e-12);
    EXPECT_EQ(run.at(5.0, zero).dq, zero);
  }
}

TEST_F(ControllerTest, WritesWhatIsToBeACycleFromNow) {
  Running run(settings, zero);
  ASSERT_EQ(run.accept(trajectory()), "");
  (void)run.at(1.0, zero);
  const JointVector written = run.written.q;
  EXPECT_LT((run.at(1.002, zero).q - written).norm(), 1e-12);
  EXPECT_GT((run.written.q - written).norm(), 1e-4);
}

TEST_F(ControllerTest, RefusesWhatItMust) {
  struct Bad {
    const char* word;
    std::function<void(JointTrajectory&)> spoil;
  };
  for (const Bad& bad :
       {Bad{"not at rest", [](auto& t) { t.points.back().dq[0] = 1e-6; }},
        Bad{"1 joints of 2", [](auto& t) { t.joints.pop_back(); }},
        Bad{"not the controller's", [](auto& t) { t.joints[0] = "c"; }},
        Bad{"named twice", [](auto& t) { t.joints[0] = "b"; }}, Bad{"no points", [](auto& t) { t.points.clear(); }},
        Bad{"do not increase", [](auto& t) { t.points[1].from_start = Time(0); }},
        Bad{"lacks positions", [](auto& t) { t.points[1].q.pop_back(); }},
        Bad{"velocities", [](auto& t) { t.points[1].dq.pop_back(); }},
        Bad{"accelerations", [](auto& t) { t.points[1].ddq.push_back(0.0); }},
        Bad{"in the past", [](auto& t) { t.stamp = kStart - 3 * kSecond; }}}) {
    Running run(settings, zero);
    JointTrajectory t = trajectory();
    bad.spoil(t);
    EXPECT_NE(run.accept(t).find(bad.word), std::string::npos) << bad.word;
    EXPECT_EQ(run.at(1.0, zero).q, zero);
  }
}

TEST_F(ControllerTest, InactiveItTakesNothingAndActiveAgainItHolds) {
  Running run(settings, zero);
  ASSERT_EQ(run.accept(trajectory()), "");
  (void)run.at(1.0, zero);
  const JointVector last = run.written.q;
  run.controller.deactivate();
  EXPECT_EQ(run.accept(trajectory()), "inactive");
  (void)run.at(1.5, zero);
  EXPECT_EQ(run.written.q, last);
  const JointVector elsewhere = JointVector::Constant(2, 0.3);
  run.controller.activate(elsewhere);
  (void)run.at(2.0, elsewhere);
  EXPECT_EQ(run.written.q, elsewhere);
}

TEST_F(ControllerTest, TakesMoreWhereParametersAllowIt) {
  settings.allow_nonzero_velocity_at_trajectory_end = settings.allow_partial_joints_goal = true;
  Running run(settings, zero);
  JointTrajectory t = trajectory();
  t.joints = {"b"};
  for (JointTrajectory::Point& point : t.points) {
    for (auto* values : {&point.q, &point.dq, &point.ddq}) values->pop_back();
  }
  t.points.back().dq[0] = 0.5;
  ASSERT_EQ(run.accept(t), "");
  EXPECT_NEAR(run.at(1.002, zero).q[1], 0.5, 1e-12);
  EXPECT_EQ(run.at(1.002, zero).q[0], 0.0);  // stays
}

TEST_F(ControllerTest, ANewOneReplacesTheOldAtOnceOrAtItsStamp) {
  for (const bool replacement : {false, true}) {
    for (const bool desired : {false, true}) {
      settings.allow_trajectory_replacement = replacement;
      settings.interpolate_from_desired_state = desired;
      Running run(settings, zero);
      ASSERT_EQ(run.accept(trajectory()), "");
      const JointVector there = run.at(1.0, zero).q;
      JointTrajectory next = trajectory();
      next.stamp = kStart + 2 * kSecond;
      ASSERT_EQ(run.accept(next), "");
      // At once, and from where it is said to be, unless it is to wait.
      const JointVector begun = run.at(1.002, zero).q;
      EXPECT_LT((begun - (replacement || desired ? there : zero)).norm(), 1e-2) << replacement << desired;
      const bool went_on = run.at(1.9, zero).q[0] > 0.95;  // along the old one, to 1; the new one begins at 0
      EXPECT_EQ(went_on, replacement);
      EXPECT_NEAR(run.at(3.0, zero).q[0], 0.5, 1e-12);
    }
  }
}

/// Below full speed the controller's trajectory time lags, and each new trajectory sets it to now: the arm crawls and
/// jumps.
TEST_F(ControllerTest, ANewOneMakesItForgetThatItWasSlowedDown) {
  Running run(settings, zero), at_full_speed(settings, zero);
  run.controller.scale(0.5);
  JointTrajectory t = trajectory();
  t.stamp = kStart;
  ASSERT_EQ(run.accept(t), "");
  ASSERT_EQ(at_full_speed.accept(t), "");
  EXPECT_NEAR(run.at(1.602, zero).q[0], at_full_speed.at(0.802, zero).q[0], 1e-9);
  ASSERT_EQ(run.accept(t), "");
  EXPECT_NEAR(run.at(1.604, zero).q[0], at_full_speed.at(1.604, zero).q[0], 1e-9);
}

TEST_F(ControllerTest, AfterAFreezeItGoesOnWhereItsTrajectoryIsByThen) {
  Running run(settings, zero);
  ASSERT_EQ(run.accept(trajectory()), "");
  (void)run.at(0.5, zero);
  run.freeze(1.0, zero);
  EXPECT_GT(run.written.q[0], 0.8);
}

/// Beyond a tolerance nothing is written, and it holds where the joints are measured.
TEST_F(ControllerTest, ATolerancesKeepsItFromJumping) {
  for (const bool on_the_way : {true, false}) {
    (on_the_way ? settings.trajectory : settings.goal) = 0.2;
    settings.goal_time = 0.1;
    Running run(settings, zero);
    ASSERT_EQ(run.accept(trajectory()), "");
    const JointVector there = run.at(0.5, zero).q;
    run.freeze(on_the_way ? 1.0 : 2.0, there);
    EXPECT_NE(run.controller.aborted(), "");
    EXPECT_LT((run.written.q - there).norm(), 5e-3);
    (void)run.at(4.0, there);
    EXPECT_EQ(run.written.q, there);
    settings.trajectory = settings.goal = 0.0;
  }
}

TEST_F(ControllerTest, GivesUpWhatIsNotAtTheGoalInTime) {
  settings.goal = 0.1;
  settings.goal_time = 0.5;
  Running run(settings, zero);
  ASSERT_EQ(run.accept(trajectory()), "");
  (void)run.at(2.4, zero);
  EXPECT_EQ(run.controller.aborted(), "");
  (void)run.at(2.6, zero);
  EXPECT_NE(run.controller.aborted(), "");
}

}  // namespace
}  // namespace steadyhand

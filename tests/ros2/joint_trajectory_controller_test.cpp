// The reference controller does what the documentation of joint_trajectory_controller says.
#include "support/ros2/joint_trajectory_controller.hpp"

#include <gtest/gtest.h>

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

class ControllerTest : public testing::Test {
 protected:
  /// What the joints are to do after so many seconds, if they are where they are told.
  const JointTrajectoryController::State& at(JointTrajectoryController& controller, double seconds) {
    const auto& state = controller.update(kStart + from_seconds(seconds), measured, zero);
    return state;
  }
  JointVector zero = JointVector::Zero(2), measured = zero;
  JointTrajectoryController::Settings settings{{"a", "b"}};
};

TEST_F(ControllerTest, InterpolatesByWhatPointsGive) {
  for (const int derivatives : {0, 1, 2}) {
    JointTrajectoryController controller(settings);
    ASSERT_EQ(controller.accept(trajectory(derivatives), kStart), "");
    const double h = 1e-4;
    for (double t = 0.0; t < 2.0; t += 0.1) {
      const auto before = at(controller, t), here = at(controller, t + h), after = at(controller, t + 2.0 * h);
      EXPECT_LT(((after.q - before.q) / (2.0 * h) - here.dq).norm(), derivatives == 0 && t > 0.9 ? 2.0 : 1e-2);
      EXPECT_DOUBLE_EQ(here.q[1], -2.0 * here.q[0]);
    }
    EXPECT_NEAR(at(controller, 1.0).q[0], 0.5, 1e-12);
    EXPECT_NEAR(at(controller, 0.5).q[0], derivatives == 0 ? 0.25 : derivatives == 1 ? 0.15625 : 0.13281, 1e-4);
    EXPECT_NEAR(at(controller, 5.0).q[0], 1.0, 1e-12);
    EXPECT_EQ(at(controller, 5.0).dq, zero);
  }
}

TEST_F(ControllerTest, RefusesWhatItMust) {
  struct Bad {
    const char* word;
    std::function<void(JointTrajectory&)> spoil;
  };
  for (const Bad& bad :
       {Bad{"not at rest", [](auto& t) { t.points.back().dq[0] = 1e-9; }},
        Bad{"1 joints of 2", [](auto& t) { t.joints.pop_back(); }},
        Bad{"not the controller's", [](auto& t) { t.joints[0] = "c"; }},
        Bad{"named twice", [](auto& t) { t.joints[0] = "b"; }}, Bad{"no points", [](auto& t) { t.points.clear(); }},
        Bad{"do not increase", [](auto& t) { t.points[1].from_start = Time(0); }},
        Bad{"lacks positions", [](auto& t) { t.points[1].q.pop_back(); }},
        Bad{"velocities", [](auto& t) { t.points[1].dq.pop_back(); }},
        Bad{"accelerations", [](auto& t) { t.points[1].ddq.push_back(0.0); }},
        Bad{"in the past", [](auto& t) { t.stamp = kStart - 3 * kSecond; }}}) {
    JointTrajectoryController controller(settings);
    JointTrajectory t = trajectory();
    bad.spoil(t);
    EXPECT_NE(controller.accept(t, kStart).find(bad.word), std::string::npos) << bad.word;
    EXPECT_EQ(at(controller, 1.0).q, zero);
  }
}

TEST_F(ControllerTest, TakesMoreWhereParametersAllowIt) {
  settings.allow_nonzero_velocity_at_trajectory_end = settings.allow_partial_joints_goal = true;
  JointTrajectoryController controller(settings);
  JointTrajectory t = trajectory();
  t.joints = {"b"};
  for (JointTrajectory::Point& point : t.points) {
    for (auto* values : {&point.q, &point.dq, &point.ddq}) values->pop_back();
  }
  t.points.back().dq[0] = 0.5;
  ASSERT_EQ(controller.accept(t, kStart), "");
  (void)at(controller, 0.0);
  EXPECT_NEAR(at(controller, 1.0).q[1], 0.5, 1e-12);
  EXPECT_EQ(at(controller, 1.0).q[0], 0.0);  // stays
}

TEST_F(ControllerTest, ANewOneReplacesTheOldAtOnceOrAtItsStamp) {
  for (const bool replacement : {false, true}) {
    for (const bool desired : {false, true}) {
      settings.allow_trajectory_replacement = replacement;
      settings.interpolate_from_desired_state = desired;
      JointTrajectoryController controller(settings);
      ASSERT_EQ(controller.accept(trajectory(), kStart), "");
      (void)at(controller, 0.0);
      const JointVector there = at(controller, 1.0).q;
      JointTrajectory next = trajectory();
      next.stamp = kStart + 2 * kSecond;
      ASSERT_EQ(controller.accept(next, kStart + kSecond), "");
      // At once, and from where it is said to be, unless it is to wait.
      const JointVector begun = at(controller, 1.0).q;
      EXPECT_LT((begun - (replacement || desired ? there : measured)).norm(), 1e-9) << replacement << desired;
      const bool went_on = at(controller, 1.9).q[0] > 0.95;  // along the old one, to 1; the new one begins at 0
      EXPECT_EQ(went_on, replacement);
      EXPECT_NEAR(at(controller, 3.0).q[0], 0.5, 1e-12);
    }
  }
}

TEST_F(ControllerTest, GivesUpBeyondItsTolerances) {
  settings.trajectory = 0.2;
  JointTrajectoryController on_the_way(settings);
  ASSERT_EQ(on_the_way.accept(trajectory(), kStart), "");
  for (double t = 0.0; t < 2.0; t += 0.1) (void)at(on_the_way, t);
  EXPECT_NE(on_the_way.aborted(), "");
  EXPECT_EQ(at(on_the_way, 3.0).q, measured);  // holds where it was measured

  settings.trajectory = 0.0;
  settings.goal = 0.1;
  settings.goal_time = 0.5;
  JointTrajectoryController at_the_end(settings);
  ASSERT_EQ(at_the_end.accept(trajectory(), kStart), "");
  for (double t = 0.0; t < 2.4; t += 0.1) (void)at(at_the_end, t);
  EXPECT_EQ(at_the_end.aborted(), "");
  (void)at(at_the_end, 2.6);
  EXPECT_NE(at_the_end.aborted(), "");
}

}  // namespace
}  // namespace steadyhand

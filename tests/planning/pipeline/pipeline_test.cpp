#include "steadyhand/planning/pipeline/pipeline.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::unique_ptr<Pipeline> make(const std::string& profile = "tracking") {
  auto made = open_pipeline("ur5e", profile);
  if (!made) ADD_FAILURE() << made.error().message;
  return made ? *std::move(made) : nullptr;
}

OperatorSample hand(double t, double x, bool clutch) {
  OperatorSample sample;
  sample.stamp = {from_seconds(t), from_seconds(t)};
  sample.X_operator_hand.p.x() = x;
  sample.clutch = clutch;
  return sample;
}

Pose tool(const RobotModel& model, const JointVector& q) {
  Kinematics arm(model);
  arm.set_position(q);
  return {arm.p(), Quaternion(arm.R())};
}

/// Ten centimetres in a second, sampled at 90 Hz and commanded at 500 Hz from time `from` on; the last command.
JointCommand lead(Pipeline& arm, double from, bool clutch, double seconds = 1.0) {
  JointCommand command;
  double next = from;
  for (int i = 0; i <= static_cast<int>(500 * seconds); ++i) {
    const double now = from + i / 500.0;
    for (; next <= now; next += 1.0 / 90.0) EXPECT_TRUE(arm.feed(hand(next, 0.1 * (next - from), clutch)));
    command = arm.update(from_seconds(now));
  }
  return command;
}

TEST(Pipeline, StandsUntilItIsFedAndWithoutAClutch) {
  const auto arm = make();
  EXPECT_EQ(arm->update(from_seconds(5.0)).q, arm->model().home);
  const JointCommand command = lead(*arm, 6.0, false);
  EXPECT_LT((command.q - arm->model().home).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Pipeline, FollowsTheHandByItsScaleWithinLimits) {
  const auto arm = make();
  const Pose before = tool(arm->model(), arm->model().home);
  const JointCommand command = lead(*arm, 0.0, true);
  const double moved = (tool(arm->model(), command.q).p - before.p).norm();
  EXPECT_NEAR(moved, 0.05, 0.01);  // half of the hand's way
  EXPECT_TRUE((command.dq.cwiseAbs().array() <= arm->model().velocity_max.array()).all());
}

TEST(Pipeline, PlansAtItsRateHoweverOftenItIsAsked) {
  const auto arm = make();
  ASSERT_TRUE(arm->feed(hand(0.0, 0.0, true)));
  int plans = 0;
  Time last{-1};
  for (int i = 0; i < 1000; ++i) {  // 2 s
    arm->update(from_seconds(i / 500.0));
    plans += arm->planner().plan().start != last;
    last = arm->planner().plan().start;
  }
  EXPECT_EQ(plans, 40);
}

TEST(Pipeline, TimesThatGoBackRepeatTheLastCommand) {
  const auto arm = make();
  const JointCommand last = lead(*arm, 10.0, true);
  EXPECT_EQ(arm->update(from_seconds(3.0)).q, last.q);
  EXPECT_EQ(arm->update(Time::min()).q, last.q);
}

TEST(Pipeline, RefusesAHandThatIsNoPoseAndGoesOn) {
  const auto arm = make();
  lead(*arm, 0.0, true);
  OperatorSample bad = hand(1.1, 0.1, true);
  for (int i = 0; i < 3; ++i) {
    bad = hand(1.1, 0.1, true);
    if (i == 0) bad.X_operator_hand.p.y() = kNaN;
    if (i == 1) bad.X_operator_hand.q.coeffs().setConstant(kNaN);
    if (i == 2) bad.X_operator_hand.q.coeffs() *= 2.0;
    const Status refused = arm->feed(bad);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("quaternion of length 1"), std::string::npos);
  }
  EXPECT_TRUE(arm->feed(hand(1.1, 0.1, true)));
  EXPECT_TRUE(arm->update(from_seconds(1.1)).q.allFinite());
}

TEST(Pipeline, AResetArmStandsThereAndIsTakenHoldOfThere) {
  const auto arm = make();
  lead(*arm, 0.0, true);
  JointVector q = arm->model().home;
  q[0] += 0.3;
  ASSERT_TRUE(arm->reset(q, from_seconds(20.0)));
  EXPECT_EQ(arm->update(from_seconds(20.0)).q, q);
  ASSERT_TRUE(arm->feed(hand(20.1, 5.0, true)));  // wherever the hand is now
  EXPECT_LT((arm->update(from_seconds(20.2)).q - q).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Pipeline, RefusesAResetThatCannotBe) {
  const auto arm = make();
  JointVector nan = arm->model().home, far = arm->model().home;
  nan[2] = kNaN;
  far[1] = 100.0;
  for (const JointVector& q : {JointVector(arm->model().home.head(5)), nan, far}) {
    const Status refused = arm->reset(q, Time(0));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("6 numbers inside the arm's limits"), std::string::npos);
  }
}

TEST(Pipeline, RefusesNamesAndNumbersWithTheReason) {
  EXPECT_NE(open_pipeline("ur55", "waiter").error().message.find("ur55"), std::string::npos);
  EXPECT_NE(open_pipeline("ur5e", "water").error().message.find("water"), std::string::npos);
  const RobotModel model = *open_robot("ur5e");
  PipelineSettings settings(*load_profile("waiter"));
  settings.rate_hz = kNaN;
  EXPECT_NE(Pipeline::make(model, settings).error().message.find("rate is nan"), std::string::npos);
  settings.rate_hz = 20.0;
  settings.retarget.scale = 0.0;
  EXPECT_NE(Pipeline::make(model, settings).error().message.find("scale is 0"), std::string::npos);
  settings.retarget.scale = 0.5;
  settings.planner.solver = "magic";
  EXPECT_NE(Pipeline::make(model, settings).error().message.find("magic"), std::string::npos);
}

/// A hand whose quaternion is slightly off is followed, as the message of feed() says, and not silently released.
TEST(Pipeline, AQuaternionThatIsOffByLessThanAThousandthIsFollowed) {
  for (const double length : {0.9991, 0.9996, 1.0004, 1.0009}) {
    const auto arm = make();
    OperatorSample sample = hand(0.0, 0.0, true);
    sample.X_operator_hand.q.coeffs() *= length;
    ASSERT_TRUE(arm->feed(sample)) << length;
    EXPECT_TRUE(arm->target().engaged) << length;
  }
}

TEST(Pipeline, TimesAtWhoseEndNothingCanBeAddedAreRefused) {
  const auto arm = make();
  lead(*arm, 0.0, true);
  for (const Time t : {Time::max(), Time::max() - from_seconds(0.1), Time::min(), from_seconds(9.1e9)}) {
    OperatorSample sample = hand(0.0, 0.0, true);
    sample.stamp = {t, t};
    const Status refused = arm->feed(sample);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("must be within 9e9 s of the epoch"), std::string::npos);
    EXPECT_FALSE(arm->reset(arm->model().home, t));
  }
  OperatorSample sample = hand(1.1, 0.1, true);
  sample.look_ahead = Time::max();
  EXPECT_NE(arm->feed(sample).error().message.find("predicted 9223372037 s ahead"), std::string::npos);
  const JointCommand last = arm->update(Time::max());  // far behind the plan's end
  EXPECT_TRUE(last.q.allFinite());
  EXPECT_EQ(last.dq, JointVector::Zero(6));
}

TEST(Pipeline, ItPlansAtTheLatestTimesAsAtTheFirst) {
  const auto early = make(), late = make();
  const Pose before = tool(early->model(), early->model().home);
  const auto moved = [&](Pipeline& arm, double from) {
    return (tool(arm.model(), lead(arm, from, true).q).p - before.p).norm();
  };
  EXPECT_NEAR(moved(*late, 8.99e9), moved(*early, 0.0), 1e-3);
}

TEST(Pipeline, RefusesNumbersThatNoStageCanUse) {
  const RobotModel model = *open_robot("ur5e");
  const auto expect_refused = [&](const char* why, const auto& change) {
    PipelineSettings settings(*load_profile("waiter"));
    change(settings);
    const auto made = Pipeline::make(model, settings);
    ASSERT_FALSE(made) << why;
    EXPECT_NE(made.error().message.find(why), std::string::npos) << made.error().message;
  };
  for (const double bad : {kNaN, -1.0, std::numeric_limits<double>::infinity()}) {
    expect_refused("rate is ", [=](auto& s) { s.rate_hz = bad; });
    expect_refused("ramp is ", [=](auto& s) { s.retarget.ramp = bad; });
    expect_refused("window of the predictor is ", [=](auto& s) { s.predictor.window = bad; });
    expect_refused("max_gap of the predictor is ", [=](auto& s) { s.predictor.max_gap = bad; });
    expect_refused("velocity_scale is ", [=](auto& s) { s.ocp.velocity_scale = bad; });
    expect_refused("check.tolerance is ", [=](auto& s) { s.planner.check.tolerance = bad; });
  }
  expect_refused("rate is 1e-300 Hz; it must be from 0.001 to 1e4", [](auto& s) { s.rate_hz = 1e-300; });
  expect_refused("window of the predictor is 0 s", [](auto& s) { s.predictor.window = 0.0; });
  expect_refused("dt is 1e+300; it must be above 0, to 10 s", [](auto& s) { s.ocp.dt = 1e300; });
}

TEST(Pipeline, RefusesAModelThatIsNoArm) {
  const PipelineSettings settings(*load_profile("waiter"));
  EXPECT_NE(Pipeline::make(RobotModel(), settings).error().message.find("has 0 joints"), std::string::npos);
  RobotModel model = *open_robot("ur5e");
  model.home[0] = 100.0;
  EXPECT_NE(Pipeline::make(model, settings).error().message.find("home[0] = 100 is outside"), std::string::npos);
}

/// Each hand its own way for a second; the last command.
JointCommand lead_both(Pipeline& arm, bool left, bool right) {
  JointCommand command;
  for (int i = 0; i <= 500; ++i) {
    const double now = i / 500.0;
    if (i % 5 == 0) {
      for (const int tool : {0, 1}) {
        OperatorSample sample = hand(now, (tool == 0 ? 0.1 : -0.1) * now, tool == 0 ? left : right);
        sample.tool = tool;
        EXPECT_TRUE(arm.feed(sample));
      }
    }
    command = arm.update(from_seconds(now));
  }
  return command;
}

Pose tool_of(const RobotModel& model, const JointVector& q, int tool) {
  Kinematics arm(model);
  arm.set_position(q);
  return {arm.p(tool), Quaternion(arm.R(tool))};
}

TEST(PipelineOfTwoTools, EachFollowsItsHand) {
  const auto made = open_pipeline("two_ur5e", "tracking");
  ASSERT_TRUE(made) << made.error().message;
  Pipeline& arm = **made;
  const JointCommand command = lead_both(arm, true, true);
  Vector3 moved[2];
  for (const int t : {0, 1}) {
    const Pose there = tool_of(arm.model(), command.q, t);
    moved[t] = there.p - tool_of(arm.model(), arm.model().home, t).p;
    EXPECT_NEAR(moved[t].norm(), 0.05, 0.01);  // half of the hand's way
    EXPECT_TRUE(arm.target(t).engaged);
    EXPECT_LT((there.p - arm.target(t).X_base_tool.p).norm(), 0.01);
  }
  EXPECT_LT(moved[0].normalized().dot(moved[1].normalized()), -0.9);
}

TEST(PipelineOfTwoTools, AToolWithoutAHandStaysWhereItIs) {
  for (const bool sees_hand : {true, false}) {
    const auto made = open_pipeline("two_ur5e", "tracking");
    ASSERT_TRUE(made);
    Pipeline& arm = **made;
    JointCommand command;
    if (sees_hand) {
      command = lead_both(arm, false, true);
    } else {
      for (int i = 0; i <= 100; ++i) {
        OperatorSample sample = hand(0.01 * i, 0.001 * i, true);
        sample.tool = 1;
        ASSERT_TRUE(arm.feed(sample));
        command = arm.update(from_seconds(0.01 * i));
      }
    }
    const JointVector& home = arm.model().home;
    EXPECT_GT((tool_of(arm.model(), command.q, 1).p - tool_of(arm.model(), home, 1).p).norm(), 0.03);
    EXPECT_LT((command.q - home).head(6).cwiseAbs().maxCoeff(), 1e-4) << sees_hand;
    EXPECT_FALSE(arm.target(0).engaged);
  }
}

TEST(PipelineOfTwoTools, OneHandMovesBothThatHoldOneThing) {
  const auto made = open_pipeline("two_ur5e", "tray");
  ASSERT_TRUE(made) << made.error().message;
  Pipeline& arm = **made;
  const JointVector home = arm.model().home, q = lead_both(arm, true, false).q;
  const auto between = [&](const JointVector& at) {
    return tool_of(arm.model(), at, 0).inverse() * tool_of(arm.model(), at, 1);
  };
  for (const int t : {0, 1}) EXPECT_GT((tool_of(arm.model(), q, t).p - tool_of(arm.model(), home, t).p).norm(), 0.02);
  EXPECT_LT((between(q).p - between(home).p).norm(), 0.01);
}

TEST(PipelineOfTwoTools, RefusesAHandOfAToolThatItLacks) {
  const auto arm = make();
  for (const int tool : {-1, 1}) {
    OperatorSample sample = hand(0.0, 0.0, true);
    sample.tool = tool;
    const Status refused = arm->feed(sample);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("robot 'ur5e' has 1 tool, counted from 0"), std::string::npos);
  }
}

}  // namespace
}  // namespace steadyhand

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {
namespace {

/// Two joints, three random intervals, then one that ends at rest.
Plan make_plan() {
  Plan plan;
  plan.start = from_seconds(2.0);
  plan.joints = 2;
  plan.intervals = 4;
  plan.x[0] = StateVector::Random(4);
  for (int k = 0; k < 4; ++k) {
    const JointVector q = plan.x[k].head(2), dq = plan.x[k].tail(2);
    plan.u[k] = k < 3 ? JointVector(JointVector::Random(2)) : JointVector(-dq / plan.dt);
    plan.x[k + 1].resize(4);
    plan.x[k + 1] << q + plan.dt * dq + 0.5 * plan.dt * plan.dt * plan.u[k], dq + plan.dt * plan.u[k];
  }
  return plan;
}

TEST(SamplePlan, MeetsTheNodesAndIsContinuous) {
  const Plan plan = make_plan();
  for (int k = 0; k <= 4; ++k) {
    for (const std::int64_t offset_ns : {-1, 0, 1}) {
      const JointCommand c = sample(plan, plan.start + from_seconds(k * plan.dt) + Time(offset_ns));
      EXPECT_LT((c.q - plan.x[k].head(2)).norm(), 1e-8);
      EXPECT_LT((c.dq - plan.x[k].tail(2)).norm(), 1e-7);
    }
  }
}

TEST(SamplePlan, StandsStillAfterTheEnd) {
  const Plan plan = make_plan();
  const JointCommand c = sample(plan, plan.start + from_seconds(5.0));
  EXPECT_EQ(c.q, plan.x[4].head(2));
  EXPECT_EQ(c.dq.norm(), 0.0);
  EXPECT_EQ(c.ddq.norm(), 0.0);
}

TEST(SamplePlan, BeforeTheStartIsTheFirstState) {
  const Plan plan = make_plan();
  const JointCommand c = sample(plan, plan.start - from_seconds(1.0));
  EXPECT_EQ(c.q, plan.x[0].head(2));
}

TEST(SamplePlan, TellsAccelerationAndStampOfItsInterval) {
  Plan plan = make_plan();
  plan.stamp = {from_seconds(1.5), from_seconds(1.9)};
  for (int k = 0; k < 4; ++k) {
    const Time t = plan.start + from_seconds((k + 0.5) * plan.dt);
    const JointCommand c = sample(plan, t);
    EXPECT_EQ(c.ddq, plan.u[k]);
    EXPECT_EQ(c.stamp.hand, plan.stamp.hand);
    EXPECT_EQ(c.stamp.made, t);
  }
}

TEST(SamplePlan, CenturiesApartIsBeforeOrAfter) {
  Plan plan = make_plan();
  plan.start = Time::min();
  EXPECT_EQ(sample(plan, Time::max()).q, plan.x[4].head(2));
  plan.start = Time::max();
  EXPECT_EQ(sample(plan, Time::min()).q, plan.x[0].head(2));
}

TEST(Plan, IsCopiedWhole) {
  Plan plan = make_plan(), copy;
  plan.stamp = {from_seconds(1.5), from_seconds(1.9)};
  plan.origin = PlanOrigin::kPrevious;
  stand(JointVector::Ones(3), Time(7), copy);
  copy = plan;
  EXPECT_EQ(copy.stamp.hand, plan.stamp.hand);
  EXPECT_EQ(copy.stamp.made, plan.stamp.made);
  EXPECT_EQ(copy.start, plan.start);
  EXPECT_EQ(copy.dt, plan.dt);
  EXPECT_EQ(copy.joints, 2);
  EXPECT_EQ(copy.intervals, 4);
  EXPECT_EQ(copy.origin, PlanOrigin::kPrevious);
  for (int k = 0; k <= 4; ++k) EXPECT_EQ(copy.x[k], plan.x[k]);
  for (int k = 0; k < 4; ++k) EXPECT_EQ(copy.u[k], plan.u[k]);
}

TEST(Plan, StandsWhateverItWasBefore) {
  Plan plan = make_plan();
  plan.dt = 1e-12;
  plan.origin = PlanOrigin::kPrevious;
  const JointVector q = JointVector::LinSpaced(3, 0.1, 0.3);
  stand(q, from_seconds(4.0), plan);
  EXPECT_EQ(plan.start, from_seconds(4.0));
  EXPECT_EQ(plan.joints, 3);
  EXPECT_EQ(plan.origin, PlanOrigin::kSolved);
  EXPECT_GT(plan.dt, 1e-3);
  for (const double t : {0.0, 4.0, 4.01, 1e6}) {
    EXPECT_EQ(sample(plan, from_seconds(t)).q, q);
    EXPECT_TRUE(sample(plan, from_seconds(t)).dq.isZero(0.0));
  }
}

/// For any plan, with intervals far shorter than a nanosecond too, and any time: no value outside the plan is read, and
/// before and after its span the plan is at rest.
TEST(SamplePlan, IsSafeForEveryPlanAndTime) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double inside = 7.0;  // all values of the plan; those around them are NaN
  for (int i = 0; i < 20000; ++i) {
    Plan plan;
    for (StateVector& x : plan.x) x.setConstant(4, std::nan(""));
    for (JointVector& u : plan.u) u.setConstant(2, std::nan(""));
    plan.joints = 2;
    plan.intervals = static_cast<int>(unit(random) * (Plan::kMaxIntervals + 1));
    plan.dt = std::pow(10.0, -12.0 + 13.0 * unit(random));
    if (i % 100 == 0) plan.dt = 0.0;
    plan.start = Time(static_cast<std::int64_t>(random() >> 2)) * (i % 2 == 0 ? 1 : -1);
    for (int k = 0; k <= plan.intervals; ++k) {
      plan.x[k] << inside, inside, 0.0, 0.0;
      if (k < plan.intervals) plan.u[k].setZero();
    }
    const double span = plan.intervals * plan.dt;
    for (const double offset : {-3e8, -1.0, -1e-9, 0.0, 1e-9, unit(random) * span, span, span + 1e-9, 1e-3, 1.0, 10.0,
                                unit(random) * 1e9, 3.2e9}) {
      const JointCommand c = sample(plan, plan.start + from_seconds(offset));
      ASSERT_EQ(c.q, JointVector::Constant(2, inside)) << plan.dt << " s, " << plan.intervals << ", at " << offset;
      ASSERT_TRUE(c.dq.isZero(0.0) && c.ddq.isZero(0.0)) << plan.dt << " s, " << plan.intervals << ", at " << offset;
    }
    for (const Time t : {Time::min(), Time::max(), Time(0)}) ASSERT_EQ(sample(plan, t).q[0], inside);
  }
}

}  // namespace
}  // namespace steadyhand

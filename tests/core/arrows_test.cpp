#include "core/arrows.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace steadyhand

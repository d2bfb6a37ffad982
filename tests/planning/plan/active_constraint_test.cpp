#include "steadyhand/planning/plan/active_constraint.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"

namespace steadyhand {
namespace {

/// A stationary arm clear of everything, with a stationary plan.
struct Standing : testing::Test {
  Standing() : random(11), model(random_arm(6, random, false)), arm(model) {
    while (arm.set_position(model.home), clearance(arm) < 0.05) model.home = random_joints(6, 2.0, random);
    arm.set_position(model.home);
    plan.joints = 6;
    plan.intervals = 8;
    for (int k = 0; k <= 8; ++k) {
      plan.x[k].setZero(12);
      plan.x[k].head(6) = model.home;
      plan.u[k].setZero(6);
      reference.tools[0].p[k] = arm.p();
    }
    reference.nodes = 8;
    reach = {Vector3::Zero(), arm.p().norm() + 0.1};
  }
  ActiveConstraint active() { return active_constraint(plan, 8, instance, {&reach, 1}, arm); }

  std::mt19937 random;
  RobotModel model;
  Kinematics arm;
  Plan plan;
  OcpInstance instance;
  Reference& reference = instance.reference;
  Reach reach;
};

TEST_F(Standing, NothingHoldsItBack) { EXPECT_EQ(active().kind, ConstraintKind::kNone); }

TEST_F(Standing, NamesTheJointAtItsLimit) {
  for (int joint = 0; joint < 6; ++joint) {
    plan.u[3][joint] = -0.995 * model.acceleration_max[joint];
    EXPECT_EQ(active().kind, ConstraintKind::kAcceleration);
    EXPECT_EQ(active().first, joint);
    plan.x[4][6 + joint] = 0.995 * model.velocity_max[joint];
    EXPECT_EQ(active().kind, ConstraintKind::kVelocity);  // the graver one
    EXPECT_EQ(active().first, joint);
    plan.x[4][6 + joint] = plan.u[3][joint] = 0.0;
  }
  model.position_max[2] = model.home[2] + 1e-3;
  EXPECT_EQ(active().kind, ConstraintKind::kPosition);
  EXPECT_EQ(active().first, 2);
}

TEST_F(Standing, NamesThePairThatTouches) {
  const auto [i, j] = model.pairs.front();
  model.bodies[i].shape.radius +=
      (arm.body(i).p - arm.body(j).p).norm() - model.bodies[i].shape.radius - model.bodies[j].shape.radius;
  const ActiveConstraint found = active();
  EXPECT_EQ(found.kind, ConstraintKind::kSelfCollision);
  EXPECT_EQ(found.first, i);
}

/// Plans keep bodies apart by the instance's clearance: a pair at that distance is the active constraint.
TEST_F(Standing, APairAtItsClearanceIsTouched) {
  instance.clearance = clearance(arm) - 5e-4;
  EXPECT_EQ(active().kind, ConstraintKind::kSelfCollision);
  instance.clearance = clearance(arm) - 2e-3;
  EXPECT_EQ(active().kind, ConstraintKind::kNone);
}

TEST_F(Standing, AReferenceThatWasClippedIsTheReach) {
  reference.tools[0].p[5] *= reach.radius / reference.tools[0].p[5].norm();
  EXPECT_EQ(active().kind, ConstraintKind::kReach);
}

TEST_F(Standing, EachToolHasItsReach) {
  std::array reaches{reach, Reach{reach.center, 0.5 * reach.radius}};
  reference.tools[1].p.fill(Vector3(0.0, 0.0, 0.4 * reach.radius));
  const auto kind = [&] { return active_constraint(plan, 8, instance, reaches, arm).kind; };
  EXPECT_EQ(kind(), ConstraintKind::kNone);
  reference.tools[1].p[7] *= 1.25;
  EXPECT_EQ(kind(), ConstraintKind::kReach);
}

}  // namespace
}  // namespace steadyhand

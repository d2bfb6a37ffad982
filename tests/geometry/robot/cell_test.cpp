#include "steadyhand/geometry/robot/cell.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"

namespace steadyhand {
namespace {

CellObject object(const std::string& name, const Shape& shape, const Vector3& p) {
  return {name, shape, Eigen::Isometry3d(Eigen::Translation3d(p))};
}

/// The arm at home, and a bottle and a table by its tool.
struct Carrying : testing::Test {
  RobotModel model = some_arm();
  Kinematics arm{model};
  Cell cell{"cell", {}};

  Carrying() {
    arm.set_position(model.home);
    cell.objects = {object("table", Shape::half_space(), {0.0, 0.0, -3.0}),
                    object("bottle", Shape::cylinder(0.03, 0.1), arm.p() + 0.15 * arm.R().col(2))};
  }
  static RobotModel some_arm() {
    std::mt19937 random(1);
    return random_arm(6, random, false);
  }
  Eigen::Isometry3d tool() { return Eigen::Translation3d(arm.p()) * Eigen::Isometry3d(Quaternion(arm.R())); }
  static std::string reason(const Result<Cell>& result) { return result ? "" : result.error().message; }
};

TEST_F(Carrying, WhatIsTakenMovesWithTheToolAndIsLetGoOfWhereItIs) {
  const Eigen::Isometry3d before = cell.objects[1].origin, in_tool = tool().inverse() * before;
  const Result<Cell> taken = attach(cell, "bottle", arm);
  ASSERT_TRUE(taken) << reason(taken);
  EXPECT_TRUE(taken->objects[1].attached);
  EXPECT_TRUE(taken->objects[1].origin.isApprox(in_tool, 1e-12));
  const Result<Obstacles> obstacles = obstacles_of(*taken, model);
  ASSERT_TRUE(obstacles);
  EXPECT_TRUE(obstacles->list[1].carried);
  EXPECT_NEAR(obstacles->list[1].shape.core.x(), 0.03, 1e-12) << "without its own margin";

  arm.set_position(model.home + JointVector::Constant(6, 0.3));
  EXPECT_TRUE(placed_on_tool(arm, obstacles->list[1]).p.isApprox((tool() * in_tool).translation(), 1e-12));
  EXPECT_TRUE(cell_after(*taken, 10.0).objects[1].origin.isApprox(in_tool, 1e-12));
  const Result<Cell> left = detach(*taken, "bottle", arm);
  ASSERT_TRUE(left) << reason(left);
  EXPECT_FALSE(left->objects[1].attached);
  EXPECT_TRUE(left->objects[1].origin.isApprox(tool() * in_tool, 1e-12));
}

TEST_F(Carrying, WhatCannotBeTakenIsRefusedWithTheReason) {
  EXPECT_EQ(reason(attach(cell, "glass", arm)), "there is no object 'glass'");
  EXPECT_EQ(reason(detach(cell, "bottle", arm)), "object 'bottle' is not carried by the tool");
  EXPECT_NE(reason(attach(cell, "table", arm)).find("a half-space cannot be carried"), std::string::npos);
  const Cell taken = *attach(cell, "bottle", arm);
  EXPECT_EQ(reason(attach(taken, "bottle", arm)), "object 'bottle' is already carried by the tool");
  cell.objects.push_back(object("far", Shape::sphere(0.05), {3.0, 0.0, 0.0}));
  EXPECT_NE(reason(attach(cell, "far", arm)).find("it may be at most 2 m"), std::string::npos);
  const auto elbow = std::find_if(model.bodies.begin(), model.bodies.end(), [](const Body& b) { return b.link == 3; });
  const Vector3 inside = arm.body(static_cast<int>(elbow - model.bodies.begin())).p;
  cell.objects.push_back(object("inside", Shape::sphere(0.05), inside));
  EXPECT_NE(reason(attach(cell, "inside", arm)).find("which must not touch it"), std::string::npos);
  cell.objects.back().may_be_touched_by = {model.link_names[2], model.link_names[3], model.link_names[4]};
  EXPECT_EQ(reason(attach(cell, "inside", arm)), "");
}

/// Larger than the arm, in motion on its own, at no place at all, or of a name that no terminal should get.
TEST_F(Carrying, WhatIsNoThingToCarryIsRefused) {
  cell.objects.push_back(object("ball", Shape::sphere(10.0), {0.0, 0.0, 10.5}));
  EXPECT_NE(reason(attach(cell, "ball", arm)).find("it may be at most 2 m"), std::string::npos);
  const auto elbow = std::find_if(model.bodies.begin(), model.bodies.end(), [](const Body& b) { return b.link == 3; });
  const Vector3 there = arm.body(static_cast<int>(elbow - model.bodies.begin())).p;
  cell.objects.back() = object("wall", Shape::box({5.0, 5.0, 0.05}), there);
  EXPECT_NE(reason(attach(cell, "wall", arm)).find("which must not touch it"), std::string::npos);
  cell.objects.back() = object("rolling", Shape::sphere(0.02), arm.p() + Vector3(0.0, 0.0, 0.3));
  cell.objects.back().velocity = Vector3::UnitX();
  const Result<Cell> caught = attach(cell, "rolling", arm);
  ASSERT_TRUE(caught);
  EXPECT_TRUE(caught->objects.back().velocity.isZero(0.0));
  arm.set_position(JointVector::Constant(6, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(attach(cell, "bottle", arm));
  arm.set_position(model.home);
  cell.objects.back().name = "bot\x1b[2Jtle";
  EXPECT_EQ(obstacles_of(cell, model).error().message,
            "cell 'cell': an object has no name, or one with control characters");
}

TEST_F(Carrying, WhoMayTouchAnObjectThatGoesIsForgotten) {
  cell.objects[1].may_be_touched_by = {"table"};
  const Result<Cell> left = without(cell, "table");
  ASSERT_TRUE(left) << reason(left);
  EXPECT_TRUE(obstacles_of(*left, model));
  EXPECT_EQ(reason(without(*left, "table")), "there is no object 'table'");
}

TEST_F(Carrying, AtMostEightAtOnce) {
  for (int i = 0; i < kMaxCarried; ++i) {
    CellObject crumb = object("crumb " + std::to_string(i), Shape::sphere(0.005), Vector3(0.0, 0.0, 0.2));
    crumb.attached = true;
    cell.objects.push_back(crumb);
  }
  EXPECT_TRUE(obstacles_of(cell, model));
  EXPECT_NE(reason(attach(cell, "bottle", arm)).find("9 obstacles are carried; at most 8 may be"), std::string::npos);
}

/// Objects may touch each other if one of the two lists the other; an unknown name is refused.
TEST_F(Carrying, MayStandOnATable) {
  for (const int says : {0, 1}) {
    Cell named = cell;
    named.objects[says].may_be_touched_by = {named.objects[1 - says].name};
    const Result<Obstacles> obstacles = obstacles_of(*attach(named, "bottle", arm), model);
    ASSERT_TRUE(obstacles);
    EXPECT_TRUE(obstacles->list[0].ignores[solid_of(1)]);
    EXPECT_NE(nearest_body(arm, *obstacles, 0, 0.0).body, solid_of(1));
  }
  cell.objects[0].may_be_touched_by = {"botle"};
  EXPECT_NE(obstacles_of(cell, model).error().message.find("'botle'"), std::string::npos);
}

/// Distances know what is carried: of the table to the bottle, and of the bottle to the arm.
TEST_F(Carrying, IsAPartOfTheArm) {
  const Obstacles obstacles = *obstacles_of(*attach(cell, "bottle", arm), model);
  const NearestBody table = nearest_body(arm, obstacles, 0, 0.0), bottle = nearest_body(arm, obstacles, 1, 0.0);
  EXPECT_LT(bottle.body, kMaxBodies);
  EXPECT_LE(nearest_pair(arm, obstacles).gap, bottle.distance);
  const Shape solid = Shape::cylinder(0.03, 0.1);
  EXPECT_NEAR(
      distance(model.bodies[bottle.body].shape, arm.body(bottle.body), solid, placed_on_tool(arm, obstacles.list[1])),
      bottle.distance, 1e-3)
      << "without its margin";
  EXPECT_GT(table.distance, 0.0);
  Obstacles hanging = obstacles;
  hanging.list[1].at.p = arm.R().transpose() * Vector3(0.0, 0.0, -2.0);
  EXPECT_EQ(nearest_body(arm, hanging, 0, 0.0).body, solid_of(1));
}

}  // namespace
}  // namespace steadyhand

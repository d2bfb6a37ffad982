#include "steadyhand/files/record/model_json.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {
namespace {

void expect_same_motion(const RobotModel& one, const RobotModel& other, std::mt19937& random) {
  ASSERT_EQ(one.tool_count(), other.tool_count());
  Kinematics a(one), b(other);
  const JointVector q = random_joints(one.dof(), 3.0, random);
  a.set_position(q);
  b.set_position(q);
  for (int tool = 0; tool < one.tool_count(); ++tool) {
    EXPECT_TRUE(a.p(tool).isApprox(b.p(tool), 1e-9));
    EXPECT_TRUE(a.R(tool).isApprox(b.R(tool), 1e-9));
    EXPECT_EQ(one.tools[tool].name, other.tools[tool].name);
    EXPECT_EQ(one.tools[tool].gripper_time, other.tools[tool].gripper_time);
  }
}

TEST(RobotJson, OfATreeIsReadAsItIsWritten) {
  std::mt19937 random(1);
  for (int i = 0; i < 10; ++i) {
    RobotModel model = random_tree(random);
    model.tools[1].gripper_time = 0.5;
    const std::string text = robot_json(model);
    const RobotModel read = read_robot_json(OrderedJson::parse(text), "robot");
    EXPECT_EQ(robot_json(read), text);
    EXPECT_EQ(read.pairs, model.pairs);
    expect_same_motion(model, read, random);
  }
}

/// Its joints have no parents, and its gripper is next to the tool.
TEST(RobotJson, OlderOneHasOneToolOnItsLastLink) {
  std::mt19937 random(2);
  RobotModel model = random_arm(6, random);
  model.tools[0].gripper_time = 0.6;
  OrderedJson json = OrderedJson::parse(robot_json(model));
  for (OrderedJson& joint : json["joints"]) joint.erase("parent");
  json["tool"] = json["tools"][0];
  json["gripper"] = json["tool"]["gripper"];
  for (const char* key : {"link", "gripper"}) json["tool"].erase(key);
  json.erase("tools");
  expect_same_motion(model, read_robot_json(json, "robot"), random);
  json.erase("tool");
  try {
    read_robot_json(json, "robot");
    FAIL();
  } catch (const json::Wrong& wrong) {
    EXPECT_NE(wrong.message.find("has 0 tools; it must have 1 to 2"), std::string::npos) << wrong.message;
  }
}

}  // namespace
}  // namespace steadyhand

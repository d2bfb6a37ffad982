// Joints go by name.
#include "steadyhand/arms/ros2/joint_order.hpp"

#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"

namespace steadyhand {
namespace {

std::vector<char*> pointers(std::vector<std::string>& names) {
  std::vector<char*> all;
  for (std::string& name : names) all.push_back(name.data());
  return all;
}

TEST(JointOrder, FindsEachJointWhereverItIsAmongOthers) {
  JointOrder order({"base", "elbow", "wrist"});
  std::vector<std::string> names = {"gripper", "wrist", "base", "elbow"};
  ASSERT_TRUE(order.find(pointers(names)));
  EXPECT_EQ(order[0], 2u);
  EXPECT_EQ(order[1], 3u);
  EXPECT_EQ(order[2], 1u);
  names = {"base", "elbow", "wrist"};
  ASSERT_TRUE(order.find(pointers(names)));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(order[static_cast<int>(i)], i);
}

TEST(JointOrder, StrangersDoNotMatch) {
  JointOrder order({"base", "elbow", "wrist"});
  for (std::vector<std::string> names : {std::vector<std::string>{},
                                         {"base", "elbow"},
                                         {"base", "elbow", "wrist_2"},
                                         {"left_base", "left_elbow", "left_wrist"}}) {
    EXPECT_FALSE(order.find(pointers(names)));
  }
}

TEST(JointNames, ArePrefixedOrGiven) {
  std::mt19937 random(1);
  const RobotModel model = random_arm(3, random, false);
  Ros2Settings settings;
  settings.prefix = "left_";
  const auto own = ros2_joint_names(model, settings);
  ASSERT_TRUE(own);
  EXPECT_EQ((*own)[2], "left_" + model.joints[2].name);
  settings.joints = "a, b,c";
  const auto given = ros2_joint_names(model, settings);
  ASSERT_TRUE(given);
  EXPECT_EQ(*given, (std::vector<std::string>{"left_a", "left_b", "left_c"}));
  struct Bad {
    const char *joints, *word;
  };
  for (const Bad& bad :
       {Bad{"a,b", "2 names"}, Bad{"a,b,c,d", "4 names"}, Bad{"a,b,a", "twice"}, Bad{"a,,c", "empty"}}) {
    settings.joints = bad.joints;
    const auto refused = ros2_joint_names(model, settings);
    ASSERT_FALSE(refused) << bad.joints;
    EXPECT_NE(refused.error().message.find(bad.word), std::string::npos) << refused.error().message;
  }
}

}  // namespace
}  // namespace steadyhand

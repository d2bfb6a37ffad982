#include "steadyhand/geometry/robot/model_check.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "geometry/robot/random_arm.hpp"

namespace steadyhand {
namespace {

TEST(ModelCheck, EachWayToBeNoArmIsRefusedWithWhatWouldBeRight) {
  std::mt19937 random(3);
  const RobotModel good = random_arm(6, random);
  ASSERT_TRUE(check(good));
  ASSERT_TRUE(check(random_tree(random)));
  const struct {
    std::function<void(RobotModel&)> spoil;
    const char* message;
  } cases[] = {
      {[](RobotModel& m) { m = {}; }, "has 0 joints; it must have 1 to 16"},
      {[](RobotModel& m) { m.joints.resize(17, m.joints[0]); }, "has 17 joints; it must have 1 to 16"},
      {[](RobotModel& m) { m.joints[2].axis.setZero(); }, "the axis of joint 'joint_2' is [0, 0, 0]; it must have"},
      {[](RobotModel& m) { m.joints[1].origin.linear() *= 2.0; }, "the origin of joint 'joint_1' is no rotation"},
      {[](RobotModel& m) { m.tools[0].origin.translation().setConstant(std::nan("")); },
       "tool 'tool' has an origin that is no"},
      {[](RobotModel& m) { m.joints[2].parent = 3; }, "joint 'joint_2' has parent link 3; it must be 0 to 2"},
      {[](RobotModel& m) { m.joints[2].parent = -2; }, "joint 'joint_2' has parent link -2; it must be 0 to 2"},
      {[](RobotModel& m) { m.tools.clear(); }, "has 0 tools; it must have 1 to 2"},
      {[](RobotModel& m) { m.tools.resize(3, m.tools[0]); }, "has 3 tools; it must have 1 to 2"},
      {[](RobotModel& m) { m.tools.push_back(m.tools[0]); }, "two tools are called 'tool'; each needs another name"},
      {[](RobotModel& m) { m.tools[0].link = 0; }, "tool 'tool' is on link 0; the links that move are 1 to 6"},
      {[](RobotModel& m) { m.tools.push_back({"other", m.tools[0].origin, 4}); },
       "tool 'other' and tool 'tool' are on one chain"},
      {[](RobotModel& m) { m.tools.push_back({"other", m.tools[0].origin, 6}); }, "are on one chain; each must have"},
      {[](RobotModel& m) { m.link_names.clear(); }, "has 0 link_names; it must have 7"},
      {[](RobotModel& m) { m.home.conservativeResize(3); }, "home must be 6 finite numbers"},
      {[](RobotModel& m) { m.velocity_max[1] = std::nan(""); }, "velocity_max must be 6 finite numbers"},
      {[](RobotModel& m) { m.position_min.swap(m.position_max); }, "the lower limit must be below the upper one"},
      {[](RobotModel& m) { m.acceleration_max[5] = 0.0; }, "acceleration_max 0; both must be positive"},
      {[](RobotModel& m) { m.bodies[3].link = 50; }, "body 's3' is on link 50; the links are 0 to 6"},
      {[](RobotModel& m) { m.bodies[3].shape.radius = -1.0; }, "body 's3': the radius is -1 m; it must be above 0"},
      {[](RobotModel& m) { m.pairs.push_back({77, 99}); }, "the pair (77, 99) must be two of its 14 bodies"},
      {[](RobotModel& m) { m.pairs.push_back({5, 1}); }, "the pair (5, 1) must be two of its 14 bodies, the first on"},
  };
  for (const auto& [spoil, message] : cases) {
    RobotModel model = good;
    spoil(model);
    const Status status = check(model);
    ASSERT_FALSE(status) << message;
    EXPECT_NE(status.error().message.find(message), std::string::npos) << status.error().message;
  }
}

}  // namespace
}  // namespace steadyhand

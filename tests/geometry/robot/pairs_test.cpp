#include "steadyhand/geometry/robot/pairs.hpp"

#include <gtest/gtest.h>

#include <set>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "support/bodies.hpp"

namespace steadyhand {
namespace {

TEST(DefaultPairs, HoldEveryPairThatARandomConfigurationParts) {
  std::mt19937 random(11);
  for (int arm = 0; arm < 10; ++arm) {
    RobotModel model = random_arm(3 + arm % 4, random);
    for (Body& body : model.bodies) body.shape.radius = 0.3;  // many pairs overlap always
    const std::vector<BodyPair> pairs = default_pairs(model);
    const std::set<BodyPair> kept(pairs.begin(), pairs.end());
    ASSERT_EQ(kept.size(), pairs.size());
    for (const auto& [i, j] : pairs) ASSERT_GT(model.bodies[j].link - model.bodies[i].link, 1);

    Kinematics kinematics(model);
    for (int s = 0; s < 10000; ++s) {
      kinematics.set_position(random_joints(model.dof(), M_PI, random));
      for (const BodyPair& pair : model.pairs) {  // random_arm's: all but those on one link and on neighbours
        if (center_distance(kinematics, pair) > 0.6) {
          ASSERT_TRUE(kept.contains(pair)) << pair.first << " " << pair.second;
        }
      }
    }
  }
}

/// Two joints about parallel axes 1 m apart; spheres of link 0 and link 2 on circles about them.
RobotModel two_circles(double radius) {
  RobotModel model;
  Joint shoulder{"shoulder", JointType::kRevolute, Eigen::Isometry3d::Identity(), Vector3::UnitZ()};
  Joint elbow = shoulder;
  elbow.origin.translation() = Vector3::UnitX();
  model.joints = {shoulder, elbow};
  model.link_names.resize(3);
  model.position_min = JointVector::Constant(2, -M_PI);
  model.position_max = JointVector::Constant(2, M_PI);
  model.bodies = {Body::sphere("a", 0, {0.5, 0.0, 0.0}, radius), Body::sphere("b", 2, {0.25, 0.0, 0.0}, radius)};
  return model;
}

TEST(DefaultPairs, AreDecidedByTheLargestDistance) {
  // Largest distance: arm folded back and stretched, 0.5 + 1 + 0.25 m.
  EXPECT_TRUE(default_pairs(two_circles(1.75 / 2 + 1e-9)).empty());
  EXPECT_EQ(default_pairs(two_circles(1.75 / 2 - 1e-9)).size(), 1u);
}

TEST(DefaultPairs, RespectPositionLimits) {
  RobotModel model = two_circles(0.85);
  EXPECT_EQ(default_pairs(model).size(), 1u);
  model.position_min[0] = -1.0;  // may no longer point away from the sphere on the base
  model.position_max[0] = 1.0;
  EXPECT_TRUE(default_pairs(model).empty());
}

TEST(DefaultPairs, AreTheSameEveryTime) {
  std::mt19937 random(12);
  const RobotModel model = random_arm(6, random);
  EXPECT_EQ(default_pairs(model), default_pairs(model));
}

}  // namespace
}  // namespace steadyhand

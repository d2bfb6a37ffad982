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
    RobotModel model = arm % 2 == 0 ? random_arm(3 + arm % 4, random) : random_tree(random);
    for (Body& body : model.bodies) body.shape.radius = 0.3;  // many pairs overlap always
    const std::vector<BodyPair> pairs = default_pairs(model);
    const std::set<BodyPair> kept(pairs.begin(), pairs.end());
    ASSERT_EQ(kept.size(), pairs.size());
    for (const BodyPair& pair : pairs) ASSERT_EQ(std::count(model.pairs.begin(), model.pairs.end(), pair), 1);

    Kinematics kinematics(model);
    for (int s = 0; s < 10000; ++s) {
      kinematics.set_position(random_joints(model.dof(), M_PI, random));
      for (const BodyPair& pair : model.pairs) {  // all but those on one link and on neighbours
        if (center_distance(kinematics, pair) > 0.6) {
          ASSERT_TRUE(kept.contains(pair)) << pair.first << " " << pair.second;
        }
      }
    }
  }
}

TEST(DefaultPairs, AreThoseThatAreWanted) {
  std::mt19937 random(13);
  const RobotModel model = random_tree(1, 3, 2, random);
  std::vector<BodyPair> pairs = default_pairs(model);
  std::erase_if(pairs, [](const BodyPair& pair) { return (pair.first + pair.second) % 3 != 0; });
  EXPECT_EQ(default_pairs(model, [](int i, int j) { return (i + j) % 3 == 0; }), pairs);
}

TEST(PoseAlong, IsThatOfTheKinematics) {
  std::mt19937 random(14);
  for (int tree = 0; tree < 10; ++tree) {
    RobotModel model = random_tree(random);
    model.bodies.clear();
    for (int link = 0; link <= model.dof(); ++link)
      model.bodies.push_back({"", link, Shape::box(Vector3::Ones()), Eigen::Isometry3d::Identity()});
    Kinematics kinematics(model);
    kinematics.set_position(random_joints(model.dof(), M_PI, random));
    const auto pose = [&](int link) {
      const auto& [p, R] = kinematics.body(link);
      return Eigen::Isometry3d(Eigen::Translation3d(p) * Quaternion(R));
    };
    for (int first = 0; first <= model.dof(); ++first) {
      for (int last = 0; last <= model.dof(); ++last) {
        const auto way = way_between(model, first, last);
        JointVector q(way.size());
        for (std::size_t k = 0; k < way.size(); ++k) q[k] = kinematics.q()[way[k].joint];
        ASSERT_TRUE(pose_along(model, way, q).isApprox(pose(first).inverse() * pose(last), 1e-9));
        ASSERT_EQ(may_be_pair(model, first, last), first < last && way.size() > 1);
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

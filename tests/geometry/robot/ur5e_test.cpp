#include <gtest/gtest.h>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/geometry/robot/loading.hpp"
#include "steadyhand/geometry/robot/model.hpp"
#include "steadyhand/geometry/robot/pairs.hpp"
#include "support/ur5e_urdf.hpp"

namespace steadyhand {
namespace {

RobotModel load_ur5e() {
  RobotSettings settings;
  settings.urdf = ur5e_urdf();
  settings.tools[0].link = "wrist_3_link";
  auto model = load_robot(settings);
  EXPECT_TRUE(model) << model.error().message;
  return *std::move(model);
}

/// Flange in the D-H base by the manufacturer's table.
Eigen::Isometry3d dh_flange(const JointVector& q) {
  const double a[] = {0, -0.425, -0.3922, 0, 0, 0}, d[] = {0.1625, 0, 0, 0.1333, 0.0997, 0.0996};
  const double alpha[] = {M_PI_2, 0, 0, M_PI_2, -M_PI_2, 0};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (int k = 0; k < 6; ++k) {
    T = T * Eigen::AngleAxisd(q[k], Vector3::UnitZ()) * Eigen::Translation3d(a[k], 0, d[k]) *
        Eigen::AngleAxisd(alpha[k], Vector3::UnitX());
  }
  return T;
}

TEST(Ur5e, AgreesWithTheManufacturersTable) {
  const RobotModel model = load_ur5e();
  ASSERT_EQ(model.dof(), 6);
  Kinematics kinematics(model);
  const Eigen::AngleAxisd half_turn(M_PI, Vector3::UnitZ());  // from the D-H base to base_link
  std::mt19937 random(5);
  for (int i = 0; i < 10000; ++i) {
    const JointVector q = random_joints(6, 2.0 * M_PI, random);
    kinematics.set_position(q);
    const Eigen::Isometry3d table = half_turn * dh_flange(q);
    ASSERT_LT((kinematics.p() - table.translation()).norm(), 1e-6);
    ASSERT_LT(Eigen::AngleAxisd(kinematics.R().transpose() * table.linear()).angle(), 1e-6);
  }
}

TEST(Reach, HoldsEveryToolPositionAndIsTight) {
  const RobotModel model = load_ur5e();
  const Reach reach = compute_reach(model);
  Kinematics kinematics(model);
  std::mt19937 random(6);
  double farthest = 0.0;
  for (int i = 0; i < 100000; ++i) {
    kinematics.set_position(random_joints(6, M_PI, random));
    farthest = std::max(farthest, (kinematics.p() - reach.center).norm());
  }
  EXPECT_LE(farthest, reach.radius);
  EXPECT_GT(farthest, 0.98 * reach.radius);
  EXPECT_NEAR(reach.center.x(), 0.0, 1e-9);
  EXPECT_NEAR(reach.center.y(), 0.0, 1e-9);
  EXPECT_NEAR(reach.center.z(), 0.1625, 0.01);  // the shoulder, by symmetry
  kinematics.set_position(JointVector::Zero(6));
  EXPECT_EQ(clip(reach, kinematics.p()), kinematics.p());
  const Vector3 outside = clip(reach, reach.center + Vector3(3.0, 4.0, 0.0));
  EXPECT_LT((outside - reach.center - reach.radius * Vector3(0.6, 0.8, 0.0)).norm(), 1e-12);
}

TEST(Reach, HoldsTheToolOfRandomArms) {
  std::mt19937 random(7);
  for (int arm = 0; arm < 10; ++arm) {
    const RobotModel model = arm % 2 == 0 ? random_arm(2 + arm % 6, random) : random_tree(random);
    Kinematics kinematics(model);
    for (int tool = 0; tool < model.tool_count(); ++tool) {
      const Reach reach = compute_reach(model, tool);
      double farthest = 0.0;
      for (int i = 0; i < 10000; ++i) {
        kinematics.set_position(random_joints(model.dof(), M_PI, random));
        farthest = std::max(farthest, (kinematics.p(tool) - reach.center).norm());
      }
      ASSERT_LE(farthest, reach.radius);
      ASSERT_GT(farthest, 0.6 * reach.radius);
    }
  }
}

}  // namespace
}  // namespace steadyhand

// Kinematics as the factory measured it, and where it comes from: the primary interface's packages.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ur/ur_calibration.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "support/ur/fake_ur_controller.hpp"
#include "support/ur/ur5e_kinematics.hpp"

namespace steadyhand {
namespace {

/// The flange by Denavit and Hartenberg's parameters, whose base may be turned against the model's.
Eigen::Isometry3d flange(const UrKinematics& k, const JointVector& q, double turn) {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(turn, Vector3::UnitZ()));
  for (int i = 0; i < 6; ++i) {
    pose = pose * Eigen::AngleAxisd(q[i] + k.theta[i], Vector3::UnitZ()) * Eigen::Translation3d(0.0, 0.0, k.d[i]) *
           Eigen::Translation3d(k.a[i], 0.0, 0.0) * Eigen::AngleAxisd(k.alpha[i], Vector3::UnitX());
  }
  return pose;
}

RobotModel ur5e() {
  auto model = open_robot("ur5e");
  EXPECT_TRUE(model) << model.error().message;
  return *std::move(model);
}

/// Wherever the arm is mounted.
TEST(UrCalibration, TheNominalParametersAreTheModels) {
  for (const char* name : {"ur5e", "ur5e_ceiling"}) {
    const auto model = open_robot(name);
    ASSERT_TRUE(model) << model.error().message;
    UrDeviation deviation;
    const auto made = calibrate(*model, ur5e_kinematics(), deviation);
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_LT(deviation.joint_m, 1e-4);
    EXPECT_LT(deviation.joint_rad, 1e-4);
    EXPECT_LT(deviation.tool_m, 2e-4);
    Kinematics nominal(*model), measured(*made);
    nominal.set_position(model->home);
    measured.set_position(model->home);
    EXPECT_LT((nominal.p() - measured.p()).norm(), 1e-3) << name;
  }
}

/// An arm as factories measure them: all parameters a little off, and those of the parallel axes far away.
TEST(UrCalibration, TheToolIsWhereTheMeasuredParametersHaveIt) {
  const RobotModel model = ur5e();
  // A URDF of the manufacturer's is turned by half a turn, or not; the arm lies stretched out at zero.
  Kinematics nominal(model);
  nominal.set_position(JointVector::Zero(6));
  const double turn = nominal.p().x() < 0.0 ? 0.0 : M_PI;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> off(-1e-3, 1e-3);
  for (int round = 0; round < 20; ++round) {
    UrKinematics k = ur5e_kinematics();
    for (auto* values : {&k.theta, &k.a, &k.d, &k.alpha}) {
      for (double& value : *values) value += off(random);
    }
    k.a[5] = k.alpha[5] = 0.0;
    // Along axes that are nearly parallel much goes back and forth.
    k.d[1] += 3.0;
    k.d[2] -= 3.0;
    k.alpha[1] = 1e-4;
    UrDeviation deviation;
    const auto made = calibrate(model, k, deviation);
    ASSERT_TRUE(made) << made.error().message;
    Kinematics kinematics(*made);
    for (int i = 0; i < 20; ++i) {
      const JointVector q = random_joints(6, 2.0, random);
      kinematics.set_position(q);
      const Eigen::Isometry3d tool = flange(k, q, turn) * model.tool().origin;
      EXPECT_LT((kinematics.p() - tool.translation()).norm(), 1e-9);
      EXPECT_LT((kinematics.R() - tool.linear()).norm(), 1e-9);
    }
    // Spheres stay on their links.
    for (int i = 0; i < 6; ++i) {
      const Eigen::Isometry3d& a = made->joints[i].origin;
      EXPECT_LT((a.translation() - model.joints[i].origin.translation()).norm(), 0.01) << i;
    }
  }
}

TEST(UrCalibration, AnotherArmIsRefused) {
  UrKinematics ur10e = ur5e_kinematics();
  ur10e.a[1] = -0.6127;
  ur10e.a[2] = -0.57155;
  UrDeviation deviation;
  const auto made = calibrate(ur5e(), ur10e, deviation);
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().message.find("is not a 'ur5e'"), std::string::npos) << made.error().message;
}

TEST(UrPrimaryInterface, TellsTheKinematicsThatTheControllerHas) {
  std::mt19937 random(3);
  RobotModel model = random_arm(6, random, false);
  FakeUrController::Settings settings;
  settings.kinematics = ur5e_kinematics();
  FakeUrController controller(model, settings);
  auto ends = Socket::pair();
  ASSERT_TRUE(ends);
  controller.accept_script(std::move(ends->second));
  for (int i = 0; i < 200; ++i) controller.step();
  UrPrimary primary(std::move(ends->first));
  const auto k = read_kinematics(primary, Time(0));
  ASSERT_TRUE(k);
  EXPECT_EQ(k->a, settings.kinematics->a);
  EXPECT_EQ(k->theta, settings.kinematics->theta);
  EXPECT_EQ(k->d, settings.kinematics->d);
  EXPECT_EQ(k->alpha, settings.kinematics->alpha);
}

/// For any input: nothing is read beyond its end, and reading ends.
TEST(UrPrimaryInterface, GarbageIsNothingWorse) {
  std::mt19937 random(4);
  for (int round = 0; round < 3000; ++round) {
    auto ends = Socket::pair();
    ASSERT_TRUE(ends);
    std::vector<std::uint8_t> bytes(std::uniform_int_distribution(0, 300)(random));
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() % (round % 2 == 0 ? 256 : 24));
    if (bytes.size() > 12 && round % 3 != 0) {  // the head of a package that is whole
      const std::uint8_t head[] = {0, 0, 0, static_cast<std::uint8_t>(bytes.size() % 200),
                                   round % 2 == 0 ? std::uint8_t{16} : std::uint8_t{20}};
      std::copy(std::begin(head), std::end(head), bytes.begin());
    }
    std::size_t sent = 0;
    (void)ends->second.send(bytes, sent);
    UrPrimary primary(std::move(ends->first));
    (void)primary.fill();
    int messages = 0;
    for (UrMessage message; primary.next(message);) ASSERT_LT(++messages, 100);
  }
}

}  // namespace
}  // namespace steadyhand

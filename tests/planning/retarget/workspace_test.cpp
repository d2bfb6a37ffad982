// The default settings keep people's motions in the arm's open workspace.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <limits>

#include "steadyhand/files/input/recording.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/geometry/robot/loading.hpp"
#include "steadyhand/planning/retarget/retargeter.hpp"
#include "support/ur5e_urdf.hpp"

namespace steadyhand {
namespace {

/// The glass at the home pose of robots/ur5e.yaml.
Pose home_glass() {
  const YAML::Node file = YAML::LoadFile(STEADYHAND_ROOT "/robots/ur5e.yaml");
  const auto numbers = [](const YAML::Node& node) { return node.as<std::vector<double>>(); };
  const std::vector<double> xyz = numbers(file["tool"]["xyz"]), rpy = numbers(file["tool"]["rpy"]);

  RobotSettings settings;
  settings.urdf = ur5e_urdf();
  settings.tools[0].link = file["tool"]["link"].as<std::string>();
  settings.tools[0].origin = Eigen::Translation3d(xyz[0], xyz[1], xyz[2]) *
                             Eigen::AngleAxisd(rpy[2], Vector3::UnitZ()) * Eigen::AngleAxisd(rpy[1], Vector3::UnitY()) *
                             Eigen::AngleAxisd(rpy[0], Vector3::UnitX());
  settings.home = numbers(file["home"]);
  const auto model = load_robot(settings);
  EXPECT_TRUE(model) << model.error().message;
  Kinematics kinematics(*model);
  kinematics.set_position(model->home);
  return {kinematics.p(), Quaternion(kinematics.R())};
}

/// Over the targets of a recording that is engaged with the glass at home.
struct Extent {
  double from_axis = std::numeric_limits<double>::infinity();  ///< m, smallest distance from the base axis
  double from_base = 0.0;                                      ///< m, largest distance from the base
};

Extent extent(const std::string& file, double until, double scale) {
  const auto recording = load_recording(STEADYHAND_DEPS "/node_modules/super-hands/examples/" + file, {"", 0.0, until});
  EXPECT_TRUE(recording) << recording.error().message;
  RetargetSettings settings;
  settings.scale = scale;
  Retargeter retargeter(settings);
  const Pose home = home_glass();
  Extent extent;
  for (const OperatorSample& sample : recording->samples) {
    const Target target = retargeter.update(sample, home);
    EXPECT_TRUE(target.engaged);
    extent.from_axis = std::min(extent.from_axis, target.X_base_tool.p.head<2>().norm());
    extent.from_base = std::max(extent.from_base, target.X_base_tool.p.norm());
  }
  return extent;
}

constexpr double kFirstPart = 11.0;  // s of the bundled recording; then the person walks off
constexpr double kWhole = std::numeric_limits<double>::infinity();
const double kScale = RetargetSettings{}.scale;

TEST(DefaultWorkspace, HoldsTheBundledRecording) {
  const Extent half = extent("physics/demo-recording.json", kFirstPart, kScale);
  EXPECT_GT(half.from_axis, 0.4);
  EXPECT_LT(half.from_base, 0.8);
  const Extent full = extent("physics/demo-recording.json", kFirstPart, 1.0);
  EXPECT_GT(full.from_axis, 0.3);
  EXPECT_LT(full.from_base, 0.9);
}

TEST(DefaultWorkspace, KeepsOtherPeopleOffTheBaseAxis) {
  for (const auto* file : {"physics/demo-laser.json", "events/demo-recording.json", "mouse/demo-recording.json"}) {
    EXPECT_GT(extent(file, kWhole, kScale).from_axis, 0.4) << file;
  }
}

}  // namespace
}  // namespace steadyhand

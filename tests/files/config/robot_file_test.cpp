#include "steadyhand/files/config/robot_file.hpp"

#include <gtest/gtest.h>

#include <set>

#include "files/config/refusal.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "support/temporary_folder.hpp"

namespace steadyhand {
namespace {

namespace fs = std::filesystem;

RobotModel ur5e() {
  auto model = open_robot("ur5e", kPlaces);
  EXPECT_TRUE(model) << model.error().message;
  return *std::move(model);
}

TEST(RobotFile, LoadsTheUr5e) {
  const RobotModel model = ur5e();
  EXPECT_EQ(model.name, "ur5e");
  ASSERT_EQ(model.dof(), 6);
  EXPECT_EQ(model.tool().name, "glass");
  const auto on_arm = [](const Body& s) { return !s.name.starts_with("gripper") && !s.name.starts_with("glass"); };
  EXPECT_EQ(std::count_if(model.bodies.begin(), model.bodies.end(), on_arm), 29);
  std::set<int> links;
  for (const Body& body : model.bodies) links.insert(body.link);
  EXPECT_EQ(links.size(), 7u);

  Kinematics kinematics(model);
  kinematics.set_position(model.home);
  EXPECT_GT(kinematics.R()(2, 2), 0.999);  // the glass stands upright
}

/// For any file name: `xacro: false` prevents code from being run.
TEST(RobotFile, ExpandsAPackagesFileAsItSays) {
  const TemporaryFolder folder;
  fs::create_directories(folder.path() / "package");
  folder.write("package/arm.urdf.xacro",
               "<robot name='a' xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:arm/></robot>");
  Places places = kPlaces;
  places.packages = {folder.path()};
  const auto read = [&](const std::string& more) {
    const auto file = folder.write("arm.yaml", "urdf: {package: package, path: arm.urdf.xacro" + more + "}\n");
    return open_robot(file.string(), places);
  };
  const auto never = read(", xacro: false");
  ASSERT_FALSE(never);
  EXPECT_NE(never.error().message.find("<xacro:arm> is a xacro macro"), std::string::npos) << never.error().message;
  for (const char* more : {"", ", xacro: true"}) {
    const auto expanded = read(more);
    ASSERT_FALSE(expanded);
    EXPECT_NE(expanded.error().message.find("cannot be expanded by xacro"), std::string::npos)
        << expanded.error().message;
  }
}

TEST(RobotFile, TheGlassStandsAcrossTheFlange) {
  const RobotModel model = ur5e();
  EXPECT_NEAR(model.tool().origin.linear()(2, 2), 0.0, 1e-9);  // z of the glass in the flange's frame
}

TEST(RobotFile, ABareUrdfLoads) {
  const auto settings = load_robot_settings(kPlaces.data / "robots/ur5e.yaml", kPlaces);
  ASSERT_TRUE(settings) << settings.error().message;
  const auto model = open_robot(settings->urdf.string(), kPlaces);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->dof(), 6);
  EXPECT_TRUE(model->bodies.empty());
  EXPECT_TRUE(model->acceleration_max.isApproxToConstant(15.0));
}

TEST(RobotFile, AnUnknownNameListsTheKnownOnes) {
  const auto model = open_robot("ur55", kPlaces);
  ASSERT_FALSE(model);
  EXPECT_NE(model.error().message.find("'ur55'"), std::string::npos);
  EXPECT_NE(model.error().message.find("ur5e"), std::string::npos);
}

TEST(RobotFile, AHomePoseInSelfCollisionNamesTheBodies) {
  const TemporaryFolder folder;
  std::ifstream stream(kPlaces.data / "robots/ur5e.yaml");
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::size_t home = text.find("\nhome: [");
  ASSERT_NE(home, std::string::npos);
  text.replace(home, text.find(']', home) + 1 - home, "\nhome: [0, -1.57, 3.0, 0, 0, 0]");
  const auto model = open_robot(folder.write("folded.yaml", text).string(), kPlaces);
  ASSERT_FALSE(model);
  const testing::Matcher<const std::string&> names_the_bodies =
      testing::ContainsRegex("folded.yaml: .*self-collision: bodies '[a-z0-9_]+' and '[a-z0-9_]+' overlap by .* mm");
  EXPECT_TRUE(names_the_bodies.Matches(model.error().message)) << model.error().message;
}

/// A file inherits from the one that it extends.
TEST(RobotFile, OneExtendsAnother) {
  const RobotModel whole = ur5e();
  const TemporaryFolder folder;
  const fs::path mine = folder.write("mine.yaml",
                                     "extends: ur5e\nmount: {xyz: [0, 0, 1], rpy: [0, 0, 0]}\n"
                                     "velocity_max: [1, 1, 1, 1, 1, 1]\n");
  const auto model = open_robot(mine.string(), kPlaces);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->name, "mine");
  EXPECT_EQ(model->meshes, "ur5e");
  EXPECT_EQ(model->velocity_max, JointVector::Ones(6));
  EXPECT_EQ(model->acceleration_max, whole.acceleration_max);
  EXPECT_EQ(model->home, whole.home);
  EXPECT_EQ(model->tool().name, "glass");
  EXPECT_EQ(model->pairs, whole.pairs);
  const auto bodies = open_robot(
      folder
          .write("beside.yaml", "extends: mine.yaml\nbodies: [{name: b, link: wrist_3_link, sphere: {radius: 0.1}}]\n")
          .string(),
      kPlaces);
  ASSERT_TRUE(bodies) << bodies.error().message;
  EXPECT_EQ(bodies->bodies.size(), 1u);
  EXPECT_EQ(bodies->mount.translation(), Vector3::UnitZ());
  for (const auto& [name, text, reason] :
       {std::tuple("self.yaml", "extends: self.yaml\n", "more than 8 files extend each other"),
        std::tuple("of_nobody.yaml", "extends: ur55\n", "'extends': robot 'ur55' is neither"),
        std::tuple("no_mount.yaml", "extends: ur5e\nmount: {xyz: [0, 0, .nan], rpy: [0, 0, 0]}\n", "mount.xyz"),
        std::tuple("half_mount.yaml", "extends: ur5e\nmount: {rpy: [0, 0, 0]}\n", "key 'mount.xyz' is missing")}) {
    const auto refused = open_robot(folder.write(name, text).string(), kPlaces);
    ASSERT_FALSE(refused) << name;
    EXPECT_NE(refused.error().message.find(reason), std::string::npos) << refused.error().message;
  }
}

TEST(RobotFile, UnderTheCeilingTheGlassStandsUpright) {
  const auto model = open_robot("ur5e_ceiling", kPlaces);
  ASSERT_TRUE(model) << model.error().message;
  Kinematics arm(*model);
  arm.set_position(model->home);
  EXPECT_GT(arm.R()(2, 2), 0.9999);
  EXPECT_NEAR(arm.p().z(), 1.1, 0.01);
  EXPECT_TRUE(doubts_about(*model).empty());
}

TEST(RobotFile, JoinsArmsOnOneTable) {
  const RobotModel alone = ur5e();
  const TemporaryFolder folder;
  const auto written = [&](const std::string& text) {
    return open_robot(folder.write("two.yaml", text).string(), kPlaces);
  };
  const std::string arm = "{extends: ur5e, mount: {xyz: [0, 0.4, 0], rpy: [0, 0, 0]}}";
  const std::string other =
      "{extends: ur5e_gripper, mount: {xyz: [0, -0.4, 0], rpy: [0, 0, 0]}, velocity_max: "
      "{wrist_1_joint: 1}}";
  const auto both = written("arms: {left: " + arm + ", right: " + other +
                            "}\nbodies: [{name: table, link: world, box: "
                            "{size: [1, 1.6, 0.04], center: [0, 0, -0.03]}}]\n");
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_EQ(both->dof(), 12);
  EXPECT_EQ(both->meshes, "two") << "the page gets those of both";
  EXPECT_FALSE(both->tools[0].gripper_time);
  EXPECT_EQ(both->tools[1].gripper_time, 0.6);
  EXPECT_EQ(both->velocity_max[9], 1.0);
  EXPECT_EQ(both->velocity_max.head(6), alone.velocity_max);
  EXPECT_EQ(std::count_if(both->pairs.begin(), both->pairs.end(),
                          [&](const BodyPair& pair) {
                            return both->bodies[pair.first].name.starts_with("left_") &&
                                   both->bodies[pair.second].name.starts_with("left_");
                          }),
            std::ssize(alone.pairs));
  const auto dynamics = open_dynamics((folder.path() / "two.yaml").string(), kPlaces);
  ASSERT_TRUE(dynamics) << dynamics.error().message;
  EXPECT_EQ(dynamics->links.size(), 13u);
  EXPECT_EQ(dynamics->effort_max.size(), 12);
  const auto without = open_robot(folder.write("bare.yaml", "extends: two.yaml\nbodies: []\n").string(), kPlaces);
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_EQ(without->bodies.size(), both->bodies.size() - 1);
  EXPECT_EQ(without->meshes, "two");
  for (const auto& [text, reason] : {
           std::pair("arms: {left: " + arm + "}", "two.yaml:1: arms must have 2 entries, not 1"),
           std::pair("arms: {a: " + arm + ", b: " + arm + ", c: " + arm + "}", "arms must have 2 entries, not 3"),
           std::pair("arms: {left: " + arm + ", right: {extends: ur5e, mont: {}}}",
                     "two.yaml:1: unknown key 'mont' in 'arms.right'; did you mean 'mount'?"),
           std::pair("arms: {left: " + arm + ", right: {mount: {xyz: [0, 0, 0], rpy: [0, 0, 0]}}}",
                     "key 'arms.right.urdf' is missing"),
           std::pair("arms: {left: " + arm + ", right: {extends: two_ur5e}}",
                     "arms.right has arms itself; each arm is a robot with one tool"),
           std::pair("pairs: []\narms: {left: " + arm + ", right: " + other + "}", "two.yaml:1: pairs must be auto"),
           std::pair("home: [0]\narms: {left: " + arm + ", right: " + other + "}", "unknown key 'home'"),
           std::pair("arms: {left: " + arm + ", right: " + arm + "}",
                     "two.yaml: robot 'two': the home pose is in self-collision: bodies 'left_"),
       }) {
    const auto refused = written(text);
    ASSERT_FALSE(refused) << text;
    EXPECT_NE(refused.error().message.find(reason), std::string::npos) << refused.error().message;
  }
}

TEST(RobotFile, ShippedRobotsOfTwoArmsHoldTheirGlassesUprightAndApart) {
  const auto two = open_robot("two_ur5e", kPlaces);
  ASSERT_TRUE(two) << two.error().message;
  EXPECT_TRUE(doubts_about(*two).empty());
  Kinematics arms(*two);
  arms.set_position(two->home);
  for (int tool = 0; tool < 2; ++tool) EXPECT_GT(arms.R(tool)(2, 2), 0.9999);
  EXPECT_GT((arms.p(0) - arms.p(1)).norm(), 0.4);
}

class RobotFileRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(RobotFileRefuses, WithTheReason) {
  const TemporaryFolder folder;
  const auto model = open_robot(folder.write("arm.yaml", GetParam().text).string(), kPlaces);
  ASSERT_FALSE(model);
  EXPECT_NE(model.error().message.find(GetParam().message), std::string::npos) << model.error().message;
}

INSTANTIATE_TEST_SUITE_P(
    All, RobotFileRefuses,
    testing::Values(
        Refusal{"no_urdf", "name: arm\n", "arm.yaml:1: key 'urdf' is missing"},
        Refusal{"urdf_not_there", "urdf: arm.urdf\n", "arm.urdf: no such file"},
        Refusal{"package", "urdf: {package: nothing, path: a.urdf}\n",
                "Python package 'nothing' with its file 'a.urdf' is not in"},
        Refusal{"distribution", "urdf: {package: nothing, path: a.urdf, distribution: no-thing}\n",
                "/packages' no-thing"},
        Refusal{"urdf_key", "urdf: {package: airo_models, file: a.urdf}\n", "arm.yaml:1: unknown key 'file' in 'urdf'"},
        Refusal{"key", "urdf: a\n\ntoool: {}\n", "arm.yaml:3: unknown key 'toool'; did you mean 'tool'?"},
        Refusal{"tool_size", "urdf: a\ntool: {link: a, xyz: [0, 0], rpy: [0, 0, 0]}\n",
                "arm.yaml:2: tool.xyz has 2 numbers; 3 are expected"},
        Refusal{"tool_and_tools", "urdf: a\ntool: {link: a}\ntools: {left: {link: a}, right: {link: b}}\n",
                "arm.yaml:3: tools cannot be combined with 'tool' or 'gripper': each entry of 'tools' is a tool"},
        Refusal{"three_tools", "urdf: a\ntools: {a: {link: a}, b: {link: b}, c: {link: c}}\n",
                "arm.yaml:2: tools must have 1 to 2 entries, not 3"},
        Refusal{"tool_twice", "urdf: a\ntools: {left: {link: a}, left: {link: b}}\n", "key 'left' is there twice"},
        Refusal{"tools_key", "urdf: a\ntools: {left: {link: a, xzy: [0, 0, 0]}}\n",
                "unknown key 'xzy' in 'tools.left'; did you mean 'xyz'?"},
        Refusal{"home_by_name", "urdf: a\nhome: {j1: nan}\n", "home.j1"},
        Refusal{"radius", "urdf: a\nspheres:\n  - {name: s, link: l, center: [0, 0, 0], radius: -0.1}\n",
                "arm.yaml:3: spheres[0].radius is -0.1; it must be positive"},
        Refusal{"no_shape", "urdf: a\nbodies:\n  - {name: s, link: l}\n",
                "arm.yaml:3: bodies[0].shape must be one of sphere, capsule, box and cylinder"},
        Refusal{"two_shapes", "urdf: a\nbodies: [{name: s, link: l, sphere: {radius: 1}, box: {size: [1, 1, 1]}}]\n",
                "must be one of sphere, capsule, box and cylinder"},
        Refusal{"sphere_without_radius", "urdf: a\nbodies: [{name: s, link: l, sphere: {}}]\n",
                "key 'bodies[0].sphere.radius' is missing"},
        Refusal{"capsule_nan",
                "urdf: a\nbodies: [{name: s, link: l, capsule: {from: [0, 0, 0], to: [0, .nan, 0], radius: 1}}]\n",
                "bodies[0].capsule.to[1] is '.nan'; a number is expected"},
        Refusal{"box_size", "urdf: a\nbodies: [{name: s, link: l, box: {size: [1, 0, 1]}}]\n",
                "bodies[0].box.size[1] is 0; it must be positive"},
        Refusal{"box_rounding", "urdf: a\nbodies: [{name: s, link: l, box: {size: [1, 0.2, 1], rounding: 0.1}}]\n",
                "bodies[0].box.rounding must be less than half of each size"},
        Refusal{"cylinder_flat",
                "urdf: a\nbodies: [{name: s, link: l, cylinder: {from: [1, 0, 0], to: [1, 0, 0], radius: 1}}]\n",
                "bodies[0].cylinder.to must be another point than 'from'"},
        Refusal{"body_key", "urdf: a\nbodies: [{name: s, link: l, box: {size: [1, 1, 1], radius: 1}}]\n",
                "unknown key 'radius' in 'bodies[0].box'"},
        Refusal{"half_space", "urdf: a\nbodies: [{name: s, link: l, half_space: {}}]\n",
                "unknown key 'half_space' in 'bodies[0]'; known: sphere, capsule, box, cylinder"},
        Refusal{"pairs", "urdf: a\npairs: all\n", "arm.yaml:2: pairs must be auto or a list of [name, name]"},
        Refusal{"acceleration", "urdf: a\nacceleration_max: [1, 0]\n", "acceleration_max[1] is 0; it must be positive"},
        Refusal{"home_nan", "urdf: a\nhome: [nan]\n", "arm.yaml:2: home[0] is 'nan'; it must be a finite number"}),
    refusal_name);

}  // namespace
}  // namespace steadyhand

#include "steadyhand/geometry/robot/loading.hpp"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <functional>
#include <set>

#include "geometry/robot/random_arm.hpp"
#include "geometry/robot/urdf_text.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"
#include "support/bodies.hpp"
#include "support/temporary_folder.hpp"

/// For AddressSanitizer, whichever compiler has it. urdfdom never frees the links of a loop that has no root: they own
/// each other, and it hands no model out.
extern "C" const char* __lsan_default_suppressions() { return "leak:liburdfdom_model\n"; }

namespace steadyhand {
namespace {

Result<RobotModel> load_text(const std::string& text, const std::function<void(RobotSettings&)>& change = {}) {
  const TemporaryFolder folder;
  RobotSettings settings;
  settings.urdf = folder.write("arm.urdf", text);
  if (change) change(settings);
  return load_robot(settings);
}

const std::string kRevolute = "<axis xyz='0 0 1'/><limit lower='-3' upper='3' velocity='2' effort='10'/>";

std::string one_joint(const std::string& type, const std::string& content) {
  return urdf_robot(urdf_link("l0") + urdf_link("l1") + urdf_joint("j1", type, "l0", "l1", content));
}

TEST(LoadRobot, TakesDefaultsFromTheUrdf) {
  const auto model = load_text(urdf_robot(urdf_serial_arm(3)));
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->name, "arm");
  EXPECT_EQ(model->dof(), 3);
  EXPECT_EQ(model->link_names, (std::vector<std::string>{"l0", "l1", "l2", "l3"}));
  EXPECT_EQ(model->home, JointVector::Zero(3));
  EXPECT_EQ(model->velocity_max, JointVector::Constant(3, 2.0));
  EXPECT_EQ(model->acceleration_max, JointVector::Constant(3, kDefaultAcceleration));
  EXPECT_TRUE(model->tool().origin.isApprox(Eigen::Isometry3d::Identity()));
}

TEST(LoadRobot, MergesFixedJointsAndAllowsFixedSideBranches) {
  const auto fixed = [](const char* name, const char* parent, const char* child) {
    return urdf_link(child) + urdf_joint(name, "fixed", parent, child, "");
  };
  const std::string text =
      urdf_robot(urdf_link("world") + fixed("f0", "world", "l0") + urdf_serial_arm(2).substr(urdf_link("l0").size()) +
                 fixed("f1", "l2", "flange") + fixed("f2", "l1", "camera"));
  const auto model = load_text(text, [](RobotSettings& settings) {
    settings.tools[0].link = "flange";
    settings.bodies = {ball("on_base", "l0", {0.1, 0.2, 0.3}, 0.05),
                       ball("on_camera", "camera", {0.1, 0.2, 0.3}, 0.05)};
  });
  ASSERT_TRUE(model) << model.error().message;
  Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
  step.linear() = Eigen::AngleAxisd(1.2, Vector3::UnitX()).toRotationMatrix();
  step.translation() = Vector3(0.3, 0.0, 0.0);
  EXPECT_EQ(model->link_names[0], "world");
  EXPECT_TRUE(model->joints[0].origin.isApprox(step * step, 1e-12));
  EXPECT_TRUE(model->joints[1].origin.isApprox(step, 1e-12));
  EXPECT_TRUE(model->tool().origin.isApprox(step, 1e-12));
  EXPECT_EQ(model->bodies[0].link, 0);
  EXPECT_EQ(model->bodies[1].link, 1);
  for (const Body& body : model->bodies) {
    EXPECT_LT((body.origin.translation() - step * Vector3(0.1, 0.2, 0.3)).norm(), 1e-12);
  }
}

TEST(LoadRobot, ReadsContinuousAndPrismaticJoints) {
  const auto model = load_text(urdf_robot(
      urdf_link("l0") + urdf_link("l1") + urdf_link("l2") +
      urdf_joint("turn", "continuous", "l0", "l1", "<axis xyz='0 0.999 0'/><limit velocity='2' effort='1'/>") +
      urdf_joint("slide", "prismatic", "l1", "l2",
                 "<axis xyz='1 0 0'/><limit lower='0' upper='0.5' velocity='2' effort='1'/>")));
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->joints[0].type, JointType::kRevolute);
  EXPECT_EQ(model->joints[0].axis, Vector3::UnitY());
  EXPECT_EQ(model->position_max[0], kContinuousLimit);
  EXPECT_EQ(model->joints[1].type, JointType::kPrismatic);
  EXPECT_EQ(model->home[1], 0.25);
}

TEST(LoadRobot, FindsMeshes) {
  const TemporaryFolder folder;
  folder.write("my_arm/meshes/link.stl", "solid");
  const std::string visual = "<visual><geometry><mesh filename='{}'/></geometry></visual>";
  for (const std::string& name : {std::string("../meshes/link.stl"), std::string("package://my_arm/meshes/link.stl"),
                                  "file://" + (folder.path() / "my_arm/meshes/link.stl").string()}) {
    RobotSettings settings;
    settings.urdf =
        folder.write("my_arm/urdf/arm.urdf",
                     urdf_robot(urdf_serial_arm(2) + urdf_link("cover", fmt::format(fmt::runtime(visual), name)) +
                                urdf_joint("screws", "fixed", "l1", "cover", "")));
    const auto model = load_robot(settings);
    EXPECT_TRUE(model) << model.error().message;
  }
}

TEST(LoadRobot, ReadsNumbersTheSameInEveryLocale) {
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "C.UTF-8"}) {
    std::setlocale(LC_ALL, name);  // stays "C" where the machine does not have it
    const auto model = load_text(urdf_robot(urdf_serial_arm(2)));
    std::setlocale(LC_ALL, "C");
    ASSERT_TRUE(model) << model.error().message;
    EXPECT_DOUBLE_EQ(model->joints[0].origin.translation().x(), 0.3);
  }
}

TEST(LoadRobot, ABareUrdfRaisesDoubts) {
  const auto model = load_text(urdf_robot(urdf_serial_arm(3)));  // each joint rolls by 1.2 rad
  ASSERT_TRUE(model) << model.error().message;
  const std::vector<std::string> doubts = doubts_about(*model);
  ASSERT_EQ(doubts.size(), 2u);
  EXPECT_NE(doubts[0].find("no bodies: it can hit itself"), std::string::npos) << doubts[0];
  EXPECT_NE(doubts[1].find("leans by 154 degrees"), std::string::npos) << doubts[1];  // 360 - 3 * 1.2 rad

  const auto complete = load_text(urdf_robot(urdf_serial_arm(3)), [](RobotSettings& settings) {
    settings.tools[0].origin = Eigen::Isometry3d(Eigen::AngleAxisd(-3.6, Vector3::UnitX()));
    settings.bodies = {ball("a", "l0", Vector3::Zero(), 0.01), ball("b", "l3", Vector3::Zero(), 0.01)};
    settings.pairs.emplace().emplace_back("a", "b");
  });
  ASSERT_TRUE(complete) << complete.error().message;
  EXPECT_TRUE(doubts_about(*complete).empty());
}

/// Five joints, and behind them two fingers that slide along z, the right one twice as far as the left.
std::string gripper() {
  const std::string slides = "<axis xyz='0 0 1'/><limit lower='0.01' upper='0.04' velocity='1' effort='1'/>";
  return urdf_robot(
      urdf_serial_arm(5) + urdf_link("left_finger") + urdf_link("right_finger") +
      urdf_joint("left", "prismatic", "l5", "left_finger", slides) +
      urdf_joint("right", "prismatic", "l5", "right_finger", slides + "<mimic joint='left' multiplier='2'/>"));
}

TEST(LoadRobot, FingersStandWhereTheFileSays) {
  const auto at = [](const std::map<std::string, double>& locked) {
    const auto model = load_text(gripper(), [&](RobotSettings& settings) {
      settings.locked = locked;
      settings.bodies = {ball("left", "left_finger", Vector3::Zero(), 0.01),
                         ball("right", "right_finger", Vector3::Zero(), 0.01)};
    });
    EXPECT_TRUE(model) << model.error().message;
    EXPECT_EQ(model->dof(), 5) << "the arm ends where the fingers part ways";
    return *model;
  };
  const auto slid = [](const RobotModel& model, int body) {
    EXPECT_EQ(model.bodies[body].link, 5);
    const Eigen::Isometry3d joint = Eigen::Translation3d(0.3, 0.0, 0.0) * Eigen::AngleAxisd(1.2, Vector3::UnitX());
    return Vector3(joint.inverse() * model.bodies[body].origin.translation());
  };
  const RobotModel named = at({{"left", 0.015}}), silent = at({}), both = at({{"left", 0.015}, {"right", 0.04}});
  EXPECT_TRUE(slid(named, 0).isApprox(Vector3(0.0, 0.0, 0.015), 1e-9));
  EXPECT_TRUE(slid(named, 1).isApprox(Vector3(0.0, 0.0, 0.030), 1e-9)) << "it mimics";
  EXPECT_TRUE(named.assumptions.empty());
  EXPECT_TRUE(slid(both, 1).isApprox(Vector3(0.0, 0.0, 0.040), 1e-9));
  EXPECT_TRUE(slid(silent, 0).isApprox(Vector3(0.0, 0.0, 0.010), 1e-9)) << "the limit next to 0";
  ASSERT_EQ(silent.assumptions.size(), 1u);
  EXPECT_NE(silent.assumptions[0].find("assumed stationary: left at 0.01;"), std::string::npos)
      << silent.assumptions[0];
}

/// A branch of fewer joints is another arm, not a gripper; and a tool may be carried before the chain's end. The mount
/// moves all bodies; gravity still points down the base's z.
TEST(LoadRobot, AnArmMayHang) {
  const Eigen::Isometry3d mount =
      Eigen::Translation3d(0.3, -0.2, 1.5) * Eigen::AngleAxisd(2.5, Vector3(1, 2, 0.5).normalized());
  const auto load = [](const Eigen::Isometry3d& at) {
    const auto model = load_text(urdf_robot(urdf_serial_arm(4)), [&](RobotSettings& settings) {
      settings.mount = at;
      settings.bodies = {ball("on_root", "l0", {0.1, 0.2, 0.3}, 0.05), ball("on_arm", "l3", {0.1, 0.2, 0.3}, 0.05)};
    });
    EXPECT_TRUE(model) << model.error().message;
    return *model;
  };
  const RobotModel standing = load(Eigen::Isometry3d::Identity()), hanging = load(mount);
  Kinematics one(standing), other(hanging);
  const JointVector q = JointVector::LinSpaced(4, -1.0, 0.7);
  one.set_position(q);
  other.set_position(q);
  EXPECT_TRUE(other.p().isApprox(mount * one.p(), 1e-12));
  EXPECT_TRUE(other.R().isApprox(mount.linear() * one.R(), 1e-12));
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(other.body(i).p.isApprox(mount * one.body(i).p, 1e-12)) << i;
  other.set_motion(JointVector::Zero(4), JointVector::Zero(4));
  EXPECT_TRUE(other.local_acceleration().isApprox(other.R().transpose() * kGravity, 1e-12));
  EXPECT_NEAR(clearance(other), clearance(one), 1e-12);
  EXPECT_TRUE(hanging.mount.isApprox(mount));
}

TEST(LoadRobot, TheChainMayEndEarlier) {
  const auto two_arms =
      load_text(urdf_robot(urdf_serial_arm(3) + urdf_link("other") + urdf_joint("j", "revolute", "l1", "other")));
  ASSERT_TRUE(two_arms) << two_arms.error().message;
  EXPECT_EQ(two_arms->dof(), 3);
  EXPECT_EQ(two_arms->assumptions.size(), 1u);
  const auto short_arm = load_text(urdf_robot(urdf_serial_arm(3)), [](RobotSettings& s) { s.tools[0].link = "l2"; });
  ASSERT_TRUE(short_arm) << short_arm.error().message;
  EXPECT_EQ(short_arm->dof(), 2);
}

/// Its cables may limit how far it turns. urdfdom reads absent limits as 0.
TEST(LoadRobot, AContinuousJointHasTheLimitsThatTheUrdfGivesIt) {
  const auto limits = [](const std::string& range) {
    const auto model =
        load_text(one_joint("continuous", "<axis xyz='0 0 1'/><limit " + range + " velocity='2' effort='1'/>"));
    EXPECT_TRUE(model) << model.error().message;
    return std::pair(model->position_min[0], model->position_max[0]);
  };
  EXPECT_EQ(limits("lower='-6.28' upper='3'"), std::pair(-6.28, 3.0));
  EXPECT_EQ(limits(""), std::pair(-kContinuousLimit, kContinuousLimit));
  EXPECT_EQ(limits("lower='1' upper='-1'"), std::pair(-kContinuousLimit, kContinuousLimit));
}

TEST(LoadRobot, SoftLimitsAreThePositionLimitsAndAreReported) {
  const std::string text = one_joint(
      "revolute", kRevolute + "<safety_controller k_velocity='10' soft_lower_limit='-0.5' soft_upper_limit='9'/>");
  const auto model = load_text(text);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->position_min[0], -0.5);
  EXPECT_EQ(model->position_max[0], 3.0) << "<limit> is narrower";
  ASSERT_EQ(model->assumptions.size(), 1u);
  EXPECT_NE(model->assumptions[0].find("j1 -0.5 to 3 instead of -3 to 3 rad"), std::string::npos)
      << model->assumptions[0];
  const auto overridden = load_text(text, [](RobotSettings& settings) {
    settings.position_min = std::vector<double>{-2.0};
    settings.position_max = std::vector<double>{2.0};
  });
  ASSERT_TRUE(overridden) << overridden.error().message;
  EXPECT_EQ(overridden->position_min[0], -2.0);
  EXPECT_TRUE(overridden->assumptions.empty());
  const auto none = load_text(one_joint("revolute", kRevolute + "<safety_controller k_velocity='10'/>"));
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_EQ(none->position_min[0], -3.0);
}

TEST(LoadRobot, AGripperThatCountsAsAJointIsReported) {
  const std::string text =
      urdf_robot(urdf_serial_arm(5) + urdf_link("mover") + urdf_joint("jointGripper", "revolute", "l5", "mover"));
  const auto found = load_text(text);
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->assumptions.size(), 1u);
  EXPECT_NE(found->assumptions[0].find("'jointGripper' counts as joint 6 of the arm"), std::string::npos);
  EXPECT_NE(found->assumptions[0].find("--tip l5"), std::string::npos) << found->assumptions[0];
  const auto chosen = load_text(text, [](RobotSettings& settings) { settings.tools[0].link = "mover"; });
  ASSERT_TRUE(chosen) << chosen.error().message;
  EXPECT_TRUE(chosen->assumptions.empty()) << "the caller has chosen the end";
}

TEST(LoadRobot, DegreesAndMillimetresRaiseDoubts) {
  const auto doubts = [](const std::string& limit, double length) {
    std::string text =
        urdf_robot(urdf_serial_arm(2) + urdf_link("end") +
                   urdf_joint("last", "revolute", "l2", "end", "<axis xyz='0 0 1'/><limit effort='1' " + limit + "/>"));
    const std::size_t origin = text.rfind("0.3 0 0");
    const auto model = load_text(text.replace(origin, 7, fmt::format("{} 0 0", length)));
    EXPECT_TRUE(model) << model.error().message;
    std::string all;
    for (const std::string& doubt : doubts_about(*model)) all += doubt + "\n";
    return all;
  };
  const std::string fine = doubts("lower='-6.3' upper='6.3' velocity='3'", 0.3);
  EXPECT_EQ(fine.find("degrees or mm"), std::string::npos) << fine;
  EXPECT_EQ(fine.find("in mm"), std::string::npos) << fine;
  EXPECT_NE(doubts("lower='-170' upper='170' velocity='3'", 0.3).find("last -170 to 170 rad"), std::string::npos);
  EXPECT_NE(doubts("lower='-3' upper='3' velocity='180'", 0.3).find("last 180 rad/s"), std::string::npos);
  EXPECT_NE(doubts("lower='-3' upper='3' velocity='3'", 300).find("are 300.3 m apart in all"), std::string::npos);
}

/// A setting for the tools of urdf_two_arms, and joints on each side.
void hold_both(RobotSettings& settings, int left = 3, int right = 3) {
  settings.tools = tools_on(fmt::format("left_{},right_{}", left, right));
}

TEST(LoadRobot, TwoToolsMakeATree) {
  const std::string text = urdf_robot(urdf_two_arms(2, 3, 4));
  const auto mounted = [](RobotSettings& settings) {
    settings.mount.translation().z() = 0.7;
    settings.bodies = {ball("torso", "l2", Vector3::Zero(), 0.05), ball("hand", "right_4", Vector3::UnitX(), 0.05)};
  };
  const auto both = load_text(text, [&](RobotSettings& settings) {
    mounted(settings);
    hold_both(settings, 3, 4);
    settings.tools[1].gripper_time = 0.5;
  });
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_EQ(both->link_names, (std::vector<std::string>{"l0", "l1", "l2", "left_1", "left_2", "left_3", "right_1",
                                                        "right_2", "right_3", "right_4"}));
  EXPECT_EQ(both->parent(5), 2) << "right_1 begins at the torso";
  EXPECT_TRUE(both->assumptions.empty());
  EXPECT_EQ(both->bodies[1].link, 9);
  std::mt19937 random(1);
  Kinematics kinematics(*both);
  for (int tool = 0; tool < 2; ++tool) {
    const auto alone = load_text(text, [&](RobotSettings& settings) {
      mounted(settings);
      settings.tools[0].link = both->tools[tool].name;
    });
    ASSERT_TRUE(alone) << alone.error().message;
    Kinematics serial(*alone);
    const std::vector<int>& chain = kinematics.chain(tool);
    ASSERT_EQ(std::ssize(chain), alone->dof());
    const JointVector q = random_joints(both->dof(), 3.0, random);
    kinematics.set_position(q);
    serial.set_position(q(chain));
    EXPECT_TRUE(kinematics.p(tool).isApprox(serial.p(), 1e-12));
    EXPECT_TRUE(kinematics.R(tool).isApprox(serial.R(), 1e-12));
    EXPECT_TRUE(kinematics.body(0).p.isApprox(serial.body(0).p, 1e-12)) << "the torso moves with both";
    EXPECT_EQ(both->tools[tool].gripper_time.has_value(), tool == 1);
  }
}

TEST(LoadRobot, TakesNumbersByNameOfAJoint) {
  const auto model = load_text(urdf_robot(urdf_two_arms(1, 2, 2)), [](RobotSettings& settings) {
    hold_both(settings, 2, 2);
    settings.home = std::map<std::string, double>{{"j_right_1", 0.5}};
    settings.acceleration_max = std::map<std::string, double>{{"j1", 2.0}, {"j_left_2", 3.0}};
  });
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->home, JointVector::Unit(5, 3) * 0.5);
  JointVector accelerations = JointVector::Constant(5, kDefaultAcceleration);
  accelerations[0] = 2.0;
  accelerations[2] = 3.0;
  EXPECT_EQ(model->acceleration_max, accelerations);
}

/// Two arms with a ball on base and hand, `distance` m apart, with a table under both.
void stand_apart(double distance, RobotSettings& settings) {
  settings.bodies = {ball("base", "l0", Vector3::Zero(), 0.15), ball("hand", "l3", Vector3::Zero(), 0.1)};
  RobotSettings left = settings, right = settings;
  left.name = "left";
  right.name = "right";
  left.mount.translation().y() = distance;
  right.tools[0].gripper_time = 0.5;
  settings.name = "two";
  settings.bodies = {ball("table", kBaseLink, Vector3(0.0, 0.0, -5.0), 4.0)};
  settings.arms = {left, right};
}

TEST(LoadRobot, JoinsArmsOnOneBase) {
  const std::string text = urdf_robot(urdf_serial_arm(3));
  RobotModel arms[2];
  const auto both = load_text(text, [&](RobotSettings& settings) {
    stand_apart(1.0, settings);
    for (int i = 0; i < 2; ++i) arms[i] = *load_robot(settings.arms[i]);
  });
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_EQ(both->name, "two");
  EXPECT_EQ(both->link_names,
            (std::vector<std::string>{"world", "left_l1", "left_l2", "left_l3", "right_l1", "right_l2", "right_l3"}));
  EXPECT_EQ(both->joints[3].name, "right_j1");
  EXPECT_EQ(both->tools[1].name, "right");
  EXPECT_EQ(both->tools[1].gripper_time, 0.5);
  std::set<std::string> pairs;
  for (const auto& [i, j] : both->pairs) pairs.insert(both->bodies[i].name + " " + both->bodies[j].name);
  EXPECT_EQ(pairs, (std::set<std::string>{"left_base left_hand", "right_base right_hand", "left_base right_hand",
                                          "right_base left_hand", "left_hand right_hand", "table left_hand",
                                          "table right_hand"}));
  std::mt19937 random(2);
  const JointVector q = random_joints(6, 3.0, random);
  Kinematics kinematics(*both);
  kinematics.set_position(q);
  for (int tool = 0; tool < 2; ++tool) {
    Kinematics alone(arms[tool]);
    alone.set_position(q.segment(3 * tool, 3));
    EXPECT_TRUE(kinematics.p(tool).isApprox(alone.p(), 1e-12));
    EXPECT_TRUE(kinematics.body(2 + 2 * tool).p.isApprox(alone.body(1).p, 1e-12));
  }
}

struct Refusal {
  const char* name;
  std::string urdf;
  std::string message;  ///< a part of the error's message
  std::function<void(RobotSettings&)> change = {};
};

void PrintTo(const Refusal& refusal, std::ostream* stream) { *stream << refusal.name; }
std::string refusal_name(const testing::TestParamInfo<Refusal>& refusal) { return refusal.param.name; }

class LoadRobotRefuses : public testing::TestWithParam<Refusal> {};

TEST_P(LoadRobotRefuses, WithTheReason) {
  const Refusal& refusal = GetParam();
  const auto model = load_text(refusal.urdf, refusal.change);
  ASSERT_FALSE(model);
  EXPECT_NE(model.error().message.find(refusal.message), std::string::npos) << model.error().message;
}

std::string nested(int depth) {
  std::string open, close;
  for (int i = 0; i < depth; ++i) {
    open += "<x>";
    close += "</x>";
  }
  return urdf_robot(open + close);
}

std::string mesh_on_link(const std::string& use, const std::string& name) {
  return urdf_robot(
      urdf_serial_arm(1) +
      urdf_link("cover", fmt::format("<{0}><geometry><mesh filename='{1}'/></geometry></{0}>", use, name)) +
      urdf_joint("screws", "fixed", "l1", "cover", ""));
}

INSTANTIATE_TEST_SUITE_P(
    Urdf, LoadRobotRefuses,
    testing::Values(
        Refusal{"missing_file", urdf_robot(""), "no such file", [](auto& s) { s.urdf = "there/is/no.urdf"; }},
        Refusal{"folder", urdf_robot(""), "is not a file", [](auto& s) { s.urdf = s.urdf.parent_path(); }},
        Refusal{"empty", "", "is empty"}, Refusal{"blank", " \n\t\n", "is empty"},
        Refusal{"no_xml", "joints: 6", "not a usable URDF"},
        Refusal{"other_xml", "<html><body/></html>", "not a usable URDF"},
        Refusal{"truncated", urdf_robot(urdf_serial_arm(2)).substr(0, 300), "not a usable URDF"},
        Refusal{"nested", nested(100000), "element depth exceeded"},
        Refusal{"no_links", urdf_robot(""), "not a usable URDF"},
        Refusal{"two_roots", urdf_robot(urdf_serial_arm(2) + urdf_link("stray")), "not a usable URDF"},
        Refusal{"unknown_parent", urdf_robot(urdf_link("l1") + urdf_joint("j1", "revolute", "nowhere", "l1")),
                "not a usable URDF"},
        Refusal{"same_joint_twice",
                urdf_robot(urdf_serial_arm(2) + urdf_link("l3") + urdf_joint("j2", "fixed", "l2", "l3")),
                "not a usable URDF"},
        Refusal{"loop_without_root",
                urdf_robot(urdf_link("a") + urdf_link("b") + urdf_joint("ab", "revolute", "a", "b") +
                           urdf_joint("ba", "revolute", "b", "a")),
                "no loop"},
        Refusal{"loop_with_two_parents", urdf_robot(urdf_serial_arm(3) + urdf_joint("extra", "revolute", "l0", "l3")),
                "link 'l3' is the child of two joints, 'extra' and 'j3': the links form a loop"},
        Refusal{"loop_back", urdf_robot(urdf_serial_arm(3) + urdf_joint("extra", "revolute", "l3", "l1")),
                "link 'l1' is the child of two joints"},
        Refusal{"loop_aside",
                urdf_robot(urdf_serial_arm(2) + urdf_link("a") + urdf_link("b") + urdf_joint("ab", "fixed", "a", "b") +
                           urdf_joint("ba", "fixed", "b", "a")),
                "loop of joints"},
        Refusal{"joint_on_itself",
                urdf_robot(urdf_serial_arm(2) + urdf_link("a") + urdf_joint("aa", "fixed", "a", "a")),
                "loop of joints"},
        Refusal{"no_moving_joint", one_joint("fixed", ""), "has 0 moving joints; an arm has 1 to 16"},
        Refusal{"too_many_joints", urdf_robot(urdf_serial_arm(17)), "has 17 moving joints; an arm has 1 to 16"},
        Refusal{"floating", one_joint("floating", ""), "joint 'j1' is floating"},
        Refusal{"planar", one_joint("planar", "<axis xyz='0 0 1'/>"), "joint 'j1' is planar"},
        Refusal{"mimic", one_joint("revolute", kRevolute + "<mimic joint='other'/>"), "mimics 'other'"},
        Refusal{"locked_unknown", gripper(),
                "locked joint 'grip' is not a joint of the URDF; the movable joints outside the chain are: left, right",
                [](auto& s) { s.locked = {{"grip", 0.0}}; }},
        Refusal{"locked_on_the_chain", gripper(), "locked joint 'j2' is on the chain to the tool",
                [](auto& s) { s.locked = {{"j2", 0.0}}; }},
        Refusal{"locked_beyond", gripper(), "locked joint 'left' is at 0.09; it goes from 0.01 to 0.04",
                [](auto& s) { s.locked = {{"left", 0.09}}; }},
        Refusal{"locked_nan", gripper(), "locked joint 'left' is at nan",
                [](auto& s) { s.locked = {{"left", std::nan("")}}; }},
        Refusal{"unknown_tool_link", urdf_robot(urdf_serial_arm(2)),
                "no link 'hand' to carry the tool; known: l0, l1, l2", [](auto& s) { s.tools[0].link = "hand"; }},
        Refusal{"misspelt_tool_link", urdf_robot(urdf_serial_arm(2)),
                "no link 'L2' to carry the tool; did you mean 'l2'? (known: l0, l1, l2)",
                [](auto& s) { s.tools[0].link = "L2"; }},
        Refusal{"zero_axis",
                one_joint("revolute", "<axis xyz='0 0 0'/><limit lower='-3' upper='3' velocity='2' effort='1'/>"),
                "it must have length 1"},
        Refusal{"long_axis",
                one_joint("revolute", "<axis xyz='0 0 2'/><limit lower='-3' upper='3' velocity='2' effort='1'/>"),
                "has axis [0, 0, 2] of length 2"},
        Refusal{"nan_limit",
                one_joint("revolute", "<axis xyz='0 0 1'/><limit lower='nan' upper='3' velocity='2' effort='1'/>"),
                "not a usable URDF"},
        Refusal{
            "infinite_origin",
            urdf_robot(
                urdf_link("l0") + urdf_link("l1") +
                "<joint name='j1' type='fixed'><parent link='l0'/><child link='l1'/><origin xyz='1e999 0 0'/></joint>"),
            "not a usable URDF"},
        Refusal{"no_limit", one_joint("revolute", "<axis xyz='0 0 1'/>"), "not a usable URDF"},
        Refusal{"no_position_limit", one_joint("revolute", "<axis xyz='0 0 1'/><limit velocity='2' effort='1'/>"),
                "joint 'j1' may move from 0 to 0 rad"},
        Refusal{"continuous_without_velocity", one_joint("continuous", "<axis xyz='0 0 1'/>"),
                "joint 'j1' has no limit velocity_max"},
        Refusal{"limits_crossed",
                one_joint("revolute", "<axis xyz='0 0 1'/><limit lower='2' upper='1' velocity='2' effort='1'/>"),
                "joint 'j1' may move from 2 to 1 rad; the lower limit must be below"},
        Refusal{"no_speed",
                one_joint("revolute", "<axis xyz='0 0 1'/><limit lower='-1' upper='1' velocity='0' effort='1'/>"),
                "velocity_max[0] of joint 'j1' is 0; it must be positive"},
        Refusal{"missing_visual", mesh_on_link("visual", "meshes/no.stl"),
                "the visual mesh 'meshes/no.stl' of link 'cover'"},
        Refusal{"missing_collision", mesh_on_link("collision", "package://pkg/no.stl"), "the collision mesh"},
        Refusal{"mesh_from_the_net", mesh_on_link("visual", "http://example.org/a.stl"), "does not exist"}),
    refusal_name);

INSTANTIATE_TEST_SUITE_P(
    Settings, LoadRobotRefuses,
    testing::Values(
        Refusal{"home_size", urdf_robot(urdf_serial_arm(2)), "home has 3 numbers; the arm has 2 joints",
                [](auto& s) { s.home = std::vector<double>{0, 0, 0}; }},
        Refusal{"home_outside", urdf_robot(urdf_serial_arm(2)), "home[1] = 3.5 rad is outside the limits -3 to 3",
                [](auto& s) { s.home = std::vector<double>{0, 3.5}; }},
        Refusal{"home_nan", urdf_robot(urdf_serial_arm(2)), "home[0] of joint 'j1' is nan",
                [](auto& s) { s.home = std::vector<double>{NAN, 0}; }},
        Refusal{"acceleration_negative", urdf_robot(urdf_serial_arm(2)), "acceleration_max[1] of joint 'j2' is -1",
                [](auto& s) { s.acceleration_max = std::vector<double>{1, -1}; }},
        Refusal{"velocity_infinite", urdf_robot(urdf_serial_arm(2)), "velocity_max[0] of joint 'j1' is inf",
                [](auto& s) { s.velocity_max = std::vector<double>{INFINITY, 1}; }},
        Refusal{"tool_nan", urdf_robot(urdf_serial_arm(2)), "tool 'tool''s origin",
                [](auto& s) { s.tools[0].origin.translation().x() = NAN; }},
        Refusal{"tool_skewed", urdf_robot(urdf_serial_arm(2)), "not a rotation",
                [](auto& s) { s.tools[0].origin.linear()(0, 0) = 2.0; }},
        Refusal{"body_link", urdf_robot(urdf_serial_arm(2)), "body 'a' is on link 'nowhere'",
                [](auto& s) { s.bodies = {ball("a", "nowhere", Vector3::Zero(), 0.1)}; }},
        Refusal{"body_radius", urdf_robot(urdf_serial_arm(2)), "body 'a': the radius is 0 m",
                [](auto& s) { s.bodies = {ball("a", "l0", Vector3::Zero(), 0.0)}; }},
        Refusal{"body_center", urdf_robot(urdf_serial_arm(2)), "body 'a''s origin",
                [](auto& s) { s.bodies = {ball("a", "l0", Vector3(NAN, 0, 0), 0.1)}; }},
        Refusal{"tool_twice", urdf_robot(urdf_two_arms(1, 3, 3)),
                "two tools are called 'hand'; each needs another name",
                [](auto& s) {
                  hold_both(s);
                  s.tools[0].name = s.tools[1].name = "hand";
                }},
        Refusal{"tools_on_one_chain", urdf_robot(urdf_serial_arm(3)),
                "the tools on links 'l2' and 'l3' are on one chain: every joint that moves the first",
                [](auto& s) { s.tools = tools_on("l3,l2"); }},
        Refusal{"tools_on_one_link", urdf_robot(urdf_serial_arm(3)),
                "the tools on links 'l3' and 'l3' are on one chain", [](auto& s) { s.tools = tools_on("l3,l3"); }},
        Refusal{"tool_on_base", urdf_robot(urdf_serial_arm(3)), "no joint moves link 'l0', which is to carry a tool",
                [](auto& s) { s.tools = tools_on("l3,l0"); }},
        Refusal{"three_tools", urdf_robot(urdf_two_arms(1, 3, 3)), "has 3 tools; it must have 1 to 2",
                [](auto& s) { s.tools = tools_on("left_3,right_3,l1"); }},
        Refusal{"arms_of_too_many_joints", urdf_robot(urdf_two_arms(1, 8, 8)),
                "the chain from 'l0' to 'left_8' and 'right_8' has 17 moving joints; an arm has 1 to 16",
                [](auto& s) { hold_both(s, 8, 8); }},
        Refusal{"home_of_no_joint", urdf_robot(urdf_serial_arm(2)),
                "home names joint 'J1', which does not move a tool; did you mean 'j1'?",
                [](auto& s) { s.home = std::map<std::string, double>{{"J1", 0.0}}; }},
        Refusal{"joined_joints", urdf_robot(urdf_serial_arm(9)),
                "robot 'two': the arms have 18 joints together; at most 16 are possible",
                [](auto& s) { stand_apart(3.0, s); }},
        Refusal{"one_arm", urdf_robot(urdf_serial_arm(3)), "robot 'two': it must have 2 arms, not 1",
                [](auto& s) {
                  stand_apart(1.0, s);
                  s.arms.pop_back();
                }},
        Refusal{"arm_of_two_tools", urdf_robot(urdf_two_arms(1, 3, 3)), "arm 'left' has 2 tools",
                [](auto& s) {
                  hold_both(s);
                  stand_apart(1.0, s);
                  for (auto& arm : s.arms) arm.bodies.clear();
                }},
        Refusal{"arms_collide", urdf_robot(urdf_serial_arm(3)),
                "bodies 'left_base' and 'right_base' overlap by 250.0 mm; choose other mounts or home",
                [](auto& s) { stand_apart(0.05, s); }},
        Refusal{"arm_in_table", urdf_robot(urdf_serial_arm(3)), "bodies 'table' and 'right_hand' overlap by",
                [](auto& s) {
                  stand_apart(1.0, s);
                  s.bodies[0].shape.radius = 5.0;
                }},
        Refusal{"table_on_an_arm", urdf_robot(urdf_serial_arm(3)),
                "body 'table' is on link 'l1'; those next to arms are on link 'world'",
                [](auto& s) {
                  stand_apart(1.0, s);
                  s.bodies[0].link = "l1";
                }},
        Refusal{
            "body_twice", urdf_robot(urdf_serial_arm(2)), "two bodies are called 'a'",
            [](auto& s) { s.bodies = {ball("a", "l0", Vector3::Zero(), 0.1), ball("a", "l2", Vector3::Zero(), 0.1)}; }},
        Refusal{"pair_unknown", urdf_robot(urdf_serial_arm(2)), "pair [a, b]: there is no body 'b'",
                [](auto& s) {
                  s.bodies = {ball("a", "l0", Vector3::Zero(), 0.1)};
                  s.pairs = {{{"a", "b"}}};
                }},
        Refusal{"pair_on_one_link", urdf_robot(urdf_serial_arm(2)), "both bodies are on one link, 'l0'",
                [](auto& s) {
                  s.bodies = {ball("a", "l0", Vector3::Zero(), 0.1), ball("b", "l0", Vector3::UnitX(), 0.1)};
                  s.pairs = {{{"a", "b"}}};
                }},
        Refusal{"home_in_collision", urdf_robot(urdf_serial_arm(3)), "bodies 'a' and 'b' overlap by 50.0 mm",
                [](auto& s) {
                  s.home = std::vector<double>{0.0, 0.0, 0.0};
                  // Both on the axis of the last joint, 0.15 m apart, so only the radii decide.
                  s.bodies = {ball("a", "l0", Vector3(0.3, 0.0, 0.0), 0.1),
                              ball("b", "l1", Vector3(0.15, 0.0, 0.0), 0.1)};
                  s.pairs = {{{"a", "b"}}};
                }}),
    refusal_name);

}  // namespace
}  // namespace steadyhand

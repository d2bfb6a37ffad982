#include "steadyhand/arms/mujoco/mujoco_arm.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "steadyhand/arms/mujoco/scene_model.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/robot_file.hpp"
#include "steadyhand/files/config/task_file.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "support/allocation_guard.hpp"
#include "support/manual_clock.hpp"
#include "support/temporary_folder.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

[[maybe_unused]] const Status loaded = load_mujoco(Places::standard().packages);
constexpr int kContacts = 8;

struct OnUr5e : testing::Test {
  OnUr5e() : model(*open_robot("ur5e")), dynamics(*open_dynamics("ur5e")), task(*open_task("carry")) {}

  /// Returns the arm once it follows, stationary over the table.
  std::unique_ptr<MujocoArm> following(const MujocoSettings& settings) {
    auto made = MujocoArm::make(model, dynamics, {}, task, settings, clock);
    EXPECT_TRUE(made) << made.error().message;
    std::unique_ptr<MujocoArm> arm = *std::move(made);
    while ((state = arm->receive()).status != ArmStatus::kFollowing) {
    }
    begin = state.joints.stamp.made;
    q0 = state.joints.q;
    return arm;
  }
  /// Turns the shoulder by `angle` (rad) and back to where it began, within 2 s each, as cosines; ends at `until`, s.
  void lean(MujocoArm& arm, double angle, double until) {
    while (to_seconds(state.joints.stamp.made - begin) < until) {
      const double t = std::min(4.0, to_seconds(state.joints.stamp.made - begin));
      JointCommand c{{state.joints.stamp.made, state.joints.stamp.made}, q0, 0.0 * q0, 0.0 * q0};
      c.q[1] += 0.5 * angle * (1.0 - std::cos(0.5 * M_PI * t));
      c.dq[1] = t < 4.0 ? 0.25 * M_PI * angle * std::sin(0.5 * M_PI * t) : 0.0;
      c.ddq[1] = t < 4.0 ? 0.125 * M_PI * M_PI * angle * std::cos(0.5 * M_PI * t) : 0.0;
      arm.send(c);
      state = arm.receive();
      ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
      most_force = std::max(most_force, arm.contact_force());
      if (std::abs(t - 2.0) < 0.003) pressing = arm.contact_force();
      most_behind = std::max(most_behind, (state.joints.q - c.q).cwiseAbs().maxCoeff());
    }
  }

  RobotModel model;
  ChainDynamics dynamics;
  Task task;
  ManualClock clock;
  ArmState state;
  Time begin{0};
  JointVector q0;
  double most_force = 0.0, pressing = 0.0;  // N, the latter at 2 s, when the commands stand
  double most_behind = 0.0;                 // rad, of all joints
};

TEST_F(OnUr5e, HasTheMassesAndTorquesOfItsUrdf) {
  double mass = 0.0;
  for (int k = 1; k <= 6; ++k) mass += dynamics.links[k].mass;
  EXPECT_NEAR(mass, 3.7 + 8.393 + 2.275 + 1.219 + 1.219 + 0.1879, 1e-9);
  EXPECT_EQ(dynamics.effort_max[0], 150.0);
  EXPECT_EQ(dynamics.effort_max[5], 28.0);
  const Result<SceneModel> scene = make_scene_model(model, dynamics, {}, task, 0.001);
  ASSERT_TRUE(scene) << scene.error().message;
  const double held = 0.8 + 0.1 + 0.546;  // of tasks/tools/glass.xml
  EXPECT_NEAR(scene->model->body_subtreemass[mujoco().mj_name2id(scene->model.get(), mjOBJ_BODY, "arm/base")],
              mass + held, 1e-9);
}

TEST_F(OnUr5e, StandsAndFollowsCloselyWhereNothingIsInTheWay) {
  const auto arm = following({});
  lean(*arm, -0.3, 4.0);
  EXPECT_LT((state.joints.q - q0).cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_LT(most_behind, 0.01);
  EXPECT_EQ(most_force, 0.0);
}

/// The commands move the glass 0.1 m or more into the table, and out again.
TEST_F(OnUr5e, YieldsOrPushesWhereTheTableIsInTheWay) {
  double force[2];
  for (const bool yields : {true, false}) {
    MujocoSettings settings;
    settings.contact = yields ? ContactPolicy::kYield : ContactPolicy::kPush;
    most_behind = 0.0;
    const auto arm = following(settings);
    lean(*arm, 0.9, 5.5);
    force[yields] = pressing;
    EXPECT_GT(most_behind, 0.1) << "the table is not in the way";
    EXPECT_LT((state.joints.q - q0).cwiseAbs().maxCoeff(), 5e-3) << "it comes back to where its commands lead";
  }
  EXPECT_GT(force[true], 5.0);
  EXPECT_LT(force[true], 0.1 * 150.0 / 0.5);  // the shoulder's torque, as a force at the glass
  EXPECT_GT(force[false], 2.0 * force[true]);
}

/// The arm's own stop: it holds its present position, not that of its last command, 0.1 m inside the table.
TEST_F(OnUr5e, DoesNotPressOnOnceItStopsByItself) {
  MujocoSettings settings;
  settings.contact = ContactPolicy::kPush;
  const auto arm = following(settings);
  lean(*arm, 0.9, 2.0);
  ASSERT_GT(pressing, 100.0);
  for (int i = 0; i < 500; ++i) state = arm->receive();
  EXPECT_EQ(state.reason, "no command arrived in time");
  EXPECT_LT(arm->contact_force(), 0.1 * pressing);
}

/// A session whose hand moves the glass down into the table, fast or slowly; the planner does not know the table.
TEST(Contact, StopsTheArmAndDoesNotPressOn) {
  const Task task = *open_task("carry");
  const ChainDynamics dynamics = *open_dynamics("ur5e");
  std::mt19937 random(4);
  std::uniform_real_distribution<double> draw(-1.0, 1.0);
  for (int hand = 0; hand < kContacts; ++hand) {
    MujocoArm* arm = nullptr;
    VirtualSession::Options options;
    options.profile = hand % 2 == 0 ? "tracking" : "carry";
    options.make_arm = [&](Clock& clock) {
      auto made = MujocoArm::make(ur5e(), dynamics, {}, task, {}, clock);
      EXPECT_TRUE(made) << made.error().message;
      arm = made->get();
      return *std::move(made);
    };
    VirtualSession session(options);
    const double x = draw(random), y = draw(random), speed = 0.3 + 0.2 * draw(random);  // m/s
    const Vector3 way(0.2 * x, 0.2 * y, -1.0);
    ASSERT_TRUE(session.run_until([&] { return session.state() == SupervisionState::kReady; }, 1.0));
    ASSERT_TRUE(session.grip());
    const double begin = session.now();
    session.hand = [=](double t) { return Pose{std::clamp(t - begin, 0.0, 1.0 / speed) * speed * way, {1, 0, 0, 0}}; };
    ASSERT_TRUE(session.run_until([&] { return session.state() == SupervisionState::kStopping; }, 4.0)) << hand;
    EXPECT_EQ(session.view.reason, "the arm is not at its commanded position");
    double most = 0.0, pressing = 0.0;  // rad, N
    session.run(1.0);
    for (int i = 0; i < 30; ++i) {
      session.run(0.1);
      most = std::max(most, (session.last_command.q - session.view.measured.q).cwiseAbs().maxCoeff());
      pressing = std::max(pressing, arm->contact_force());
    }
    EXPECT_LT(most, 0.002) << "rad from what is commanded to what is measured, hand " << hand;
    EXPECT_LT(pressing, 10.0) << "N, hand " << hand;
    session.ask_reset();
    EXPECT_TRUE(session.run_until([&] { return session.state() == SupervisionState::kReady; }, 1.0));
  }
}

TEST_F(OnUr5e, DoesTheSameAgainAndAllocatesNothing) {
  JointVector q[2];
  for (JointVector& end : q) {
    ManualClock own;
    MujocoSettings settings;
    settings.contact = ContactPolicy::kYield;
    auto arm = *MujocoArm::make(model, dynamics, {}, task, settings, own);
    for (int i = 0; i < 100; ++i) state = arm->receive();
    const AllocationGuard guard;
    for (int i = 0; i < 500; ++i) {
      JointCommand c{state.joints.stamp, model.home, 0.0 * model.home, 0.0 * model.home};
      arm->send(c);
      state = arm->receive();
    }
    EXPECT_EQ(guard.count(), 0u);
    end = state.joints.q;
  }
  EXPECT_EQ((q[0] - q[1]).norm(), 0.0);
}

TEST_F(OnUr5e, PutsThingsWhereTheSeedSays) {
  const auto arm = following({});
  SceneState before, after;
  ASSERT_TRUE(arm->read_scene(before));
  ASSERT_TRUE(arm->set_up(7));
  state = arm->receive();
  ASSERT_TRUE(arm->read_scene(after));
  EXPECT_EQ(after.reset, before.reset + 1);
  const int mark = *task.find("mark");
  EXPECT_EQ(after.thing[mark].X_base_thing.p, (*draw_places(task, 7))[0].p);
  EXPECT_NE(after.thing[mark].X_base_thing.p, before.thing[mark].X_base_thing.p);
}

TEST_F(OnUr5e, RefusesTasksThatTheirFilesDoNotFit) {
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder.path() / name) << text;
    return (folder.path() / name).string();
  };
  const auto refusal = [&](const Task& bad_task) {
    const Result<SceneModel> made = make_scene_model(model, dynamics, {}, bad_task, 0.001);
    return made ? std::string() : made.error().message;
  };
  Task bad = task;
  bad.scene = (folder.path() / "none.xml").string();
  EXPECT_NE(refusal(bad).find("none.xml: no such file"), std::string::npos) << refusal(bad);
  bad.scene = write("text.xml", "no MJCF");
  EXPECT_NE(refusal(bad).find("text.xml: MuJoCo reports: "), std::string::npos) << refusal(bad);
  bad.scene = write("cut.xml", "<mujoco><worldbody><body name=\"mark\">");
  EXPECT_NE(refusal(bad).find("cut.xml: MuJoCo reports: "), std::string::npos) << refusal(bad);
  bad.scene = write("bare.xml", "<mujoco/>");
  EXPECT_NE(refusal(bad).find("task 'carry' names 'mark'; "), std::string::npos) << refusal(bad);
  bad.scene = write("fixed.xml", "<mujoco><worldbody><body name=\"mark\"/><body name=\"table\"/></worldbody></mujoco>");
  EXPECT_NE(refusal(bad).find("places 'mark', which in "), std::string::npos) << refusal(bad);
  bad = task;
  bad.tool = write("tool.xml", "<mujoco><worldbody><body name=\"hand\"/></worldbody></mujoco>");
  EXPECT_NE(refusal(bad).find("tool.xml: has no body named 'tool'"), std::string::npos) << refusal(bad);
  bad = task;
  bad.stands_for.push_back("tail");
  EXPECT_NE(refusal(bad).find("uses body 'tail' of ur5e"), std::string::npos) << refusal(bad);
  bad = task;
  bad.keeps_off[0].geom = "chair";
  const auto objects = kept_off(bad);
  ASSERT_FALSE(objects);
  EXPECT_NE(objects.error().message.find("forbids contact with geom 'chair', which "), std::string::npos);
}

/// A tree of joints, whose tools have the same geometry.
TEST(TwoArmsInOneScene, MoveAndCloseTheirGrippersByThemselves) {
  const RobotModel model = *open_robot("two_ur5e");
  Task task;
  task.tool = open_task("stack")->tool;
  ManualClock clock;
  auto made = MujocoArm::make(model, *open_dynamics("two_ur5e"), {}, task, {}, clock);
  ASSERT_TRUE(made) << made.error().message;
  MujocoArm& arm = **made;
  ASSERT_EQ(arm.info().gripper, (PerTool<bool>{true, true}));
  ArmState state;
  while ((state = arm.receive()).status != ArmStatus::kFollowing) {
  }
  const Time begin = state.joints.stamp.made;
  const auto way = [&](Time now) { return 0.15 * (1.0 - std::cos(2.0 * to_seconds(now - begin))); };
  JointVector q = model.home;
  for (int i = 0; i < 500; ++i) {
    const Time now = state.joints.stamp.made;
    const double t = to_seconds(now - begin);
    q.tail(6) = model.home.tail(6).array() + way(now);
    JointCommand command{state.joints.stamp, q, 0.0 * q, 0.0 * q};
    command.dq.tail(6).setConstant(0.3 * std::sin(2.0 * t));
    command.gripper = {1.0, 0.0};
    arm.send(command);
    state = arm.receive();
  }
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  const Time then = state.joints.stamp.made - from_seconds(arm.info().delay);
  EXPECT_LT((state.joints.q - model.home).head(6).norm(), 2e-3) << "the left arm stays";
  EXPECT_LT(((state.joints.q - model.home).tail(6).array() - way(then)).abs().maxCoeff(), 5e-3);
  EXPECT_NEAR(*state.joints.gripper[0], 1.0, 0.05);
  EXPECT_NEAR(*state.joints.gripper[1], 0.0, 0.05);
  const SceneModel& scene = arm.scene_model();
  Kinematics kinematics(model);
  kinematics.set_position(model.home);
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mujoco().mj_makeData(scene.model.get()),
                                                        mujoco().mj_deleteData);
  for (int k = 0; k < model.dof(); ++k) data->qpos[scene.position[k]] = model.home[k];
  mujoco().mj_kinematics(scene.model.get(), data.get());
  for (int i = 0; i < 2; ++i) {
    const Eigen::Map<const Vector3> p(data->xpos + 3 * scene.tool[i]);
    EXPECT_LT((p - kinematics.p(i)).norm(), 1e-9) << model.tools[i].name;
  }
}

TEST(Robotiq2f85, ClosesAndOpensInItsTimeAndPadsStayParallel) {
  const RobotModel model = *open_robot("ur5e_gripper");
  const Task task = *open_task("stack");
  ManualClock clock;
  auto arm = *MujocoArm::make(model, *open_dynamics("ur5e_gripper"), {}, task, {}, clock);
  ASSERT_TRUE(arm->info().gripper[0]);
  ArmState state;
  while ((state = arm->receive()).status != ArmStatus::kFollowing) {
  }
  EXPECT_NEAR(*state.joints.gripper[0], 0.0, 0.02);
  JointCommand command{state.joints.stamp, model.home, 0.0 * model.home, 0.0 * model.home};
  const auto goes_to = [&](double wish, double duration) {
    for (int i = 0; i < static_cast<int>(500.0 * duration); ++i) {
      command.stamp = state.joints.stamp;
      command.gripper[0] = wish;
      arm->send(command);
      state = arm->receive();
    }
    return *state.joints.gripper[0];
  };
  EXPECT_NEAR(goes_to(1.0, 0.5 * *model.tool().gripper_time), 0.5, 0.15);
  EXPECT_NEAR(goes_to(1.0, *model.tool().gripper_time), 1.0, 0.05);
  EXPECT_NEAR(goes_to(0.25, *model.tool().gripper_time), 0.25, 0.05);
  EXPECT_NEAR(goes_to(0.0, *model.tool().gripper_time), 0.0, 0.05);
}

/// As the URDF has it that the tool's file names: where its mimic joints have the pads.
TEST(Robotiq2f85, OpensBySome86Millimetres) {
  const RobotModel model = *open_robot("ur5e_gripper");
  const Task task = *open_task("stack");
  const Result<SceneModel> scene = make_scene_model(model, *open_dynamics("ur5e_gripper"), {}, task, 0.001);
  ASSERT_TRUE(scene) << scene.error().message;
  const mjModel* m = scene->model.get();
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mujoco().mj_makeData(m), mujoco().mj_deleteData);
  const auto gap_at = [&](double angle) {
    for (const char* name : {"right_knuckle", "left_knuckle"}) {
      data->qpos[m->jnt_qposadr[mujoco().mj_name2id(m, mjOBJ_JOINT, name)]] = angle;
    }
    for (const char* name : {"right_finger", "left_finger"}) {
      data->qpos[m->jnt_qposadr[mujoco().mj_name2id(m, mjOBJ_JOINT, name)]] = -angle;
    }
    mujoco().mj_kinematics(m, data.get());
    std::array<Vector3, 2> pads;
    for (int i = 0; i < 2; ++i) {
      const int body = mujoco().mj_name2id(m, mjOBJ_BODY, kFingers[i]);
      const int pad = m->body_geomadr[body] + m->body_geomnum[body] - 1;
      pads[i] = Eigen::Map<const Vector3>(data->geom_xpos + 3 * pad);
    }
    return (pads[0] - pads[1]).norm() - 2.0 * 0.003175;
  };
  EXPECT_NEAR(gap_at(0.0), 0.086, 0.001);
  EXPECT_NEAR(gap_at(0.8), 0.0015, 0.001);
}

TEST_F(OnUr5e, KeepsOffWhatTheTaskSays) {
  const auto objects = kept_off(task);
  ASSERT_TRUE(objects) << objects.error().message;
  ASSERT_EQ(objects->size(), 1u);
  EXPECT_EQ((*objects)[0].name, "table");
  EXPECT_EQ((*objects)[0].shape.kind, ShapeKind::kBox);
  EXPECT_NEAR((*objects)[0].origin.translation().z(), 0.05, 1e-12);
}

}  // namespace
}  // namespace steadyhand

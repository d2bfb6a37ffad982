// How MoveIt's messages change a cell.
#include <gtest/gtest.h>

#include <ctime>
#include <deque>
#include <limits>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ros2/moveit_scene_messages.hpp"
#include "steadyhand/arms/ros2/ros2_bridge.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/lockstep.hpp"

namespace steadyhand {
namespace {

using PoseMessage = geometry_msgs_msg_dds__Pose_;
using Primitive = shape_msgs_msg_dds__SolidPrimitive_;

/// Messages whose parts live as long as it does.
class Maker {
 public:
  char* text(const std::string& value) { return texts_.emplace_back(value).data(); }
  Primitive primitive(std::uint8_t type, std::vector<double> sizes) {
    Primitive result{};
    result.type = type;
    result.dimensions = sequence_of<decltype(result.dimensions)>(numbers_.emplace_back(std::move(sizes)));
    return result;
  }
  CollisionObjectMessage object(const std::string& id, const PoseMessage& pose, std::vector<Primitive> shapes,
                                std::vector<PoseMessage> poses = {}, std::uint8_t operation = 0) {
    CollisionObjectMessage result{};
    result.header.frame_id = text("");
    result.id = text(id);
    result.type = {text(""), text("")};
    result.pose = pose;
    result.primitives = sequence_of<decltype(result.primitives)>(shapes_.emplace_back(std::move(shapes)));
    result.primitive_poses = sequence_of<decltype(result.primitive_poses)>(poses_.emplace_back(std::move(poses)));
    result.operation = operation;
    return result;
  }
  AttachedObjectMessage attached(const std::string& link, const CollisionObjectMessage& object,
                                 std::vector<std::string> touch = {}) {
    AttachedObjectMessage result{};
    result.link_name = text(link);
    result.object = object;
    std::vector<char*>& names = names_.emplace_back();
    for (const std::string& name : touch) names.push_back(text(name));
    result.touch_links = sequence_of<decltype(result.touch_links)>(names);
    result.detach_posture.header.frame_id = text("");
    return result;
  }
  PlanningSceneMessage scene(std::vector<CollisionObjectMessage> objects, bool is_diff) {
    PlanningSceneMessage result{};
    for (char** name :
         {&result.name, &result.robot_model_name, &result.robot_state.joint_state.header.frame_id,
          &result.robot_state.multi_dof_joint_state.header.frame_id, &result.world.octomap.header.frame_id,
          &result.world.octomap.octomap.header.frame_id, &result.world.octomap.octomap.id}) {
      *name = text("");
    }
    result.world.collision_objects =
        sequence_of<decltype(result.world.collision_objects)>(objects_.emplace_back(std::move(objects)));
    result.is_diff = is_diff;
    return result;
  }

 private:
  std::deque<std::string> texts_;
  std::deque<std::vector<double>> numbers_;
  std::deque<std::vector<Primitive>> shapes_;
  std::deque<std::vector<PoseMessage>> poses_;
  std::deque<std::vector<char*>> names_;
  std::deque<std::vector<CollisionObjectMessage>> objects_;
};

PoseMessage at(double x, double y, double z) { return {{x, y, z}, {0.0, 0.0, 0.0, 1.0}}; }
constexpr std::uint8_t kBox = 1, kSphere = 2, kCylinder = 3, kCone = 4, kPrism = 5;
constexpr std::uint8_t kRemove = 1, kAppend = 2, kMove = 3;

struct MoveItScene : testing::Test, Maker {
  MoveItScene() : model(mounted()), arm(model), keeper(model, "left_") {
    arm.set_position(model.home);
    CellObject table;
    table.name = "table";
    table.shape = Shape::half_space();
    table.origin = Eigen::Translation3d(0.0, 0.0, -3.0) * Eigen::Isometry3d::Identity();
    cell = {"cell", {table}};
  }
  static RobotModel mounted() {
    std::mt19937 random(2);
    RobotModel model = random_arm(6, random, false);
    for (std::size_t i = 0; i < model.link_names.size(); ++i) model.link_names[i] = "link_" + std::to_string(i);
    model.mount = Eigen::Translation3d(0.1, 0.2, 0.3) * Eigen::AngleAxisd(0.7, Vector3::UnitX());
    return model;
  }
  /// Applies the message. Returns why it is refused; empty: accepted.
  template <typename Message>
  std::string take(const Message& message) {
    const Result<SceneChange> change = read(message);
    if (!change) return change.error().message;
    const Result<Cell> changed = keeper.apply(*change, cell, arm);
    if (!changed) return changed.error().message;
    cell = *changed;
    return "";
  }
  std::vector<std::string> names() {
    std::vector<std::string> result;
    for (const CellObject& object : cell.objects) result.push_back(object.name);
    return result;
  }
  const CellObject& placed(const std::string& name) {
    return *std::find_if(cell.objects.begin(), cell.objects.end(), [&](const auto& o) { return o.name == name; });
  }
  using Names = std::vector<std::string>;

  RobotModel model;
  Kinematics arm;
  SceneKeeper keeper;
  Cell cell;
};

TEST_F(MoveItScene, ObjectsOfEachShapeComeWhereTheRootHasThem) {
  PoseMessage turned = at(0.5, 0.0, 0.0);
  turned.orientation = {0.0, 0.0, std::sqrt(0.5), std::sqrt(0.5)};
  const auto shapes = {primitive(kBox, {0.1, 0.2, 0.3}), primitive(kSphere, {0.05}), primitive(kCylinder, {0.4, 0.06}),
                       primitive(kCone, {0.4, 0.06})};
  ASSERT_EQ(take(object("things", turned, shapes, {at(1, 0, 0), at(0, 1, 0)})), "");
  EXPECT_EQ(names(), (Names{"table", "things", "things/2", "things/3", "things/4"}));
  EXPECT_TRUE(placed("things").shape.core.isApprox(Vector3(0.05, 0.1, 0.15)));
  EXPECT_EQ(placed("things/2").shape.radius, 0.05);
  EXPECT_EQ(placed("things/4").shape.kind, ShapeKind::kCylinder);
  EXPECT_TRUE(placed("things").origin.translation().isApprox(model.mount * Vector3(0.5, 1.0, 0.0), 1e-12));
  EXPECT_TRUE(placed("things/2").origin.translation().isApprox(model.mount * Vector3(-0.5, 0.0, 0.0), 1e-12));
  EXPECT_TRUE(placed("things/3").origin.translation().isApprox(model.mount * Vector3(0.5, 0.0, 0.0), 1e-12));
}

TEST_F(MoveItScene, TheyAreAppendedToMovedReplacedAndRemoved) {
  ASSERT_EQ(take(object("a", at(1, 0, 0), {primitive(kSphere, {0.1})}, {at(0, 0, 1)})), "");
  ASSERT_EQ(take(object("a", at(1, 0, 0), {primitive(kSphere, {0.2})}, {}, kAppend)), "");
  EXPECT_EQ(names(), (Names{"table", "a", "a/2"}));
  ASSERT_EQ(take(object("a", at(2, 0, 0), {}, {}, kMove)), "");
  EXPECT_TRUE(placed("a").origin.translation().isApprox(model.mount * Vector3(2, 0, 1), 1e-12));
  EXPECT_TRUE(placed("a/2").origin.translation().isApprox(model.mount * Vector3(2, 0, 0), 1e-12));
  ASSERT_EQ(take(object("a", at(1, 0, 0), {primitive(kSphere, {0.3})})), "");
  EXPECT_EQ(names(), (Names{"table", "a"}));
  ASSERT_EQ(take(object("ab", at(1, 1, 0), {primitive(kSphere, {0.3})})), "");
  ASSERT_EQ(take(object("a", at(0, 0, 0), {}, {}, kRemove)), "");
  EXPECT_EQ(names(), (Names{"table", "ab"}));
  ASSERT_EQ(take(object("", at(0, 0, 0), {}, {}, kRemove)), "");
  EXPECT_EQ(names(), (Names{"table"})) << "what is from elsewhere stays";
}

/// A whole scene replaces the objects of earlier messages, and no others; a scene that is a difference does not.
TEST_F(MoveItScene, AWholeSceneReplaces) {
  ASSERT_EQ(take(object("old", at(1, 0, 0), {primitive(kSphere, {0.1})})), "");
  ASSERT_EQ(take(scene({object("more", at(2, 0, 0), {primitive(kSphere, {0.1})})}, true)), "");
  EXPECT_EQ(names(), (Names{"table", "old", "more"}));
  PlanningSceneMessage whole = scene({object("new", at(2, 0, 0), {primitive(kSphere, {0.1})})}, false);
  std::vector<moveit_msgs_msg_dds__ObjectColor_> colors{{text("new"), {1.0F, 0.5F, 0.0F, 1.0F}}};
  whole.object_colors = sequence_of<decltype(whole.object_colors)>(colors);
  ASSERT_EQ(take(whole), "");
  EXPECT_EQ(names(), (Names{"table", "new"}));
  EXPECT_EQ(placed("new").color, "#ff8000");
}

TEST_F(MoveItScene, TheToolTakesAndLetsGo) {
  const std::string hand = "left_" + model.link_names.back();
  CollisionObjectMessage bottle = object("bottle", at(0, 0, 0.2), {primitive(kCylinder, {0.1, 0.02})});
  bottle.header.frame_id = text(hand);
  ASSERT_EQ(take(attached(hand, bottle, {hand, "left_" + model.link_names[4], "gripper_of_somebody"})), "");
  EXPECT_TRUE(placed("bottle").attached);
  const Eigen::Isometry3d in_tool = placed("bottle").origin;
  EXPECT_TRUE((model.tool().origin * in_tool).translation().isApprox(Vector3(0, 0, 0.2), 1e-12));
  EXPECT_EQ(placed("bottle").may_be_touched_by, (Names{model.link_names.back(), model.link_names[4]}));
  EXPECT_NE(take(object("bottle", at(0, 0, 0), {}, {}, kRemove)).find("carried by the tool"), std::string::npos);
  ASSERT_EQ(take(attached(hand, object("bottle", at(0, 0, 0), {}, {}, kRemove))), "");
  EXPECT_FALSE(placed("bottle").attached);
  EXPECT_TRUE(placed("bottle").origin.isApprox(
      Eigen::Translation3d(arm.p()) * Eigen::Isometry3d(Quaternion(arm.R())) * in_tool, 1e-12));
  ASSERT_EQ(take(attached(hand, object("bottle", at(0, 0, 0), {}))), "") << "as it stands";
  EXPECT_TRUE(placed("bottle").origin.isApprox(in_tool, 1e-12));
  ASSERT_EQ(take(attached(hand, object("", at(0, 0, 0), {}, {}, kRemove))), "");
  EXPECT_FALSE(placed("bottle").attached);
}

/// With the reason, and the cell as it was.
TEST_F(MoveItScene, WhatCannotBeIsRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  ASSERT_EQ(take(object("there", at(1, 0, 0), {primitive(kSphere, {0.1})})), "");
  const Names before = names();
  const auto refused = [&](const auto& message, const std::string& why) {
    EXPECT_NE(take(message).find(why), std::string::npos) << take(message);
    EXPECT_EQ(names(), before);
  };
  const Primitive ball = primitive(kSphere, {0.1});
  refused(object("x", at(kNan, 0, 0), {ball}), "object 'x' has a position that is not finite");
  PoseMessage skewed = at(0, 0, 0);
  skewed.orientation.w = 0.5;
  refused(object("x", skewed, {ball}), "no unit quaternion");
  refused(object("x", at(0, 0, 0), {ball}, {at(0, 0, 0), at(0, 0, 0)}), "2 primitive_poses for 1 primitives");
  refused(object("x", at(0, 0, 0), {primitive(kBox, {0.1, 0.1})}), "a box with 2 dimensions; it has 3");
  refused(object("x", at(0, 0, 0), {primitive(kSphere, {-0.1})}), "object 'x'");
  refused(object("x", at(0, 0, 0), {primitive(kSphere, {kNan})}), "object 'x'");
  refused(object("x", at(0, 0, 0), {primitive(kPrism, {0.1})}), "type 5");
  refused(object("x", at(0, 0, 0), {}), "it has no shape");
  refused(object("", at(0, 0, 0), {ball}), "has no id");
  refused(object("x", at(0, 0, 0), {ball}, {}, 7), "operation 7");
  refused(object("x", at(0, 0, 0), {}, {}, kRemove), "there is none to remove");
  refused(object("table", at(0, 0, 0), {}, {}, kMove), "there is none to move");
  refused(object("x", at(2000, 0, 0), {ball}), "within 1000 m");
  refused(object("x", at(0, 0, 0), std::vector<Primitive>(64, ball)), "at most 64");
  CollisionObjectMessage elsewhere = object("x", at(0, 0, 0), {ball});
  elsewhere.header.frame_id = text("camera");
  refused(elsewhere, "frame 'camera' is none of left_");
  std::vector<shape_msgs_msg_dds__Mesh_> meshes(1);
  CollisionObjectMessage mesh = object("x", at(0, 0, 0), {ball});
  mesh.meshes = sequence_of<decltype(mesh.meshes)>(meshes);
  refused(mesh, "has a mesh");
  refused(attached("left_elbow", object("there", at(0, 0, 0), {})), "link 'left_elbow' cannot carry it");
  refused(attached("left_" + model.link_names.back(), object("nobody", at(0, 0, 0), {})), "there is none to attach");
  PlanningSceneMessage octomap = scene({}, true);
  std::vector<std::uint8_t> voxels(8);
  octomap.world.octomap.octomap.data = sequence_of<decltype(octomap.world.octomap.octomap.data)>(voxels);
  refused(octomap, "octomap");
  refused(scene({object("good", at(1, 1, 1), {ball}), elsewhere}, true), "camera");
  refused(object("\x1b[2J", at(0, 0, 0), {ball}), "an id with control characters");
  elsewhere.header.frame_id = text("cam\nera");
  refused(elsewhere, "object 'x' has a frame with control characters");
  refused(attached("el\u009bbow", object("there", at(0, 0, 0), {})),
          "object 'there' has a link with control characters");
  ASSERT_EQ(take(object("there", at(2, 0, 0), {}, {}, kMove)), "") << "what is known is known still";
}

/// The largest number that a message holds, all at once: other clients that change the cell wait meanwhile.
TEST_F(MoveItScene, TooManyAreRefusedBeforeTheyAreAllLookedAt) {
  const auto processor_time = [&](int count) {
    std::vector<CollisionObjectMessage> objects;
    for (int i = 0; i < count; ++i)
      objects.push_back(object("object " + std::to_string(i), at(1, 0, 0), {primitive(kSphere, {0.1})}));
    const Result<SceneChange> change = read(scene(objects, true));
    EXPECT_TRUE(change);
    std::clock_t least = std::numeric_limits<std::clock_t>::max();
    for (int i = 0; i < 5; ++i) {
      const std::clock_t begin = std::clock();
      const Result<Cell> changed = keeper.apply(*change, cell, arm);
      least = std::min(least, std::clock() - begin);
      EXPECT_TRUE(!changed && changed.error().message.find("at most 64") != std::string::npos);
    }
    return least;
  };
  EXPECT_LT(processor_time(10'000), 20 * processor_time(100) + 1000);
}

/// Over the wire, each of the three.
TEST_F(MoveItScene, ArrivesByDds) {
  ManualClock clock;
  Ros2Settings settings;
  settings.domain = isolated_ros2_domain();
  settings.prefix = "left_";
  auto bridge = Ros2Bridge::open(model, {}, settings, clock, [](const OperatorSample&) {}, [](const char*) {});
  ASSERT_TRUE(bridge);
  std::mutex mutex;
  std::vector<std::string> said;
  ASSERT_TRUE((*bridge)->listen_to_scene([&](const Result<SceneChange>& change) {
    const std::lock_guard lock(mutex);
    said.push_back(change ? change->objects.at(0).id : change.error().message);
  }));
  auto peer = Ros2Node::open(settings.domain);
  ASSERT_TRUE(peer);
  auto objects = (*peer)->publish<CollisionObjectMessage>("/collision_object");
  auto attached_objects = (*peer)->publish<AttachedObjectMessage>("/attached_collision_object");
  auto scenes = (*peer)->publish<PlanningSceneMessage>("/planning_scene");
  ASSERT_TRUE(objects && attached_objects && scenes);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (objects->subscribers() + attached_objects->subscribers() + scenes->subscribers() < 3 &&
         std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const auto heard = [&](const std::string& text) {
    while (std::chrono::steady_clock::now() < until) {
      {
        const std::lock_guard lock(mutex);
        if (std::count(said.begin(), said.end(), text) > 0) return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return false;
  };
  ASSERT_TRUE(objects->send(object("one", at(1, 0, 0), {primitive(kSphere, {0.1})})));
  EXPECT_TRUE(heard("one"));
  ASSERT_TRUE(attached_objects->send(attached("left_hand", object("two", at(1, 0, 0), {primitive(kSphere, {0.1})}))));
  EXPECT_TRUE(heard("two"));
  ASSERT_TRUE(scenes->send(scene({object("three", at(1, 0, 0), {primitive(kSphere, {0.1})})}, true)));
  EXPECT_TRUE(heard("three"));
  ASSERT_TRUE(objects->send(object("four", at(1, 0, 0), {primitive(kBox, {0.1})})));
  EXPECT_TRUE(heard("object 'four' has a box with 1 dimensions; it has 3"));
}

}  // namespace
}  // namespace steadyhand

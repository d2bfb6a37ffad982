#include "steadyhand/session/task/scripted_operator.hpp"

#include <gtest/gtest.h>

#include <utility>

namespace steadyhand {
namespace {

/// Tools are where the hands were a cycle before. The one whose gripper closed last near thing 0 holds it.
struct Follower {
  explicit Follower(const Task& done) : task(done), hand(task) {
    scene.things = 2;
    scene.thing[0].X_base_thing = {{0.4, 0.1, 0.1}, Quaternion(Eigen::AngleAxisd(0.3, Vector3::UnitZ()))};
    scene.thing[1].X_base_thing = {{0.5, -0.2, 0.1}, Quaternion(Eigen::AngleAxisd(-0.2, Vector3::UnitZ()))};
    tools[0].X_base_tool = {{0.5, 0.0, 0.4}, Quaternion::Identity()};
    tools[1].X_base_tool = {{0.5, -0.3, 0.4}, Quaternion::Identity()};
  }
  /// Until all moves are over, or 30 s have passed.
  void run() {
    for (Time now{0}; !hand.is_done() && now < std::chrono::seconds(30); now += std::chrono::milliseconds(10)) {
      int moving = 0;
      for (const OperatorSample& sample : hand.update(now, scene, tools)) {
        if (sample.clutch) moving += follow(sample) ? 1 : 0;
      }
      EXPECT_LE(moving, 1) << "one tool after another";
    }
  }
  /// True if it moves.
  bool follow(const OperatorSample& sample) {
    Pose& tool = tools[sample.tool].X_base_tool;
    double& gripper = tools[sample.tool].gripper;
    const Pose before = std::exchange(tool, sample.X_operator_hand);
    fastest = std::max(fastest, (tool.p - before.p).norm() / 0.01);
    Pose& thing = scene.thing[0].X_base_thing;
    if (gripper > 0.5 && holder == sample.tool) {
      const Quaternion turn = tool.q * before.q.conjugate();
      thing = {tool.p + turn * (thing.p - before.p), turn * thing.q};
    }
    const double wanted = sample.gripper.value_or(gripper);
    if (wanted > 0.5 && gripper < 0.5 && (tool.p - thing.p).norm() < 0.05) holder = sample.tool;
    if (wanted < 0.5 && holder == sample.tool) holder = -1;
    gripper = wanted;
    return (tool.p - before.p).norm() > 1e-9;
  }

  Task task;
  ScriptedOperator hand;
  SceneState scene;
  PerTool<SeenTool> tools;
  int holder = -1;
  double fastest = 0.0;  // m/s
};

Move to(int thing, double above) {
  Move move;
  move.to = thing;
  move.offset = {0.0, 0.0, above};
  move.turn = thing;
  move.symmetry = 0.5 * M_PI;
  return move;
}

Move grip(double gripper) {
  Move move;
  move.gripper = gripper;
  return move;
}

TEST(ScriptedOperator, TakesAThingToAnotherTurnedAsThatIs) {
  Task task;
  task.things = {"red", "blue"};
  Move put = to(1, 0.04);
  put.lead = 0;
  put.speed = 0.1;
  task.moves = {to(0, 0.01), grip(1.0), put, grip(0.0), to(1, 0.2)};
  Follower follower(task);
  follower.run();
  ASSERT_TRUE(follower.hand.is_done());
  const Pose &red = follower.scene.thing[0].X_base_thing, &blue = follower.scene.thing[1].X_base_thing;
  EXPECT_LT((red.p - blue.p - Vector3(0.0, 0.0, 0.04)).norm(), 1e-3);
  EXPECT_NEAR(std::remainder(heading(red) - heading(blue), 0.5 * M_PI), 0.0, 1e-3);
  EXPECT_NEAR(follower.tools[0].X_base_tool.p.z(), blue.p.z() + 0.2, 1e-3);
  EXPECT_LT(follower.fastest, 1.01 * Move().speed);
}

TEST(ScriptedOperator, HandsAThingFromOneToolToTheOther) {
  Task task;
  task.things = {"block", "mark"};
  const auto by = [](const char* tool, Move move) {
    move.tool_name = tool;
    return move;
  };
  Move put = to(1, 0.04), lift = to(0, 0.2), away = to(0, 0.3);
  put.lead = 0;
  lift.turn = away.turn = std::nullopt;
  task.moves = {by("left", to(0, 0.01)),  by("left", grip(1.0)),  by("left", lift),
                by("right", to(0, 0.01)), by("right", grip(1.0)), by("left", grip(0.0)),
                by("left", away),         by("right", put),       by("right", grip(0.0))};
  ASSERT_TRUE(find_tools(task, {"left", "right"}));
  Follower follower(task);
  follower.run();
  ASSERT_TRUE(follower.hand.is_done());
  const Pose &block = follower.scene.thing[0].X_base_thing, &mark = follower.scene.thing[1].X_base_thing;
  EXPECT_LT((block.p - mark.p - Vector3(0.0, 0.0, 0.04)).norm(), 1e-3);
  EXPECT_EQ(follower.holder, -1);
  task.moves[3].tool_name = "rigth";
  const Status found = find_tools(task, {"left", "right"});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().message, "task '': moves[3].tool is 'rigth'; the robot's tools are: left, right");
}

TEST(ScriptedOperator, EngagesOnlyHandsThatMove) {
  Task task;
  task.things = {"tray", "mark"};
  Move close = grip(1.0);
  close.tool = 1;
  task.moves = {to(0, 0.01), close};
  Follower follower(task);
  follower.run();
  ASSERT_TRUE(follower.hand.is_done());
  const auto hands = follower.hand.update(std::chrono::seconds(60), follower.scene, follower.tools);
  ASSERT_EQ(hands.size(), 2u);
  EXPECT_TRUE(hands[0].clutch);
  EXPECT_FALSE(hands[1].clutch);
  EXPECT_EQ(hands[1].gripper, 1.0);
}

TEST(ScriptedOperator, KeepsToALineWhereItIsTold) {
  Task task;
  task.things = {"block", "mark"};
  Move push = to(1, 0.0);
  push.offset.x() = -0.05;
  push.keep = {false, true};
  task.moves = {to(0, 0.0), push};
  Follower follower(task);
  const Pose &block = follower.scene.thing[0].X_base_thing, &mark = follower.scene.thing[1].X_base_thing;
  const Quaternion axes(Eigen::AngleAxisd(-heading(mark), Vector3::UnitZ()));
  const double across = (axes * (block.p - mark.p)).y();
  follower.run();
  ASSERT_TRUE(follower.hand.is_done());
  const Vector3 at = axes * (follower.tools[0].X_base_tool.p - mark.p);
  EXPECT_NEAR(at.x(), -0.05, 1e-3);
  EXPECT_NEAR(at.y(), across, 1e-3);
}

}  // namespace
}  // namespace steadyhand

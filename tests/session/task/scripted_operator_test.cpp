#include "steadyhand/session/task/scripted_operator.hpp"

#include <gtest/gtest.h>

namespace steadyhand {
namespace {

/// The tool is where the hand was a cycle before, and holds thing 0 while the gripper is closed.
struct Follower {
  explicit Follower(const Task& done) : task(done), hand(task) {
    scene.things = 2;
    scene.thing[0].X_base_thing = {{0.4, 0.1, 0.1}, Quaternion(Eigen::AngleAxisd(0.3, Vector3::UnitZ()))};
    scene.thing[1].X_base_thing = {{0.5, -0.2, 0.1}, Quaternion(Eigen::AngleAxisd(-0.2, Vector3::UnitZ()))};
    tool = {{0.5, 0.0, 0.4}, Quaternion::Identity()};
  }
  /// Until all moves are over, or 30 s have passed.
  void run() {
    for (Time now{0}; !hand.is_done() && now < std::chrono::seconds(30); now += std::chrono::milliseconds(10)) {
      const OperatorSample sample = hand.update(now, scene, tool, gripper);
      if (!sample.clutch) continue;
      const Pose& next = sample.X_operator_hand;
      fastest = std::max(fastest, (next.p - tool.p).norm() / 0.01);
      if (gripper > 0.5) {
        Pose& held = scene.thing[0].X_base_thing;
        const Quaternion turn = next.q * tool.q.conjugate();
        held = {next.p + turn * (held.p - tool.p), turn * held.q};
      }
      tool = next;
      gripper = sample.gripper.value_or(gripper);
    }
  }

  Task task;
  ScriptedOperator hand;
  SceneState scene;
  Pose tool;
  double gripper = 0.0, fastest = 0.0;  // m/s
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
  EXPECT_NEAR(follower.tool.p.z(), blue.p.z() + 0.2, 1e-3);
  EXPECT_LT(follower.fastest, 1.01 * Move().speed);
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
  const Vector3 at = axes * (follower.tool.p - mark.p);
  EXPECT_NEAR(at.x(), -0.05, 1e-3);
  EXPECT_NEAR(at.y(), across, 1e-3);
}

}  // namespace
}  // namespace steadyhand

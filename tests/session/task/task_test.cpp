#include "steadyhand/session/task/task.hpp"

#include <gtest/gtest.h>

namespace steadyhand {
namespace {

/// Bring 0 to within 10 mm of 1, at rest.
Task bring() {
  Task task;
  task.name = "bring";
  task.things = {"block", "mark"};
  task.placings = {{0, {0.3, 0.5}, {-0.2, 0.2}, {0.0, 1.0}, 0.1}, {1, {0.3, 0.5}, {-0.2, 0.2}, {}, 0.0}};
  task.apart = 0.15;
  task.success = {{Condition::Kind::kNear, 0, 1, 0.01, 0.2, "block at mark"},
                  {Condition::Kind::kStill, 0, 0, 0.01, 0.0, "block at rest"},
                  {Condition::Kind::kSpilled, 0, 0, 0.02, 0.0, "nothing spilled"}};
  task.time_limit = 10.0;
  return task;
}

SceneState at(double t, double distance, double speed, std::uint64_t reset = 1) {
  SceneState scene;
  scene.at = from_seconds(t);
  scene.reset = reset;
  scene.things = 2;
  scene.thing[0].X_base_thing.p = {distance, 0.0, 0.1};
  scene.thing[0].velocity = {0.0, speed, 0.0};
  return scene;
}

TEST(Task, PlacesAreDrawnFromTheSeedWithinBoundsAndApart) {
  const Task task = bring();
  double least = 1.0, most = 0.0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    const auto places = draw_places(task, seed), again = draw_places(task, seed);
    ASSERT_TRUE(places);
    EXPECT_EQ((*places)[0].p, (*again)[0].p);
    const Vector3& p = (*places)[0].p;
    EXPECT_TRUE(p.x() >= 0.3 && p.x() <= 0.5 && std::abs(p.y()) <= 0.2 && p.z() == 0.1) << p.transpose();
    EXPECT_GE(((*places)[0].p - (*places)[1].p).norm(), 0.15);
    least = std::min(least, p.x());
    most = std::max(most, p.x());
  }
  EXPECT_LT(least, 0.31);
  EXPECT_GT(most, 0.49);
  Task crowded = task;
  crowded.apart = 1.0;
  ASSERT_FALSE(draw_places(crowded, 1));
  EXPECT_NE(draw_places(crowded, 1).error().message.find("'bring': no places that are 1 m apart"), std::string::npos);
}

TEST(Task, SucceedsOnceAllHasHeldForAWhile) {
  const Task task = bring();
  TaskJudge judge(task);
  EXPECT_EQ(judge.update(at(1.0, 0.5, 0.0), 0.0).held, 0b110u);
  EXPECT_FALSE(judge.update(at(2.0, 0.005, 0.0), 0.0).success);
  EXPECT_FALSE(judge.update(at(2.4, 0.005, 0.02), 0.0).success);  // moved: the time starts again
  EXPECT_FALSE(judge.update(at(2.5, 0.005, 0.0), 0.0).success);
  EXPECT_FALSE(judge.update(at(2.9, 0.005, 0.0), 0.0).success);
  const TaskProgress& done = judge.update(at(3.1, 0.005, 0.0), 0.0);
  EXPECT_EQ(done.success, true);
  EXPECT_NEAR(done.time, 2.1, 1e-9);
  EXPECT_EQ(judge.update(at(50.0, 0.5, 1.0), 1.0).success, true);  // decided
  EXPECT_FALSE(judge.update(at(51.0, 0.5, 0.0, 2), 1.0).success);  // set up again
  EXPECT_EQ(judge.progress().time, 0.0);
}

TEST(Task, FailsWhenItsTimeIsOver) {
  const Task task = bring();
  TaskJudge judge(task);
  judge.update(at(0.0, 0.5, 0.0), 0.0);
  EXPECT_FALSE(judge.update(at(10.0, 0.5, 0.0), 0.0).success);
  EXPECT_EQ(judge.update(at(10.1, 0.5, 0.0), 0.0).success, false);
}

/// Participants may take as long as they need to take hold.
TEST(Task, ThatWaitsBeginsWhenItIsTold) {
  const Task task = bring();
  TaskJudge judge(task, true);
  judge.update(at(0.0, 0.005, 0.0), 0.0);
  EXPECT_FALSE(judge.has_begun());
  EXPECT_FALSE(judge.update(at(500.0, 0.005, 0.0), 0.0).success);  // by chance: the trial has not started
  EXPECT_EQ(judge.progress().time, 0.0);
  judge.begin();
  EXPECT_TRUE(judge.has_begun());
  judge.update(at(501.0, 0.5, 0.0), 0.0);
  EXPECT_NEAR(judge.update(at(503.0, 0.5, 0.0), 0.0).time, 2.0, 1e-9);
  judge.begin();  // an episode
  judge.update(at(504.0, 0.5, 0.0), 0.0);
  EXPECT_EQ(judge.update(at(514.5, 0.5, 0.0), 0.0).success, false);
  judge.update(at(515.0, 0.5, 0.0, 2), 0.0);  // set up again: it waits again
  EXPECT_FALSE(judge.has_begun());
  EXPECT_FALSE(judge.update(at(900.0, 0.5, 0.0, 2), 0.0).success);
  judge.begin();
  judge.update(at(900.1, 0.005, 0.0, 2), 0.0);
  EXPECT_EQ(judge.update(at(900.7, 0.005, 0.0, 2), 0.0).success, true);
}

TEST(Task, KnowsWhatIsHeldAndHowThingsAreTurned) {
  SceneState scene = at(0.0, 0.0, 0.0);
  scene.thing[0].grasped = true;
  const Condition released{Condition::Kind::kReleased};
  EXPECT_FALSE(holds(released, scene, 0.0));
  scene.thing[0].grasped = false;
  EXPECT_TRUE(holds(released, scene, 0.0));
  Condition aligned{Condition::Kind::kAligned, 0, 1, 0.1, 0.0};
  scene.thing[0].X_base_thing.q = Quaternion(Eigen::AngleAxisd(0.5 * M_PI + 0.05, Vector3::UnitZ()));
  EXPECT_NEAR(heading(scene.thing[0].X_base_thing), 0.5 * M_PI + 0.05, 1e-12);
  EXPECT_FALSE(holds(aligned, scene, 0.0));
  aligned.symmetry = 0.5 * M_PI;
  EXPECT_TRUE(holds(aligned, scene, 0.0));
  scene.thing[1].X_base_thing.q = Quaternion(Eigen::AngleAxisd(-0.06, Vector3::UnitZ()));
  EXPECT_FALSE(holds(aligned, scene, 0.0));
}

/// Each grip has a fresh glass, whose spilled share starts at 0 again.
TEST(Task, WhatIsSpilledOfEveryGlassCounts) {
  const Task task = bring();
  TaskJudge judge(task);
  judge.update(at(0.0, 0.5, 0.0), 0.3);
  EXPECT_EQ(judge.progress().spilled, 0.0);  // before the scene was set up
  judge.update(at(0.1, 0.5, 0.0), 0.31);
  judge.update(at(0.2, 0.5, 0.0), 0.0);
  EXPECT_NEAR(judge.update(at(0.3, 0.5, 0.0), 0.02).spilled, 0.03, 1e-12);
  EXPECT_EQ(judge.progress().held, 0b010u);
}

}  // namespace
}  // namespace steadyhand

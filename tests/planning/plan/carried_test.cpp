#include <gtest/gtest.h>

#include "planning/plan/loop.hpp"
#include "steadyhand/geometry/collision/proximity.hpp"

namespace steadyhand {
namespace {

/// Two random arms that may pass through each other, each with an object at its tool.
struct TwoObjects {
  TwoObjects(unsigned seed, const Shape& left, const Shape& right)
      : random(seed), model(random_tree(seed % 2, 5, 6, random, false)), arm(model) {
    model.pairs.clear();
    const int n = model.dof();
    const auto place = [&] {
      model.home = random_joints(n, 2.0, random);
      arm.set_position(model.home);
      return (arm.p(0) - arm.p(1)).norm();
    };
    double apart = place();
    while (apart < 0.5 || apart > 0.8) apart = place();
    obstacles.version = 1;
    for (const Shape& shape : {left, right}) {
      Obstacle& object = obstacles.list[obstacles.count];
      object.shape = shape;
      object.at = {Vector3::Zero(), Matrix3::Identity()};
      object.carried = true;
      object.tool = obstacles.count++;
      for (int i = 0; i < kMaxBodies; ++i) object.ignores.set(i);
    }
  }

  double gap() const { return solid_gap(arm, obstacles, solid_of(0), solid_of(1)); }

  std::mt19937 random;
  RobotModel model;
  Kinematics arm;
  Obstacles obstacles;
};

/// Hands that are driven into each other: what they hold comes near, and never touches.
TEST(Carried, ObjectsOfTwoToolsKeepApart) {
  const std::pair<Shape, Shape> shapes[] = {{Shape::sphere(0.1), Shape::sphere(0.08)},
                                            {Shape::capsule(0.2, 0.05), Shape::sphere(0.1)},
                                            {Shape::box({0.1, 0.2, 0.1}), Shape::capsule(0.2, 0.05)},
                                            {Shape::box({0.1, 0.2, 0.1}), Shape::box({0.2, 0.1, 0.1})}};
  int near = 0, arms = 0;
  for (unsigned seed = 1; seed <= 8; ++seed, ++arms) {
    TwoObjects two(seed, shapes[seed % 4].first, shapes[seed % 4].second);
    ASSERT_GT(two.gap(), 0.0);
    OcpSettings settings;
    settings.weights = {{"position", {500}}, {"orientation", {5}}, {"velocity", {0.1}}, {"acceleration", {0.02}}};
    PlannerSettings planning;
    planning.obstacles = two.obstacles;
    auto planner = std::move(*Planner::make(two.model, settings, planning));
    Reference reference;
    reference.nodes = settings.horizon;
    const Vector3 middle = 0.5 * (two.arm.p(0) + two.arm.p(1));
    for (int t = 0; t < 2; ++t) {
      reference.tools[t].p.fill(middle);
      reference.tools[t].R.fill(two.arm.R(t));
    }
    double least = 1.0;
    for (int i = 0; i < 45; ++i) {
      reference.start = from_seconds(0.05 * i);
      const Plan& plan = planner->update(reference);
      for (int j = 0; j < 25; ++j) {
        two.arm.set_position(sample(plan, reference.start + from_seconds(0.002 * j)).q);
        least = std::min(least, two.gap());
      }
      EXPECT_EQ(nearest_pair(two.arm, two.obstacles).gap, two.gap());
      EXPECT_EQ(nearest_body(two.arm, two.obstacles, 0, 0.0).body, solid_of(1));
      EXPECT_EQ(nearest_body(two.arm, two.obstacles, 1, 0.0).body, solid_of(0));
    }
    EXPECT_GT(least, -1e-5) << seed;
    near += least < 0.01;
  }
  EXPECT_GE(near, arms * 3 / 4);
}

/// Of two hands that are driven into each other the one with less weight gives way. It returns when there is room.
TEST(Priority, TheLowerOneGivesWayAndReturns) {
  int arms = 0, yields = 0, returns = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    for (const int lower : {0, 1}) {
      TwoObjects two(2 * seed, Shape::sphere(0.1), Shape::sphere(0.1));
      std::vector<double> position(6, 500.0), orientation(6, 5.0);
      for (int i = 0; i < 3; ++i) {
        position[3 * lower + i] *= 0.2;
        orientation[3 * lower + i] *= 0.2;
      }
      OcpSettings settings;
      settings.weights = {
          {"position", position}, {"orientation", orientation}, {"velocity", {0.1}}, {"acceleration", {0.02}}};
      PlannerSettings planning;
      planning.obstacles = two.obstacles;
      auto planner = std::move(*Planner::make(two.model, settings, planning));
      const std::array home{two.arm.p(0), two.arm.p(1)};
      const std::array R{two.arm.R(0), two.arm.R(1)};
      const Vector3 middle = 0.5 * (home[0] + home[1]);
      std::array<double, 2> off;
      const auto follow = [&](bool together, int begin) {
        for (int i = 0; i < 60; ++i) {
          Reference reference;
          reference.nodes = settings.horizon;
          reference.start = from_seconds(0.05 * (begin + i));
          for (int t = 0; t < 2; ++t) {
            reference.tools[t].p.fill(together ? middle : home[t]);
            reference.tools[t].R.fill(R[t]);
          }
          two.arm.set_position(sample(planner->update(reference), reference.start).q);
          for (int t = 0; t < 2; ++t) off[t] = (two.arm.p(t) - reference.tools[t].p[0]).norm();
        }
      };
      follow(true, 0);
      ++arms;
      yields += off[lower] > 2.0 * off[1 - lower];
      EXPECT_GT(off[0] + off[1], 0.19);
      follow(false, 60);
      returns += std::max(off[0], off[1]) < 5e-3;
    }
  }
  std::cout << yields << " yield and " << returns << " return of " << arms << "\n";
  EXPECT_GE(yields, arms * 3 / 4);
  EXPECT_GE(returns, arms * 3 / 4);
}

/// The check alone keeps them apart, and lets those touch that may.
TEST(Carried, TheCheckSeesThem) {
  int touching = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    TwoObjects two(seed, Shape::sphere(0.05), Shape::capsule(0.1, 0.05));
    const int n = two.model.dof();
    Plan plan;
    stand(two.model.home, Time(0), plan);
    plan.intervals = 20;
    const JointVector way = random_joints(n, 1.0, two.random);
    for (int k = 0; k < 20; ++k) {  // there, and to rest
      plan.u[k] = (k < 10 ? 4.0 : -4.0) * way;
      plan.x[k + 1].resize(2 * n);
      plan.x[k + 1] << plan.x[k].head(n) + 0.05 * plan.x[k].tail(n) + 0.5 * 0.05 * 0.05 * plan.u[k],
          plan.x[k].tail(n) + 0.05 * plan.u[k];
    }
    double least = 1.0;
    for (double t = 0.0; t <= 1.0; t += 5e-4) {
      two.arm.set_position(sample(plan, from_seconds(t)).q);
      least = std::min(least, two.gap());
    }
    const auto fault_with = [&](double grown) {
      Obstacles obstacles = two.obstacles;
      obstacles.list[0].shape = obstacles.list[0].shape.inflated(grown);
      return check_plan(plan, plan.x[0], {}, two.arm, obstacles);
    };
    two.arm.set_position(two.model.home);
    if (least < 1e-3 || two.gap() < least + 2e-3) continue;
    ++touching;
    EXPECT_EQ(fault_with(least + 1e-3), PlanFault::kSelfCollision) << seed;
    EXPECT_EQ(fault_with(least - 1e-4), PlanFault::kNone) << seed;
    two.obstacles.list[1].ignores.set(solid_of(0));
    EXPECT_EQ(fault_with(least + 1e-3), PlanFault::kNone) << seed;
  }
  EXPECT_GE(touching, 3);
}

}  // namespace
}  // namespace steadyhand

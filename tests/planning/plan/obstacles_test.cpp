#include <gtest/gtest.h>

#include "planning/plan/loop.hpp"
#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/planning/plan/link_gaps.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {
namespace {

Obstacle obstacle(const Shape& shape, const Vector3& p, const Vector3& velocity = Vector3::Zero()) {
  return {shape, {p, Matrix3::Identity()}, velocity, 0.0, {}};
}

Obstacles cell(std::initializer_list<Obstacle> list) {
  Obstacles result;
  for (const Obstacle& each : list) result.list[result.count++] = each;
  return result;
}

/// m, of the bodies that joints move, without any short cut.
double smallest_gap(const Kinematics& arm, const Obstacles& obstacles, Time now) {
  double least = 1e9;
  for (std::size_t i = 0; i < arm.model().bodies.size(); ++i) {
    if (arm.model().bodies[i].link == 0) continue;
    for (const Obstacle& each : obstacles.all()) {
      const Placed there = placed_after(each, to_seconds(now - obstacles.time));
      least = std::min(least, distance(arm.model().bodies[i].shape, arm.body(i), each.shape, there));
    }
  }
  return least;
}

struct Swing {
  int plans = 0, solved = 0, near = 0;
  int waited = 0;      ///< plans that were refused one after another, at most
  double least = 1e9;  ///< m
};

/// Four seconds of the loop's swings among obstacles, at 20 plans a second.
/// @param known to the planner
Swing swing(Loop& loop, const Obstacles& obstacles, const Obstacles& known) {
  Swing result;
  loop.planner->reset(loop.model.home, Time(0));
  EXPECT_TRUE(loop.planner->set_obstacles(known));
  Tracker tracker(loop.model.home);
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    const Time now(std::chrono::milliseconds(2 * i));
    if (i % 25 == 0) {
      tracker.follow(loop.planner->update(loop.reference(now)));
      refused = loop.planner->fault() == PlanFault::kNone ? 0 : refused + 1;
      result.waited = std::max(result.waited, refused);
      result.solved += loop.planner->plan().origin == PlanOrigin::kSolved;
      ++result.plans;
    }
    loop.arm.set_position(tracker.update(now).q);
    const double gap = smallest_gap(loop.arm, obstacles, now);
    result.least = std::min(result.least, gap);
    result.near += gap < 0.005;
  }
  return result;
}

/// Each kind of obstacle is in the way of the swinging tool.
TEST(Obstacles, AreNotTouched) {
  int near = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    Loop loop(seed, 1.5, kUsualObstacleRows);
    if (seed % 2) {
      vary_bodies(loop.model, loop.random);
      loop.arm = Kinematics(loop.model);
      loop.planner = std::move(*Planner::make(loop.model, loop.settings, {}));
    }
    loop.arm.set_position(loop.model.home + loop.direction);  // the swing's end
    const Vector3 there = loop.arm.p();
    const Shape shapes[] = {Shape::sphere(0.1), Shape::capsule(0.2, 0.05), Shape::box({0.1, 0.2, 0.02}),
                            Shape::cylinder(0.1, 0.1), Shape::half_space()};
    const Shape& shape = shapes[seed % std::size(shapes)];
    Obstacles obstacles = cell({obstacle(shape, there)});
    loop.arm.set_position(loop.model.home);
    if (shape.kind == ShapeKind::kHalfSpace) {  // a floor just below the arm
      obstacles.list[0].at.p.z() += smallest_gap(loop.arm, obstacles, Time(0)) - 0.02;
    }
    if (smallest_gap(loop.arm, obstacles, Time(0)) < 0.0) continue;
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << to_string(shape.kind));
    const Swing result = swing(loop, obstacles, obstacles);
    EXPECT_GE(result.least, -1e-5);
    EXPECT_GE(result.solved, result.plans * 8 / 10);
    EXPECT_LE(result.waited, 3);  // a corner that solutions cut is given a wider berth
    near += result.near > 50;
  }
  EXPECT_GT(near, 4);
}

/// The arm gives way to an obstacle that flies past, because the problem knows its future position.
TEST(Obstacles, GivesWayToWhatMoves) {
  int gave_way = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Loop loop(seed, 0.2, kUsualObstacleRows);
    loop.arm.set_position(loop.model.home);
    const Vector3 aside = loop.arm.p() + Vector3(0.0, 0.0, 0.08);
    const Vector3 velocity(0.3, 0.0, 0.0);
    Obstacles obstacles = cell({obstacle(Shape::sphere(0.05), aside - 1.5 * velocity, velocity)});
    obstacles.time = from_seconds(0.5);
    if (smallest_gap(loop.arm, obstacles, Time(0)) < 0.01) continue;
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    const Swing blind = swing(loop, obstacles, kNoObstacles), result = swing(loop, obstacles, obstacles);
    EXPECT_GE(result.least, -1e-5);
    gave_way += blind.least < -0.01 && result.solved == result.plans;
  }
  EXPECT_GT(gave_way, 2);
}

/// Plans to rest past obstacles of all kinds that move, as large as looks at the nodes and half-way just allow.
TEST(Obstacles, AreLookedForAtAllTimes) {
  Loop loop(10);
  std::mt19937 random(1);
  const auto vector = [&] { return random_vector(random); };
  int near = 0, passed_by_points = 0, refused = 0, free = 0;
  for (int trial = 0; trial < 60000; ++trial) {
    Plan plan;  // to rest in six intervals of 50 ms
    stand(random_joints(6, 2.0, random), from_seconds(3.0), plan);
    plan.intervals = 6;
    plan.x[0].tail(6) = random_joints(6, 3.0, random);
    for (int k = 0; k < 6; ++k) {
      plan.u[k] = -plan.x[0].tail(6) / (6.0 * plan.dt);
      plan.x[k + 1].resize(12);
      plan.x[k + 1] << plan.x[k].head(6) + plan.dt * plan.x[k].tail(6) + 0.5 * plan.dt * plan.dt * plan.u[k],
          plan.x[k].tail(6) + plan.dt * plan.u[k];
    }
    RobotModel bare = loop.model;
    bare.pairs.clear();
    bare.bodies = {bare.bodies[2 + random() % (bare.bodies.size() - 2)]};
    Kinematics arm(bare);
    const Shape shapes[] = {Shape::sphere(0.02), Shape::capsule(0.1, 0.02), Shape::box({0.05, 0.1, 0.02}, 0.01)};
    Obstacles obstacles = cell({obstacle(shapes[trial % std::size(shapes)], vector(), 2.0 * vector())});
    obstacles.time = from_seconds(2.5);
    obstacles.list[0].at.R = random_rotation(random);
    const auto apart = [&](double t) {
      const Time now = plan.start + from_seconds(t);
      arm.set_position(sample(plan, now).q);
      return smallest_gap(arm, obstacles, now);
    };
    double at_points = 1e9, at_all_times = 1e9;
    for (int i = 0; i <= 2 * plan.intervals; ++i) at_points = std::min(at_points, apart(0.5 * i * plan.dt));
    if (at_points > 0.2 || at_points < 0.001) continue;
    for (int i = 0; i <= 64 * plan.intervals; ++i) at_all_times = std::min(at_all_times, apart(i * plan.dt / 64.0));
    if (at_all_times < 0.001) continue;
    double braked = 1e9;  // an obstacle this close may come closer
    for (int i = 0; i <= 16 * plan.intervals; ++i) {
      const double t = i * plan.dt / 16.0;
      arm.set_position(straight_stop_at(bare, plan.x[0].head(6), plan.x[0].tail(6), t));
      braked = std::min(braked, smallest_gap(arm, obstacles, plan.start + from_seconds(t)));
    }
    if (braked < at_points) continue;
    ++near;
    const Shape thin = obstacles.list[0].shape;
    const auto fault_with_gap = [&](double left, double distance) {
      obstacles.list[0].shape = thin.inflated(distance - left);
      return check_plan(plan, plan.x[0], {}, arm, obstacles);
    };
    passed_by_points += at_points - at_all_times > 5e-5;
    refused += at_points - at_all_times > 5e-5 && fault_with_gap(0.0, at_points) == PlanFault::kObstacle;
    free += fault_with_gap(1e-4, at_all_times) == PlanFault::kNone;
  }
  EXPECT_GT(passed_by_points, 100);
  EXPECT_EQ(refused, passed_by_points);
  EXPECT_EQ(free, near);
}

/// The arm may leave an obstacle that covers it, but enter it no further.
TEST(Obstacles, APlanMayLeadOutOfOne) {
  Loop loop(3);
  Plan rest;
  stand(loop.model.home, Time(0), rest);
  loop.arm.set_position(loop.model.home);
  const Vector3 center = loop.arm.body(loop.model.bodies.size() - 1).p;
  const Obstacles around = cell({obstacle(Shape::sphere(0.02), center)});
  EXPECT_EQ(check_plan(rest, rest.x[0], {}, loop.arm, around), PlanFault::kNone);
  const Obstacles coming = cell({obstacle(Shape::sphere(0.02), center, {0.0, 0.0, 0.01})});
  rest.intervals = 1;
  rest.x[1] = rest.x[0];
  rest.u[0] = JointVector::Zero(6);
  EXPECT_EQ(check_plan(rest, rest.x[0], {}, loop.arm, coming), PlanFault::kNone) << "it goes";
}

/// From the depth of one obstacle a body may go into no other: not even as deep.
TEST(Obstacles, WhatIsLeftIsNoLeaveToEnterOthers) {
  Loop loop(3);
  RobotModel bare = loop.model;
  bare.pairs.clear();
  bare.bodies = {{"ball", 6, Shape::sphere(0.05)}};
  bare.bodies[0].origin.translation() = Vector3(0.0, 0.0, 0.2);
  Kinematics arm(bare);
  Plan plan;
  stand(bare.home, Time(0), plan);
  plan.intervals = 4;
  for (int k = 0; k < 4; ++k) {  // acceleration forth and back: 0.3 rad further, at rest
    plan.u[k] = (k < 2 ? 30.0 : -30.0) * JointVector::Unit(6, 1);
    plan.x[k + 1].resize(12);
    plan.x[k + 1] << plan.x[k].head(6) + plan.dt * plan.x[k].tail(6) + 0.5 * plan.dt * plan.dt * plan.u[k],
        plan.x[k].tail(6) + plan.dt * plan.u[k];
  }
  bare.acceleration_max.setConstant(40.0);
  bare.velocity_max.setConstant(10.0);
  const auto center = [&](int node) {
    arm.set_position(plan.x[node].head(6));
    return arm.body(0).p;
  };
  const Vector3 from = center(0), first = (center(1) - from).normalized(), to = center(4),
                last = (to - center(3)).normalized();
  ASSERT_GT((to - from).norm(), 0.1);
  const double apart = 0.05 + 0.02;
  const auto fault = [&](std::initializer_list<Obstacle> list) {
    return check_plan(plan, plan.x[0], {}, arm, cell(list));
  };
  for (const double speed : {0.0, 1e-3}) {
    const Vector3 velocity = speed * Vector3::UnitX();
    const Obstacle left = obstacle(Shape::sphere(0.02), from - (apart - 0.03) * first);
    const Obstacle entered = obstacle(Shape::sphere(0.02), to + (apart - 0.02) * last, velocity);
    EXPECT_EQ(fault({left}), PlanFault::kNone);
    EXPECT_EQ(fault({entered}), PlanFault::kObstacle);
    EXPECT_EQ(fault({left, entered}), PlanFault::kObstacle);
  }
}

/// An approaching obstacle may come as near as if the arm braked, because no plan can be better at once. The plan may
/// not let it come nearer.
TEST(Obstacles, WhatComesIsNotMet) {
  Loop loop(3);
  loop.arm.set_position(loop.model.home);
  const Vector3 center = loop.arm.body(loop.model.bodies.size() - 1).p;
  const double speed = 0.3;
  const Obstacles coming = cell({obstacle(Shape::sphere(0.02), center + Vector3(0.0, 0.0, 0.07), {0.0, 0.0, -speed})});
  const auto go = [&](double shoulder) {  // rad/s^2, back and forth between two states of rest; back in 0.4 s
    Plan plan;
    stand(loop.model.home, Time(0), plan);
    plan.intervals = 4;
    for (int k = 0; k < 4; ++k) {
      plan.u[k] = (k == 0 || k == 3 ? shoulder : -shoulder) * JointVector::Unit(6, 1);
      plan.x[k + 1].resize(12);
      plan.x[k + 1] << plan.x[k].head(6) + plan.dt * plan.x[k].tail(6) + 0.5 * plan.dt * plan.dt * plan.u[k],
          plan.x[k].tail(6) + plan.dt * plan.u[k];
    }
    return check_plan(plan, plan.x[0], {}, loop.arm, coming);
  };
  EXPECT_EQ(go(0.0), PlanFault::kNone) << "it stands";
  EXPECT_EQ(go(5.0), PlanFault::kNone) << "it ducks";
  EXPECT_EQ(go(-5.0), PlanFault::kObstacle) << "it rises";
}

/// A shoulder that turns over a table stays as near to it as it is: just outside the margin, within it by less than
/// plans may be, and by more.
TEST(Obstacles, AShoulderNearATableHoldsNothingUp) {
  int tried = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Loop loop(seed, 0.2, kUsualObstacleRows);
    loop.arm.set_position(loop.model.home);
    const Joint& shoulder = loop.model.joints[0];
    if (shoulder.type != JointType::kRevolute) continue;
    Obstacle table = obstacle(Shape::half_space(), shoulder.origin.translation());
    table.at.R = Quaternion::FromTwoVectors(Vector3::UnitZ(), shoulder.origin.linear() * shoulder.axis).matrix();
    double of_shoulder = 1e9, of_others = 1e9;
    for (std::size_t i = 0; i < loop.model.bodies.size(); ++i) {
      const int link = loop.model.bodies[i].link;
      double& least = link == 1 ? of_shoulder : of_others;
      if (link > 0) least = std::min(least, gap(loop.arm, static_cast<int>(i), table.shape, table.at));
    }
    if (!(of_shoulder < 1e8) || of_others < of_shoulder + 0.1) continue;
    ++tried;
    for (const double inside : {-1e-6, 0.001, 0.004}) {
      Obstacle raised = table;
      raised.at.p += (of_shoulder + inside) * table.at.R.col(2);
      const Swing result = swing(loop, cell({raised}), cell({raised}));
      EXPECT_GE(result.solved, result.plans - 2) << seed << ", " << inside;  // other links may come near it, too
      EXPECT_GE(result.least, -std::max(inside, 2e-3) - 1e-6) << seed << ", " << inside;
    }
  }
  EXPECT_GT(tried, 2);
}

/// Obstacles outside the search boxes are not near. A fast obstacle elsewhere makes the distance to a near, stationary
/// one no less certain.
TEST(Obstacles, AreNotMixedUp) {
  Loop loop(10);
  std::mt19937 random(6);
  const auto vector = [&] { return random_vector(random); };
  Kinematics arm(loop.model);
  int near = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    Plan plan;
    stand(random_joints(6, 2.0, random), from_seconds(3.0), plan);
    arm.set_position(plan.x[0].head(6));
    const std::size_t last = loop.model.bodies.size() - 1;
    const Vector3 there = arm.body(static_cast<int>(last)).p + 0.3 * vector();
    const double distance = smallest_gap(arm, cell({obstacle(Shape::sphere(0.01), there)}), Time(0));
    if (distance < 0.01 || clearance(arm) < 0.01) continue;
    plan.intervals = 2;  // nothing moves, for a while
    plan.u[0] = plan.u[1] = JointVector::Zero(6);
    plan.x[1] = plan.x[2] = plan.x[0];
    const Obstacle touches = obstacle(Shape::sphere(0.01 + distance - 1e-4), there);
    Obstacles both = cell({touches, obstacle(Shape::sphere(0.01), 500.0 * vector(), 50.0 * vector())});
    both.time = plan.start;
    EXPECT_EQ(check_plan(plan, plan.x[0], {}, arm, cell({touches})), PlanFault::kNone);
    EXPECT_EQ(check_plan(plan, plan.x[0], {}, arm, both), PlanFault::kNone);
    ++near;
  }
  EXPECT_GT(near, 200);
}

TEST(Obstacles, NothingNearIsLeftOut) {
  std::mt19937 random(4);
  const auto vector = [&] { return random_vector(random); };
  int near = 0, left = 0, all = 0;
  for (int trial = 0; trial < 300; ++trial) {
    RobotModel model = random_arm(6, random);
    vary_bodies(model, random);
    Kinematics arm(model);
    Obstacles obstacles;
    const Shape shapes[] = {Shape::sphere(0.1), Shape::capsule(0.2, 0.05), Shape::box({0.1, 0.2, 0.02}, 0.01),
                            Shape::cylinder(0.1, 0.1), Shape::half_space()};
    obstacles.count = static_cast<int>(random() % (Obstacles::kMost + 1));
    for (int i = 0; i < obstacles.count; ++i) {
      obstacles.list[i] = obstacle(shapes[random() % std::size(shapes)], vector(), 0.5 * vector());
      obstacles.list[i].at.R = random_rotation(random);
      if (obstacles.list[i].shape.kind == ShapeKind::kHalfSpace) obstacles.list[i].at.p *= 2.0;
    }
    ObstacleSweep sweep(model, obstacles, from_seconds(0.3));
    std::vector<JointVector> way;
    for (int k = 0; k < 3; ++k) way.push_back(random_joints(6, 3.0, random));
    for (const JointVector& q : way) arm.set_position(q), sweep.pass(arm);
    sweep.find(1.0, 0.05, LinkLengths::Zero(model.dof() + 1));
    std::vector<std::vector<char>> kept(model.bodies.size(), std::vector<char>(obstacles.count, 0));
    sweep.for_each_near([&](int body, int o) { kept[body][o] = 1; });
    for (int k = 0; k < 3; ++k) {
      arm.set_position(way[k]);
      for (std::size_t body = 2; body < model.bodies.size(); ++body) {
        for (int o = 0; o < obstacles.count; ++o) {
          const double far = gap(arm, static_cast<int>(body), sweep.shape(o), sweep.placed(o, 0.5 * k));
          near += far < 0.05;
          left += kept[body][o];
          ++all;
          EXPECT_TRUE(kept[body][o] || far >= 0.05) << body << ' ' << o << ' ' << far;
        }
      }
    }
  }
  EXPECT_GT(near, 1000);
  EXPECT_LT(left, all / 2);
}

TEST(Obstacles, ThoseThatCannotBeAreRefused) {
  Loop loop(3, 1.5, kUsualObstacleRows);
  const auto refused = [&](const Obstacle& bad, const std::string& reason) {
    const Status status = loop.planner->set_obstacles(cell({obstacle(Shape::sphere(0.1), {1, 1, 1}), bad}));
    ASSERT_FALSE(status) << reason;
    EXPECT_NE(status.error().message.find(reason), std::string::npos) << status.error().message;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused(obstacle(Shape::sphere(0.0), {1, 1, 1}), "obstacle 1: ");
  refused(obstacle(Shape::sphere(nan), {1, 1, 1}), "obstacle 1: ");
  refused(obstacle(Shape::sphere(0.1), {1, nan, 1}), "obstacle 1: must be within 1000 m");
  refused(obstacle(Shape::sphere(0.1), {1, 1e9, 1}), "obstacle 1: must be within 1000 m");
  refused(obstacle(Shape::sphere(0.1), {1, 1, 1}, {0, 0, nan}), "obstacle 1: must not be faster");
  Obstacle turned = obstacle(Shape::box({0.1, 0.1, 0.1}), {1, 1, 1});
  turned.at.R *= 1.1;
  refused(turned, "rotation");
  turned.at.R.setConstant(nan);
  refused(turned, "rotation");
  turned.at.R = -Matrix3::Identity();
  refused(turned, "rotation");
  Obstacles many;
  many.count = Obstacles::kMost + 1;
  EXPECT_FALSE(loop.planner->set_obstacles(many));
  many.count = -1;
  EXPECT_FALSE(loop.planner->set_obstacles(many));
  Loop without(3);
  const Status status = without.planner->set_obstacles(cell({obstacle(Shape::sphere(0.1), {1, 1, 1})}));
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "1 obstacles for a problem whose obstacle_rows is 0");
}

/// A pair that stays near keeps its row, and with it the row's multipliers.
TEST(Obstacles, PairsKeepTheirRows) {
  Loop loop(7, 1.5, kUsualObstacleRows);
  loop.arm.set_position(loop.model.home);
  ASSERT_TRUE(
      loop.planner->set_obstacles(cell({obstacle(Shape::sphere(0.1), loop.arm.p() + Vector3(0.15, 0.0, 0.0)),
                                        obstacle(Shape::sphere(0.1), loop.arm.p() - Vector3(0.0, 0.25, 0.0))})));
  std::vector<std::pair<int, double>> before(kUsualObstacleRows, {-1, 0.0});
  int kept = 0, moved = 0;
  for (int i = 0; i < 100; ++i) {
    (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
    std::vector<std::pair<int, double>> now;
    for (const NearObstacle& near : loop.planner->instance().near) now.push_back({near.body, near.obstacle.at.p.x()});
    for (std::size_t row = 0; row < now.size(); ++row) {
      if (now[row].first < 0) continue;
      kept += before[row] == now[row];
      for (std::size_t other = 0; other < now.size(); ++other) moved += other != row && before[other] == now[row];
    }
    before = now;
  }
  EXPECT_GT(kept, 50);
  EXPECT_EQ(moved, 0);
}

/// Pressed flat onto a larger box, a box has constraints for its corners only; if it overhangs the edge, also one for
/// the whole box. With that one, whose derivative jumps from edge to edge, the solver did not converge.
TEST(Obstacles, ABoxThatLiesFlatOnAnotherHasItsCornersOnly) {
  for (const double aside : {0.0, 0.19}) {
    Loop loop(3, 0.2, kUsualObstacleRows);
    loop.model.pairs.clear();
    loop.model.bodies = {{"tray", 6, Shape::box({0.06, 0.06, 0.02})}};
    loop.model.bodies[0].origin = loop.model.tool().origin;
    loop.arm = Kinematics(loop.model);
    loop.planner = std::move(*Planner::make(loop.model, loop.settings, {}));
    loop.planner->reset(loop.model.home, Time(0));
    loop.arm.set_position(loop.model.home);
    const Placed tray = loop.arm.body(0);
    const auto next_to = [&](double x, double z) { return Vector3(tray.p + x * tray.R.col(0) + z * tray.R.col(2)); };
    Obstacles top = cell({obstacle(Shape::box({0.2, 0.2, 0.05}), next_to(aside, -0.1))});
    top.list[0].at.R = tray.R;
    ASSERT_TRUE(loop.planner->set_obstacles(top));
    int wholes = 0, corners = 0, solved = 0, most = 0;
    for (int i = 0; i < 100; ++i) {
      Reference into = loop.reference(from_seconds(0.02 * i));
      for (int k = 0; k < into.nodes; ++k) {
        into.tools[0].p[k] = next_to(0.01 * std::sin(0.2 * i), -0.1);
        into.tools[0].R[k] = tray.R;
      }
      (void)loop.planner->update(into);
      solved += loop.planner->plan().origin == PlanOrigin::kSolved;
      most = std::max(most, loop.planner->solution().iterations);
      for (const NearObstacle& near : loop.planner->instance().near) {
        wholes += near.body >= 0 && near.corner < 0;
        corners += near.body >= 0 && near.corner >= 0;
      }
    }
    EXPECT_EQ(wholes > 0, aside > 0.0) << aside;
    EXPECT_GE(corners, 400) << aside;
    if (aside > 0.0) continue;
    EXPECT_GE(solved, 99);
    EXPECT_LT(most, 60);
  }
}

/// With an allowed overlap of 2 mm a plan moved a bottle 1.5 mm into the upper arm.
TEST(Obstacles, WhatIsCarriedDoesNotTouchTheArmBetweenNodes) {
  Loop loop(10);
  const Plan plan = up_and_back(loop.model.home);
  int tried = 0;
  for (std::size_t body = 0; body < loop.model.bodies.size(); ++body) {
    if (loop.model.bodies[body].link == 6) continue;
    Obstacles carried = cell({obstacle(Shape::sphere(0.001), Vector3::Zero())});
    carried.list[0].carried = true;
    carried.list[0].ignores.set();
    carried.list[0].ignores.reset(body);
    const auto apart = [&](double t) {
      loop.arm.set_position(sample(plan, from_seconds(t)).q);
      return solid_gap(loop.arm, carried, static_cast<int>(body), solid_of(0));
    };
    const double half_way = apart(0.5 * plan.dt);
    if (half_way < 1e-3 || std::min(apart(0.0), apart(2.0 * plan.dt)) < half_way + 3e-4) continue;
    ++tried;
    const auto fault_with_gap = [&](double gap) {
      Obstacles grown = carried;
      grown.list[0].shape = carried.list[0].shape.inflated(half_way - gap);
      return check_plan(plan, plan.x[0], {}, loop.arm, grown);
    };
    EXPECT_EQ(fault_with_gap(-1e-4), PlanFault::kSelfCollision) << body;
    EXPECT_EQ(fault_with_gap(1e-4), PlanFault::kNone) << body;
  }
  EXPECT_GT(tried, 0);
}

}  // namespace
}  // namespace steadyhand

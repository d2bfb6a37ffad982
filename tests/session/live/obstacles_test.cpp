#include <gtest/gtest.h>

#include <random>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "support/virtual_session.hpp"

namespace steadyhand {
namespace {

constexpr double kMargin = 0.01;  // m

Obstacle solid(const Shape& shape, const Vector3& p, const Vector3& velocity = Vector3::Zero()) {
  return {shape.inflated(kMargin), {p, Matrix3::Identity()}, velocity, kMargin, {}};
}

Obstacles world(const std::vector<Obstacle>& list) {
  Obstacles result;
  for (const Obstacle& each : list) result.list[result.count++] = each;
  return result;
}

/// Following a hand that sweeps.
struct Among : testing::Test {
  VirtualSession session;

  void follow(const Vector3& extent = {0.1, 0.3, 0.1}) {
    session.run(0.2);
    ASSERT_TRUE(session.grip());
    session.hand = sweeping(extent, 1.0);
    session.run(1.0);
  }
  /// Engaged by a hand that is stationary, and then goes to `way` (m) in `duration` s from its next call on.
  void stand() {
    session.run(0.2);
    ASSERT_TRUE(session.grip());
    session.run(1.0);
  }
  void lead(const Vector3& way, double duration) {
    session.hand = [from = lead_, way, begin = session.now(), duration](double t) {
      const double s = std::clamp((t - begin) / duration, 0.0, 1.0);
      Pose pose;
      pose.p = from + s * s * (3.0 - 2.0 * s) * way;
      return pose;
    };
    lead_ += way;
  }
  Vector3 glass() { return session.glass(session.last_command.q).p; }
  const MonitorResult& seen() const { return session.monitor().result(); }

 private:
  Vector3 lead_ = Vector3::Zero();
};

/// At many instants of a motion, right before it or so near that it cannot stop: as far as the limits allow it does not
/// touch, and what it cannot help it does slowly.
TEST_F(Among, WhatAppearsOnTheWay) {
  follow({0.1, 0.5, 0.1});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> ahead(0.05, 0.4), pause(0.2, 0.7);
  int deep = 0, appeared = 0;
  for (int i = 0; i < 40; ++i) {
    session.set_obstacles(kNoObstacles);
    session.run(pause(random));
    const JointCommand& command = session.last_command;
    const Vector3 from = glass(), velocity = (session.glass(command.q + 0.001 * command.dq).p - from) / 0.001;
    if (velocity.norm() < 0.2) continue;
    const double distance = ahead(random);
    const Obstacles there = world({solid(Shape::sphere(0.05), from + distance * velocity.normalized())});
    Kinematics arm(ur5e());
    arm.set_position(command.q);
    double nearest = 1e9;
    for (int b = 0; b < static_cast<int>(ur5e().bodies.size()); ++b) {
      if (ur5e().bodies[b].link > 0) nearest = std::min(nearest, gap(arm, b, there.list[0].shape, there.list[0].at));
    }
    // To a stop straight on at the limits' least, 15 rad/s^2 with a metre of lever.
    const double needed = velocity.squaredNorm() / (2.0 * 5.0) + 0.005;
    if (nearest < needed) continue;
    ++appeared;
    const std::uint64_t before = seen().touching;
    session.set_obstacles(there);
    session.run(1.0);
    deep += seen().touching > before;
  }
  EXPECT_GT(appeared, 8);
  EXPECT_EQ(deep, 0);
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  session.expect_safe();
}

/// The arm leaves it as the hand moves away, and goes no deeper.
TEST_F(Among, WhatAppearsInsideTheArm) {
  stand();
  const Vector3 p = glass();
  session.set_obstacles(world({solid(Shape::sphere(0.03), p)}));
  session.run(0.1);
  const double deep = seen().smallest_distance;
  EXPECT_LT(deep, 0.0);
  session.run(1.0);
  EXPECT_GT(seen().smallest_distance, deep - 1e-3) << "no deeper";
  lead({0.0, 0.0, 0.25}, 1.0);
  session.run(2.0);
  EXPECT_GT(glass().z(), p.z() + 0.1) << "it comes off";
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  session.expect_safe();
}

/// At 1 m/s from the sides, over the glass and under it: it gives way.
TEST_F(Among, WhatFliesAtTheArm) {
  stand();
  int escaped = 0;
  for (const Vector3& from :
       {Vector3(0.0, 1.0, 0.06), Vector3(0.0, -1.0, 0.06), Vector3(0.0, 1.0, -0.07), Vector3(0.0, -1.0, -0.07)}) {
    const std::uint64_t before = seen().touching;
    Obstacles coming = world({solid(Shape::sphere(0.04), glass() + from, -Vector3(from.x(), from.y(), 0.0))});
    coming.time = session.clock().now();
    session.set_obstacles(coming);
    session.run(2.0);
    escaped += seen().touching == before;
    session.set_obstacles(kNoObstacles);
    session.run(1.0);
  }
  EXPECT_EQ(escaped, 4);
  session.expect_safe();
}

TEST_F(Among, WhatDisappears) {
  stand();
  session.set_obstacles(world({solid(Shape::box({0.4, 0.8, 0.1}), {0.75, 0.0, 0.19})}));
  lead({0.0, 0.0, -0.25}, 1.0);
  session.run(2.0);
  const double held = glass().z();
  session.set_obstacles(kNoObstacles);
  session.run(2.0);
  EXPECT_LT(glass().z(), held - 0.05) << "it follows again";
  session.expect_safe();
}

TEST_F(Among, SixtyFourThatMoveAboutAllTheTime) {
  follow();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 60; ++i) {
    std::vector<Obstacle> list;
    while (list.size() < Obstacles::kMost) {
      const Shape shapes[] = {Shape::sphere(0.05), Shape::capsule(0.1, 0.03), Shape::box({0.05, 0.1, 0.02})};
      list.push_back(solid(shapes[list.size() % 3], {unit(random), unit(random), 0.5 + 0.5 * unit(random)},
                           0.3 * random_vector(random)));
    }
    Obstacles all = world(list);
    all.time = session.clock().now();
    session.set_obstacles(all);
    session.run(0.1);
  }
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  session.expect_safe();
}

/// A ball moves along y towards an arm that moves away from it faster. An arm of 5 m/s^2 would need a few mm to reach
/// the ball's speed; the margin has 10 mm for that.
TEST_F(Among, WhatComesIsLeftBehindByAHandThatLeadsAway) {
  stand();
  for (const auto& [speed, left] : {std::pair(0.1, 0.001), std::pair(0.3, 0.02)}) {
    SCOPED_TRACE(speed);
    const Vector3 from = glass();
    Obstacle ball = solid(Shape::sphere(0.05), from + Vector3(0.0, -1.0, 0.05), {0.0, speed, 0.0});
    Kinematics arm(ur5e());
    arm.set_position(session.last_command.q);
    const auto nearest = [&] { return nearest_body(arm, world({ball}), 0, 0.0).distance - ball.margin; };
    while (nearest() > left) ball.at.p.y() += 0.001;
    lead({0.0, 0.35, 0.0}, 1.0);
    session.run(0.1);
    const std::uint64_t before = seen().touching;
    Obstacles coming = world({ball});
    coming.time = session.clock().now();
    session.set_obstacles(coming);
    session.run(1.0);
    EXPECT_EQ(seen().touching, before);
    EXPECT_GT(glass().y() - from.y(), 0.2);
    session.set_obstacles(kNoObstacles);
    lead({0.0, -0.35, 0.0}, 1.0);
    session.run(2.0);
  }
  session.expect_safe();
}

/// Like a stream of measured positions: each cycle has a new world, and none of the objects is in the way.
TEST_F(Among, WhatChangesInEachCycleFarAwayHoldsNothingUp) {
  double away = 5.0;
  session.around_control = [&](bool begins) {
    if (begins) session.set_obstacles(world({solid(Shape::sphere(0.05), {away += 1e-4, 5.0, 5.0})}));
  };
  follow();
  const std::uint64_t plans = session.view.plans, rejected = session.view.rejected_plans;
  session.run(2.0);
  EXPECT_GT(session.view.plans - plans, 1.9 * session.options().planner_rate_hz);
  EXPECT_EQ(session.view.rejected_plans, rejected);
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  session.expect_safe();
}

/// The stop is asked for at many instants, while the 64 objects around the arm, or over it, change in each cycle.
TEST_F(Among, AStopWinsHoweverMuchChanges) {
  std::mt19937 random(5);
  const auto vector = [&] { return random_vector(random); };
  int moved = 0;
  session.hand = sweeping({0.1, 0.3, 0.1}, 2.0);
  session.run(0.2);
  for (int trial = 0; trial < 12; ++trial) {
    ASSERT_TRUE(session.grip()) << session.view.reason;
    session.run(1.0 + 0.07 * trial);
    moved += session.last_command.dq.cwiseAbs().maxCoeff() > 0.2;
    session.around_control = [&, over = trial % 2 == 1](bool begins) {
      if (!begins) return;
      std::vector<Obstacle> list;
      while (list.size() < Obstacles::kMost) {
        list.push_back(solid(Shape::sphere(over ? 0.3 : 0.05), over ? (glass() + 0.05 * vector()).eval() : vector(),
                             10.0 * vector()));
      }
      Obstacles all = world(list);
      all.time = session.clock().now();
      session.set_obstacles(all);
    };
    const double soft = ControlSettings().soft_stop, hardest = stop_time(ur5e(), session.last_command.dq);
    session.ask_stop();
    EXPECT_TRUE(session.run_until([&] { return session.state() == SupervisionState::kStopping && session.at_rest(); },
                                  soft + hardest + 0.3));
    session.around_control = [](bool) {};
    session.set_obstacles(kNoObstacles);
    session.ask_reset();
    session.run(0.1);
  }
  EXPECT_GT(moved, 8);
  session.expect_safe();
}

/// A rod of this length through the glass, along an axis of the tool; carried.
Obstacle rod(const Vector3& axis, double length) {
  Obstacle result;
  result.shape = Shape::capsule(0.5 * length, 0.01);
  result.at = {0.5 * length * axis, Quaternion::FromTwoVectors(Vector3::UnitZ(), axis).toRotationMatrix()};
  result.carried = true;
  return result;
}

/// Down to the floor: what hangs below the glass stops it that much higher.
TEST_F(Among, WhatIsCarriedStaysAboveTheFloor) {
  stand();
  const Obstacle floor = solid(Shape::half_space(), {0.0, 0.0, -0.1});
  const double length = 0.3;
  const Obstacles carrying = world({floor, rod(-Vector3::UnitZ(), length)});
  session.set_obstacles(carrying);
  const std::uint64_t plans = session.view.plans;
  lead({0.0, 0.0, -0.8}, 1.5);
  session.run(4.0);
  Kinematics arm(ur5e());
  arm.set_position(session.last_command.q);
  const NearestBody lowest = nearest_body(arm, carrying, 0, 0.0);
  EXPECT_EQ(lowest.body, solid_of(1)) << "the rod's end";
  EXPECT_NEAR(lowest.distance, kMargin + PlannerSettings().clearance, 1e-3);
  EXPECT_EQ(seen().touching, 0u) << seen().nearest_body << ' ' << seen().nearest_obstacle;
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  EXPECT_GT(session.view.plans, plans + 60);
  const double height = glass().z();
  session.set_obstacles(world({floor}));
  session.run(2.0);
  EXPECT_LT(glass().z(), height - 0.02) << "without it the glass goes on down";
  EXPECT_EQ(seen().touching, 0u);
  session.expect_safe();
}

/// Moves towards the base with a rod that points there. The rod is kept off the arm; if only the monitor knows the rod,
/// it strikes the arm.
struct CarriedTowardsTheBase : Among, testing::WithParamInterface<bool> {};

TEST_P(CarriedTowardsTheBase, IsKeptFromTheArmItself) {
  const bool known = GetParam();
  stand();
  const Vector3 inwards = Vector3(0.0, 0.0, 0.1) - glass();
  const Matrix3 R = session.glass(session.last_command.q).q.toRotationMatrix();
  const Obstacles carrying = world({rod(R.transpose() * inwards.normalized(), inwards.norm() - 0.16)});
  known ? session.set_obstacles(carrying) : session.watch(carrying);
  lead(0.15 * inwards.normalized(), 1.0);
  session.run(3.0);
  lead(-0.15 * inwards.normalized(), 1.0);
  session.run(2.0);
  EXPECT_EQ(seen().in_contact > 0, !known) << seen().nearest[0] << ", " << seen().nearest[1];
  EXPECT_EQ(seen().nearest[1], "object 0");
  EXPECT_LT(seen().smallest_clearance, 0.005);
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  if (known) session.expect_safe();
}
INSTANTIATE_TEST_SUITE_P(Known, CarriedTowardsTheBase, testing::Bool());

/// Picks up and drops an object in each cycle: nothing is delayed.
TEST_F(Among, WhatIsTakenAndLetGoOfAllTheTimeHoldsNothingUp) {
  follow({0.05, 0.1, 0.05});
  const std::uint64_t plans = session.view.plans;
  for (int i = 0; i < 1000; ++i) {
    session.set_obstacles(i % 2 == 0 ? world({rod(Vector3::UnitZ(), 0.2)}) : kNoObstacles);
    session.run(0.002);
  }
  EXPECT_GT(session.view.plans, plans + 35);
  EXPECT_EQ(session.state(), SupervisionState::kEngaged) << session.view.reason;
  session.expect_safe();
}

}  // namespace
}  // namespace steadyhand

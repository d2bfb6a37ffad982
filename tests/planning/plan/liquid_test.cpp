#include <gtest/gtest.h>

#include "planning/plan/loop.hpp"
#include "steadyhand/planning/plan/level_stop.hpp"
#include "steadyhand/planning/plan/liquid_estimate.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "support/allocation_guard.hpp"

namespace steadyhand {
namespace {

/// Plans of 0.4 s for a random arm that holds its glass nearly upright.
struct Carrying {
  explicit Carrying(unsigned seed) : loop(seed), estimate(loop.model, {}) {
    JointVector q;
    do {
      q = random_joints(6, 2.0, loop.random);
      loop.arm.set_position(q);
    } while (loop.arm.R()(2, 2) < 0.97);
    stand(q, Time(0), plan);
    plan.intervals = 8;
  }
  void move(double speed) {
    plan.x[0].tail(6) = random_joints(6, speed, loop.random);
    for (int k = 0; k < 8; ++k) {
      plan.u[k] = random_joints(6, speed, loop.random);
      plan.x[k + 1] = loop.planner->ocp().next(plan.x[k], plan.u[k]);
    }
  }
  SloshState any_state() {
    return estimate.at_rest(plan.x[0].head(6)) + 0.5 * SloshState::NullaryExpr([&] { return normal(loop.random); });
  }

  Loop loop;
  LiquidEstimate estimate;
  Plan plan;
  std::normal_distribution<double> normal;
};

TEST(LiquidEstimate, GoesTheSameInOneGoAndInTwo) {
  Carrying c(3);
  GlassSettings deep;
  deep.height = 1.0;  // nothing is spilled
  c.estimate.set_glass(deep);
  for (int trial = 0; trial < 20; ++trial) {
    c.move(0.5);
    const SloshState start = c.any_state();
    const Time middle = from_seconds(0.05 * (1 + trial % 7));
    Plan rest = c.plan;  // from the middle on
    rest.start = middle;
    rest.intervals = 7 - trial % 7;
    for (int k = 0; k <= rest.intervals; ++k) rest.x[k] = c.plan.x[k + 1 + trial % 7];
    for (int k = 0; k < rest.intervals; ++k) rest.u[k] = c.plan.u[k + 1 + trial % 7];
    const Time end = from_seconds(0.4);
    const SloshState one = c.estimate.at(c.plan, start, c.plan.start, end);
    const SloshState two = c.estimate.at(rest, c.estimate.at(c.plan, start, c.plan.start, middle), middle, end);
    EXPECT_LT((one - two).norm(), 1e-6 * (1.0 + one.norm()));
  }
}

/// On the way, and through cycles without commands in which the arm brakes by itself.
TEST(LiquidEstimate, FollowsCommandsAsItFollowsAPlan) {
  Carrying c(8);
  GlassSettings deep;
  deep.height = 1.0;
  c.estimate.set_glass(deep);
  for (const double step : {0.002, 0.02, 0.05}) {
    c.move(1.0);
    const SloshState start = c.any_state();
    SloshState state = start;
    JointCommand command = sample(c.plan, Time(0));
    for (double t = step; t < 0.39; t += step) {
      const JointCommand next = sample(c.plan, from_seconds(t));
      state = c.estimate.between(command, next, state);
      command = next;
    }
    const SloshState planned = c.estimate.at(c.plan, start, Time(0), command.stamp.made);
    for (int mode = 0; mode < kSloshModes; ++mode) {
      const int first = slosh_entry(mode, 0);
      EXPECT_LT((state - planned).segment<4>(first).norm(), 0.02 * (1.0 + planned.segment<4>(first).norm())) << step;
    }
  }
  const JointCommand last = sample(c.plan, Time(0)), late = sample(c.plan, from_seconds(30.0));
  EXPECT_TRUE(c.estimate.between(last, late, c.any_state()).isApprox(c.estimate.at_rest(late.q)));
}

/// A profile that spares the liquid starts with the liquid in the glass, no matter what another profile did before.
TEST(LiquidEstimate, WhatWouldSwingOverTheRimHasSpilled) {
  Carrying c(7);
  const SloshModel model({}, 1.0, {0.92, 1.0, 1.08});
  const double rim = GlassSettings().freeboard();
  for (const double size : {0.1, 10.0, 100.0}) {
    c.move(0.5);
    const SloshState start = c.estimate.at_rest(c.plan.x[0].head(6)) + size * SloshState::Ones();
    for (const double t : {0.0, 0.1, 2.0}) {
      const SloshState state = c.estimate.at(c.plan, start, c.plan.start, from_seconds(t));
      for (int mode = 0; mode < kSloshModes; ++mode) {
        const auto wave = model.wave<double>(state, mode);
        const double by_force = model.height_by_force() * state.tail<3>().head<2>().norm();
        EXPECT_LE(std::hypot(wave[0], wave[1]), rim + by_force + 1e-12) << size << " " << t;
        if (t == 0.0 && size > 1.0) {
          EXPECT_GT(std::hypot(wave[2], wave[3]), 0.3 * rim);
        }
      }
    }
  }
}

/// A stationary glass is not integrated: the result is what the steps would give.
TEST(LiquidEstimate, StandingIsAPlanThatStands) {
  Carrying c(4);
  for (int k = 0; k < 8; ++k) {
    c.plan.u[k] = JointVector::Zero(6);
    c.plan.x[k + 1] = c.plan.x[0];
  }
  Plan none = c.plan;
  none.intervals = 0;
  const SloshState start = c.any_state(), rest = c.estimate.at_rest(c.plan.x[0].head(6));
  const SloshState by_steps = c.estimate.at(c.plan, start, c.plan.start, from_seconds(0.4));
  const SloshState at_once = c.estimate.at(none, start, none.start, from_seconds(0.4));
  EXPECT_LT((by_steps - at_once).norm(), 0.03 * (start - rest).norm());
  EXPECT_LT((c.estimate.at(none, start, none.start, from_seconds(600.0)) - rest).norm(), 1e-3);
}

TEST(LiquidEstimate, TheHighestWaveIsNotBelowAnyOnTheWay) {
  Carrying c(5);
  const SloshModel model({}, 1.0, {0.92, 1.0, 1.08});
  for (int trial = 0; trial < 20; ++trial) {
    c.move(0.4);
    ASSERT_TRUE(make_level_stop(c.loop.arm, 8, 0.5, {}, c.plan));
    const SloshState start = c.any_state();
    const double highest = c.estimate.highest(c.plan, start, Time(0));
    double seen = 0.0;
    for (double t = 0.05; t < 3.0; t += 0.01) {
      const SloshState state = c.estimate.at(c.plan, start, c.plan.start, from_seconds(t));
      for (int mode = 0; mode < kSloshModes; ++mode) {
        const auto wave = model.wave<double>(state, mode);
        seen = std::max(seen, std::hypot(wave[0], wave[1]));
      }
    }
    EXPECT_GE(highest, 0.97 * seen);
    c.estimate.walk(c.plan, start);
    EXPECT_NEAR(std::max(c.estimate.walked(8), c.estimate.highest_behind(c.plan, 8)), highest, 1e-9);
  }
}

TEST(LevelStop, EndsAtRestAndUpright) {
  Carrying c(6);
  int upright = 0;
  for (int trial = 0; trial < 50; ++trial) {
    c.plan.intervals = 8;
    c.move(0.2);
    ASSERT_TRUE(make_level_stop(c.loop.arm, 8, 0.61, {}, c.plan));
    EXPECT_EQ(c.plan.intervals, 21);
    EXPECT_EQ(c.plan.x[21].tail(6).norm(), 0.0);
    for (int k = 8; k < 21; ++k) {
      EXPECT_LT((c.plan.x[k + 1] - c.loop.planner->ocp().next(c.plan.x[k], c.plan.u[k])).norm(), 1e-12);
    }
    c.loop.arm.set_position(c.plan.x[21].head(6));
    upright += c.loop.arm.R()(2, 2) > std::cos(0.05);
  }
  EXPECT_GE(upright, 45);  // where the arm is stretched out it cannot
  EXPECT_FALSE(make_level_stop(c.loop.arm, 8, 1e3, {}, c.plan));
}

/// A planner of a problem with a liquid; the target keeps the glass as it is at home.
struct CarryingLoop : Loop {
  explicit CarryingLoop(unsigned seed) : Loop(seed) {
    settings.liquid.emplace();
    settings.weights = {{"position", {500}}, {"orientation", {1}}, {"velocity", {0.01}}, {"acceleration", {0.01}}};
    do {
      model.home = random_joints(6, 2.0, random);
      arm.set_position(model.home);
    } while (arm.R()(2, 2) < 0.98 || clearance(arm) < 0.02);
    planner = std::move(*Planner::make(model, settings, {}));
  }
  /// Back and forth along a level line.
  Reference along(Time start, double way, double speed) {
    Reference r = reference(start);
    arm.set_position(model.home);
    for (int k = 1; k <= r.nodes; ++k) {
      const double s = std::sin(speed * (to_seconds(start) + k * r.dt));
      r.tools[0].p[k - 1] = arm.p() + Vector3(way * s * s, 0.0, 0.0);
      r.tools[0].R[k - 1] = Eigen::AngleAxisd(0.5 * s, Vector3::UnitZ()) * arm.R();
    }
    return r;
  }
};

TEST(CarryingPlanner, SpillsOnlyWhereTheLiquidDoesNotCount) {
  for (const bool counts : {true, false}) {
    double highest = 0.0;
    for (const unsigned seed : {1u, 3u, 5u}) {
      CarryingLoop loop(seed);
      loop.planner->set_no_spill(counts);
      LiquidEstimate witness(loop.model, *loop.planner->ocp().liquid());
      SloshState state = witness.at_rest(loop.model.home);
      const SloshModel model({}, 1.0, {0.92, 1.0, 1.08});
      for (int i = 0; i < 100; ++i) {
        const Time now = from_seconds(0.05 * i), next = from_seconds(0.05 * (i + 1));
        const Plan& plan = loop.planner->update(loop.along(now, 0.15, 3.0));
        Plan rest = plan;
        state = witness.at(rest, state, rest.start, next);
        if (plan.start < now) FAIL() << "seed " << seed << ": refused, as " << to_string(loop.planner->fault());
        const auto wave = model.wave<double>(state, 1);
        highest = std::max(highest, std::hypot(wave[0], wave[1]));
        if (counts) {
          EXPECT_GT(loop.planner->highest_wave(), 0.0);
        }
      }
    }
    if (counts) {
      EXPECT_LT(highest, GlassSettings{}.freeboard());
    } else {
      EXPECT_GT(highest, GlassSettings{}.freeboard());  // or the motion was none
    }
  }
}

/// Where every stop behind the plan spills, it is the one of the lowest wave among those that pass the check.
TEST(CarryingPlanner, WhereEveryStopSpillsTheLowestOneIsTaken) {
  int compared = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    CarryingLoop loop(seed);
    LiquidEstimate witness(loop.model, *loop.planner->ocp().liquid());
    for (int i = 0; i < 60; ++i) {
      const Time now = from_seconds(0.05 * i);
      const Plan plan = loop.planner->update(loop.along(now, 0.4, 6.0));
      if (plan.start < now) continue;
      const SloshState liquid = loop.planner->instance().liquid[0].state;
      const double taken = witness.highest(plan, liquid, now);
      EXPECT_NEAR(loop.planner->highest_wave(), taken, 1e-9) << seed << " " << i;
      if (taken <= GlassSettings{}.freeboard()) continue;
      for (const int intervals : {8, 4, 1}) {
        for (const double periods : {1.0, 2.0, 3.0}) {
          Plan other = plan;
          const Trajectory& solution = loop.planner->solution().trajectory;
          for (int k = 0; k < 8; ++k) other.u[k] = solution.u[k];
          for (int k = 0; k <= 8; ++k) other.x[k] = solution.x[k];
          if (!make_level_stop(loop.arm, intervals, periods * witness.period(), {}, other)) continue;
          if (check_plan(other, plan.x[0], {}, loop.arm) != PlanFault::kNone) continue;
          EXPECT_GE(witness.highest(other, liquid, now), taken - 1e-9)
              << seed << " " << i << " " << intervals << " " << periods;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 20);  // or the motion was none
}

TEST(CarryingPlanner, WhatIsFarAwayPullsNoHarderThanAWaveCosts) {
  CarryingLoop loop(3);
  const double most = LiquidSettings{}.price / (2.0 * 500.0);  // m, at the loop's weight of `position`
  loop.arm.set_position(loop.model.home);
  const Vector3 tool = loop.arm.p();
  Reference near = loop.along(Time(0), 0.0, 1.0), far = near;
  for (int k = 0; k < near.nodes; ++k) {
    near.tools[0].p[k] = tool + Vector3(0.9 * most, 0.0, 0.0);
    far.tools[0].p[k] = tool + Vector3(0.0, 6.0 * most, 8.0 * most);
  }
  (void)loop.planner->update(near);
  EXPECT_EQ(loop.planner->instance().reference.tools[0].p[0], near.tools[0].p[0]);
  loop.planner->reset(loop.model.home, Time(0));
  (void)loop.planner->update(far);
  for (int k = 0; k < far.nodes; ++k)
    EXPECT_LT((loop.planner->instance().reference.tools[0].p[k] - tool - Vector3(0.0, 0.6 * most, 0.8 * most)).norm(),
              1e-12);
  loop.planner->reset(loop.model.home, Time(0));
  loop.planner->set_no_spill(false);
  (void)loop.planner->update(far);
  EXPECT_EQ(loop.planner->instance().reference.tools[0].p[0], far.tools[0].p[0]);
}

/// A term of the same name with one weight for all tools.
class OnePosition final : public Objective {
 public:
  OnePosition() : Objective({.name = "position", .label = "Position", .unit = "1/(m^2 s)"}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  double value(const Node& node, const JointVector& weight) const override {
    double sum = 0.0;
    for (int t = 0; t < node.arm.tool_count(); ++t) sum += error(node, t).squaredNorm();
    return weight[0] * sum;
  }
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      for (const int i : node.arm.chain(t)) gradient[i] += 2.0 * weight[0] * error(node, t).dot(node.arm.dp(i, t));
    }
  }
  void add_hessian(const Node& node, const JointVector& weight, NodeHessian& hessian) const override {
    for (int t = 0; t < node.arm.tool_count(); ++t) {
      for (const int j : node.arm.chain(t)) {
        for (const int i : node.arm.chain(t)) {
          if (i > j) break;
          hessian(i, j) +=
              2.0 * weight[0] * (node.arm.dp(i, t).dot(node.arm.dp(j, t)) + error(node, t).dot(node.arm.d2p(i, j, t)));
        }
      }
    }
  }
  using Objective::add_gradient, Objective::add_hessian, Objective::value;

 private:
  static Vector3 error(const Node& node, int tool) { return node.arm.p(tool) - node.reference[tool].p; }
};

TEST(CarryingPlanner, ReadsTheWeightOfAnOwnPositionTerm) {
  std::mt19937 random(4);
  RobotModel model = random_tree(0, 4, 5, random, false);
  model.pairs.clear();
  Kinematics arm(model);
  OcpSettings settings;
  settings.liquid.emplace();
  settings.objectives[0] = std::make_shared<OnePosition>();
  settings.weights = {{"position", {400}}, {"velocity", {0.1}}, {"acceleration", {0.02}}};
  auto made = Planner::make(model, settings, {});
  ASSERT_TRUE(made) << made.error().message;
  Planner& planner = **made;
  arm.set_position(model.home);
  Reference far;
  far.nodes = settings.horizon;
  for (int t = 0; t < 2; ++t) {
    far.tools[t].p.fill(arm.p(t) + Vector3(0.0, 6.0, 8.0));
    far.tools[t].R.fill(arm.R(t));
  }
  (void)planner.update(far);
  const double most = settings.liquid->price / (2.0 * 400.0);
  for (int t = 0; t < 2; ++t)
    EXPECT_LT((planner.instance().reference.tools[t].p[3] - arm.p(t) - most * Vector3(0.0, 0.6, 0.8)).norm(), 1e-12);
}

TEST(CarryingPlanner, AllocatesNothing) {
  CarryingLoop loop(2);
  std::vector<Reference> references;
  for (int i = 0; i < 40; ++i) references.push_back(loop.along(from_seconds(0.05 * i), 0.3, 5.0));
  for (int i = 0; i < 40; ++i) {
    loop.planner->continue_from(Plan(loop.planner->plan()));
    AllocationGuard guard;
    (void)loop.planner->update(references[i]);
    EXPECT_EQ(guard.count(), 0u) << i;
  }
}

/// A liquid that is set continues along the plan that is followed.
TEST(CarryingPlanner, StartsFromTheLiquidThatItIsGiven) {
  CarryingLoop loop(4);
  LiquidEstimate estimate(loop.model, LiquidSettings{});
  for (int i = 0; i < 5; ++i) (void)loop.planner->update(loop.along(from_seconds(0.05 * i), 0.3, 5.0));
  const Plan followed = loop.planner->plan();
  const SloshState given = estimate.at_rest(followed.x[0].head(followed.joints));
  const Time known = from_seconds(0.23), start = from_seconds(0.25);
  loop.planner->continue_from(followed);
  loop.planner->set_liquid(given, known);
  (void)loop.planner->update(loop.along(start, 0.3, 5.0));
  EXPECT_TRUE(loop.planner->instance().liquid[0].state.isApprox(estimate.at(followed, given, known, start)));
}

TEST(CarryingPlanner, TakesAnotherGlassAndRefusesNone) {
  CarryingLoop loop(3);
  EXPECT_TRUE(loop.planner->set_glass({0.04, 0.1, 0.05, 1e-6}));
  EXPECT_NEAR(loop.planner->instance().liquid[0].room, 0.05 - LiquidSettings{}.margin, 1e-12);
  EXPECT_TRUE(loop.planner->set_glass({0.035, 0.1, 0.098, 1e-6}));  // nearly to the rim
  EXPECT_GT(loop.planner->instance().liquid[0].room, 0.0);
  const double room = loop.planner->instance().liquid[0].room;
  for (const GlassSettings& glass : {GlassSettings{0.035, 0.1, 0.1, 1e-6}, GlassSettings{0.0, 0.1, 0.05, 1e-6},
                                     GlassSettings{0.035, 0.1, 0.05, -1.0}}) {
    EXPECT_FALSE(loop.planner->set_glass(glass));
  }
  EXPECT_EQ(loop.planner->instance().liquid[0].room, room);
  Loop dry(3);
  EXPECT_FALSE(dry.planner->set_glass({}));
  dry.planner->set_no_spill(true);
  EXPECT_NE(dry.planner->update(dry.reference(Time(0))).intervals, 0);
}

}  // namespace
}  // namespace steadyhand

#include "steadyhand/planning/plan/planner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "planning/plan/loop.hpp"
#include "steadyhand/planning/ocp/evaluation.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "support/allocation_guard.hpp"
#include "support/bodies.hpp"

namespace steadyhand {
namespace {

/// At any re-planning rate: the commands at 500 Hz stay within all limits, free of self-collision, and never step.
TEST(Planner, CommandsStayInsideAtAnyRate) {
  for (const double rate_hz : {11.0, 20.0, 37.0, 125.0}) {
    Loop loop(7);
    Tracker tracker(loop.model.home);
    JointCommand last = tracker.update(Time(0));
    int solved = 0, steps = 0;
    Time next_plan{0};
    for (int i = 0; i < 1500; ++i) {
      const Time now = Time(std::chrono::milliseconds(2 * i));
      if (now >= next_plan) {
        tracker.follow(loop.planner->update(loop.reference(now)));
        solved += loop.planner->plan().origin == PlanOrigin::kSolved;
        ++steps;
        next_plan += from_seconds(1.0 / rate_hz);
      }
      const JointCommand command = tracker.update(now);
      EXPECT_LE((command.ddq.cwiseAbs() - loop.model.acceleration_max).maxCoeff(), 1e-5);
      EXPECT_LE((command.dq.cwiseAbs() - loop.model.velocity_max).maxCoeff(), 1e-5);
      EXPECT_LE((command.q - loop.model.position_max).maxCoeff(), 1e-5);
      EXPECT_GE((command.q - loop.model.position_min).minCoeff(), -1e-5);
      EXPECT_LE((command.dq - last.dq).cwiseAbs().maxCoeff(), 0.002 * 15.0 + 1e-6);
      EXPECT_LE((command.q - last.q).cwiseAbs().maxCoeff(), 0.002 * M_PI + 1e-6);
      loop.arm.set_position(command.q);
      EXPECT_GE(clearance(loop.arm), -1e-5);
      last = command;
    }
    EXPECT_GE(solved, steps * 9 / 10) << rate_hz << " Hz";
  }
}

/// Plans that begin close to a limit, nearer than the margin at nodes, as most do at 500 Hz.
TEST(Planner, NoPlanPassesAPositionLimitInItsFirstInterval) {
  int near = 0, updates = 0;
  for (const unsigned seed : {7u, 8u, 9u}) {
    Loop loop(seed, 6.0);
    RobotModel narrow = loop.model;
    narrow.position_min = narrow.home.array() - 0.3;
    narrow.position_max = narrow.home.array() + 0.3;
    const auto planner = std::move(*Planner::make(narrow, loop.settings, {}));
    const JointVector margin = planner->ocp().position_margin();
    for (Time t{0}; t < std::chrono::seconds(2); t += std::chrono::milliseconds(2), ++updates) {
      const Plan& plan = planner->update(loop.reference(t));
      EXPECT_EQ(planner->fault(), PlanFault::kNone)
          << to_string(planner->fault()) << ", seed " << seed << ", " << to_seconds(t) << " s";
      const auto q = plan.x[0].head(6).array();
      near += (q > narrow.position_max.array() - margin.array()).any() ||
              (q < narrow.position_min.array() + margin.array()).any();
    }
  }
  EXPECT_GT(near, updates / 10);
}

/// Joints that take longer to stop than the horizon is long come to it fast and near their limits; behind every node a
/// stop is left, so that no plan is refused or cut short.
TEST(Planner, LeavesRoomToStopInsideThePositionLimits) {
  Loop loop(7, 6.0);
  RobotModel slow = loop.model;
  slow.pairs.clear();
  slow.acceleration_max.setConstant(4.0);
  slow.position_min = slow.home.array() - 1.0;
  slow.position_max = slow.home.array() + 1.0;
  const auto planner = Planner::make(slow, loop.settings, {});
  ASSERT_TRUE(planner) << planner.error().message;
  const int N = loop.settings.horizon;
  int tight = 0;
  for (Time t{0}; t < std::chrono::seconds(6); t += std::chrono::milliseconds(20)) {
    const Plan& plan = (*planner)->update(loop.reference(t));
    const Trajectory& solved = (*planner)->solution().trajectory;
    EXPECT_EQ((*planner)->fault(), PlanFault::kNone) << to_string((*planner)->fault()) << ", " << to_seconds(t) << " s";
    EXPECT_EQ(plan.x[N], solved.x[N]) << to_seconds(t) << " s";
    const JointVector dq = solved.x[N].tail(6);
    const JointVector rest = solved.x[N].head(6) + dq.cwiseProduct(dq.cwiseAbs()) / 8.0;
    tight += (dq.array().abs() > 1.0 && (rest - slow.home).array().abs() > 0.98).any();
  }
  EXPECT_GT(tight, 20);
}

TEST(Planner, BeginsFromItsLastSolution) {
  Loop loop(8);
  for (int i = 0; i < 5; ++i) (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
  const Trajectory last = loop.planner->solution().trajectory;
  (void)loop.planner->update(loop.reference(from_seconds(0.25)));  // an interval later
  EXPECT_EQ(loop.planner->guess().x[0], loop.planner->instance().x0);
  for (int k = 0; k + 1 < loop.settings.horizon; ++k) {
    EXPECT_LT((loop.planner->guess().u[k] - last.u[k + 1]).norm(), 1e-9) << k;
  }
}

TEST(Planner, KeepsTheLastPlanWhenSolvingFails) {
  Loop loop(8);
  for (int i = 0; i < 10; ++i) (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
  const Plan good = loop.planner->plan();
  ASSERT_EQ(good.origin, PlanOrigin::kSolved);

  Reference bad = loop.reference(from_seconds(0.5));
  bad.tools[0].p[3].x() = std::numeric_limits<double>::quiet_NaN();
  const Plan& kept = loop.planner->update(bad);
  EXPECT_EQ(kept.origin, PlanOrigin::kPrevious);
  EXPECT_EQ(kept.start, good.start);
  for (int k = 0; k <= good.intervals; ++k) EXPECT_EQ(kept.x[k], good.x[k]);
  EXPECT_EQ(sample(kept, from_seconds(10.0)).dq.norm(), 0.0);

  // It continues from the end of the kept plan, at rest.
  const Plan& next = loop.planner->update(loop.reference(from_seconds(5.0)));
  EXPECT_EQ(next.origin, PlanOrigin::kSolved);
  EXPECT_EQ(next.x[0].head(6), good.x[good.intervals].head(6));
}

/// FATROP throws if it cannot continue, and so may the libraries below it.
struct Thrower final : Solver {
  std::string_view name() const override { return "thrower"; }
  void solve(const OcpInstance&, const Trajectory&, const Multipliers*, const SolveBudget&,
             Solution& solution) override {
    solution.status = SolveStatus::kSolved;
    solution.iterations = 3;
    throw std::runtime_error("no way");
  }
};

TEST(Planner, KeepsTheLastPlanWhenTheSolverThrows) {
  Loop loop(8);
  for (int i = 0; i < 10; ++i) (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
  const Plan good = loop.planner->plan();
  loop.planner->use(std::make_unique<Thrower>());
  const Plan& kept = loop.planner->update(loop.reference(from_seconds(0.5)));
  EXPECT_NE(loop.planner->fault(), PlanFault::kNone);
  EXPECT_EQ(kept.origin, PlanOrigin::kPrevious);
  EXPECT_EQ(kept.start, good.start);
  for (int k = 0; k <= good.intervals; ++k) EXPECT_EQ(kept.x[k], good.x[k]);
  loop.planner->use(*make_solver(kDefaultSolver, loop.planner->ocp(), 1e-6));
  EXPECT_EQ(loop.planner->update(loop.reference(from_seconds(0.55))).origin, PlanOrigin::kSolved);
}

/// Planning a step of the way, and once more by a planner whose solver has no time for it.
TEST(Planner, KeepsTheLastPlanWhenTheSolverRunsOutOfTime) {
  for (const std::string& solver : solver_names()) {
    Loop loop(8);
    for (int i = 0; i < 10; ++i) (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
    const Plan good = loop.planner->plan();
    PlannerSettings hurried;
    hurried.solver = solver;
    hurried.budget.time_us = 1e-3;
    const auto planner = Planner::make(loop.model, loop.settings, hurried);
    ASSERT_TRUE(planner) << planner.error().message;
    (*planner)->continue_from(good);
    const Plan& kept = (*planner)->update(loop.reference(from_seconds(0.5)));
    EXPECT_NE((*planner)->fault(), PlanFault::kNone) << solver;
    EXPECT_EQ(kept.origin, PlanOrigin::kPrevious);
    EXPECT_EQ(kept.start, good.start);
    ASSERT_EQ(kept.intervals, good.intervals);
    for (int k = 0; k <= good.intervals; ++k) EXPECT_EQ(kept.x[k], good.x[k]);
  }
}

TEST(Planner, RefusesBadSettings) {
  Loop loop(9);
  const auto message = [&](OcpSettings ocp, PlannerSettings planner) {
    const auto result = Planner::make(loop.model, ocp, planner);
    return result ? std::string() : result.error().message;
  };
  OcpSettings ocp = loop.settings;
  ocp.horizon = 0;
  EXPECT_NE(message(ocp, {}).find("horizon is 0"), std::string::npos);
  ocp = loop.settings;
  ocp.dt = -1.0;
  EXPECT_NE(message(ocp, {}).find("dt is -1"), std::string::npos);
  PlannerSettings planner;
  planner.solver = "magic";
  EXPECT_NE(message(loop.settings, planner).find("unknown solver 'magic'"), std::string::npos);

  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto expect_refused = [&](const char* why, const auto& change) {
    PlannerSettings settings;
    change(settings);
    EXPECT_NE(message(loop.settings, settings).find(why), std::string::npos) << message(loop.settings, settings);
  };
  for (const double bad : {kNaN, -1.0, 1e300}) {
    expect_refused("tolerance is ", [=](auto& s) { s.tolerance = bad; });
    expect_refused("budget.time_us is ", [=](auto& s) { s.budget.time_us = bad; });
    expect_refused("check.command_rate_hz is ", [=](auto& s) { s.check.command_rate_hz = bad; });
    expect_refused("check.tolerance is ", [=](auto& s) { s.check.tolerance = bad; });
    expect_refused("clearance is ", [=](auto& s) { s.clearance = bad; });
    expect_refused("check.tool_speed_max is ", [=](auto& s) { s.check.tool_speed_max = bad; });
    expect_refused("check.elbow_speed_max is ", [=](auto& s) { s.check.elbow_speed_max = bad; });
  }
  expect_refused("tolerance is 0; it must be above 0, to 0.1", [](auto& s) { s.tolerance = 0.0; });
  expect_refused("command_rate_hz is 0; it must be above 0", [](auto& s) { s.check.command_rate_hz = 0.0; });
  expect_refused("budget.iterations is 0; it must be at least 1", [](auto& s) { s.budget.iterations = 0; });

  RobotModel broken = loop.model;
  broken.bodies[0].link = 50;
  EXPECT_NE(Planner::make(broken, loop.settings, {}).error().message.find("the links are 0 to 6"), std::string::npos);
}

/// w q_0^2 with good derivatives, but without a value.
struct WithoutValue final : Objective {
  WithoutValue() : Objective({.name = "without_value", .label = "Without value", .unit = "1"}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  double value(const Node&, const JointVector&) const override { return std::numeric_limits<double>::quiet_NaN(); }
  void add_gradient(const Node& node, const JointVector& weight, NodeGradient& gradient) const override {
    gradient[0] += 2.0 * weight[0] * node.arm.q()[0];
  }
  void add_hessian(const Node&, const JointVector& weight, NodeHessian& hessian) const override {
    hessian(0, 0) += 2.0 * weight[0];
  }
  using Objective::add_gradient, Objective::add_hessian, Objective::value;
};

TEST(Planner, WhatHasNoValueIsNotCalledSolved) {
  Loop loop(9);
  loop.settings.objectives.push_back(std::make_shared<WithoutValue>());
  loop.settings.weights["without_value"] = {1.0};
  const std::unique_ptr<Planner> planner = std::move(*Planner::make(loop.model, loop.settings, {}));
  const Plan& plan = planner->update(loop.reference(Time(0)));
  EXPECT_TRUE(std::isnan(planner->solution().objective));
  EXPECT_EQ(planner->solution().status, SolveStatus::kFeasible);
  EXPECT_NE(plan.origin, PlanOrigin::kSolved);
}

/// A constraint whose one row is set by the test.
struct Odd final : Constraint {
  Odd() : Constraint({"odd", "Odd", "m"}) {}
  Nodes nodes() const override { return Nodes::kStates; }
  int rows() const override { return count; }
  Bounds bounds(int) const override { return limits; }
  double value(const Node& node, int) const override { return node.arm.p().y(); }
  void add_gradient(const Node&, int, double, NodeGradient&) const override {}
  void add_hessian(const Node&, int, double, NodeHessian&) const override {}
  int entry(int) const override { return place; }
  EntryRange support(int, int) const override { return range; }
  double activation_margin(int) const override { return margin; }
  using Constraint::add_gradient, Constraint::add_hessian, Constraint::value;

  int count = 1, place = -1;
  Bounds limits{-1.0, 1.0};
  EntryRange range{0, 6};
  double margin = 1.0;
};

/// With such constraints a solver would write to the wrong place.
TEST(Planner, RefusesConstraintsThatCannotBe) {
  Loop loop(9);
  const auto message = [&](const ConstraintMaker& maker) {
    OcpSettings settings = loop.settings;
    settings.constraints.push_back(maker);
    const auto result = Planner::make(loop.model, settings, {});
    return result ? std::string() : result.error().message;
  };
  const auto with = [&](const auto& change) {
    auto odd = std::make_shared<Odd>();
    change(*odd);
    return message([=](const RobotModel&, const OcpSettings&) { return odd; });
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(with([](Odd&) {}), "");
  EXPECT_EQ(with([](Odd& odd) { odd.count = -3; }), "constraints: 'odd' has -3 rows; it must have 0 or more");
  for (const Bounds limits : {Bounds{1.0, -1.0}, Bounds{kNaN, 1.0}, Bounds{0.0, kNaN}}) {
    EXPECT_NE(with([&](Odd& odd) { odd.limits = limits; }).find("the lower bound must not be above"),
              std::string::npos);
  }
  for (const int place : {12, 99, -2}) {  // 12: an acceleration, which a state does not have
    EXPECT_NE(with([&](Odd& odd) { odd.place = place; }).find("the entries are 0 to 11"), std::string::npos) << place;
  }
  for (const EntryRange range : {EntryRange{-5, 3}, EntryRange{0, 500}, EntryRange{5, 2}}) {
    EXPECT_NE(with([&](Odd& odd) { odd.range = range; }).find("they must lie from 0 to 18"), std::string::npos);
  }
  EXPECT_NE(with([](Odd& odd) { odd.margin = kNaN; }).find("activation margin of nan"), std::string::npos);
  EXPECT_EQ(message([](const RobotModel&, const OcpSettings&) -> std::shared_ptr<const Constraint> {
              throw std::runtime_error("no table there");
            }),
            "constraints: one cannot be made: no table there");
}

/// However slow, a stop takes some time, and is a plan that can be checked and followed.
TEST(StraightStop, OfAnySpeedEndsAtRestWithinTheLimits) {
  Loop loop(13);
  for (const double speed : {0.0, 1e-300, 1e-12, 1e-8, 1e-3, 1.0, 3.0}) {
    const JointVector q = loop.model.home, dq = JointVector::Constant(6, -speed), none = JointVector::Zero(6);
    Plan stop;
    make_straight_stop(loop.model, {{Time(0), Time(0)}, q, dq, none}, 0.0, stop);
    const double span = stop.intervals * stop.dt;
    EXPECT_EQ(stop.x[0].tail(6), dq);
    EXPECT_EQ(sample(stop, from_seconds(1e6)).dq, none);
    for (int k = 0; k < stop.intervals; ++k) {
      EXPECT_LE((stop.u[k].cwiseAbs() - loop.model.acceleration_max).maxCoeff(), 1e-9);
    }
    EXPECT_GE(stop.dt, 5e-4) << speed;
    EXPECT_NEAR(span, speed > 0.0 ? std::max(stop_time(loop.model, dq), 1e-3) : 0.0, 1e-9);
    EXPECT_LT((sample(stop, from_seconds(1.0)).q - q - 0.5 * span * dq).norm(), 1e-9);
  }
}

/// Every fault is found in a good plan that is spoilt in one place.
TEST(PlanCheck, FindsEachFault) {
  Loop loop(10);
  for (int i = 0; i < 5; ++i) (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
  const Plan good = loop.planner->plan();
  const auto fault = [&](const auto& spoil) {
    Plan plan = good;
    spoil(plan);
    return check_plan(plan, good.x[0], {}, loop.arm);
  };
  EXPECT_EQ(fault([](Plan&) {}), PlanFault::kNone);
  EXPECT_EQ(fault([](Plan& p) { p.x[2][1] = std::nan(""); }), PlanFault::kNotFinite);
  EXPECT_EQ(fault([](Plan& p) { p.u[1][0] = std::numeric_limits<double>::infinity(); }), PlanFault::kNotFinite);
  EXPECT_EQ(fault([](Plan& p) { p.x[0][0] += 1e-3; }), PlanFault::kDiscontinuous);
  EXPECT_EQ(fault([](Plan& p) { p.x[3][7] += 1e-3; }), PlanFault::kDiscontinuous);
  EXPECT_EQ(fault([](Plan& p) { p.intervals = 8; }), PlanFault::kNotAtRest);
  EXPECT_EQ(fault([](Plan& p) { p.u[0][0] = 16.0; }), PlanFault::kAcceleration);

  StateVector elsewhere = good.x[0];
  elsewhere[2] += 1e-3;
  EXPECT_EQ(check_plan(good, elsewhere, {}, loop.arm), PlanFault::kDiscontinuous);

  const auto with_limit = [&](const auto& change) {
    RobotModel model = loop.model;
    change(model);
    Kinematics arm(model);
    return check_plan(good, good.x[0], {}, arm);
  };
  EXPECT_EQ(with_limit([](RobotModel& m) { m.velocity_max.setConstant(0.01); }), PlanFault::kVelocity);
  EXPECT_EQ(with_limit([&](RobotModel& m) { m.position_max = good.x[0].head(6).array() - 1.0; }), PlanFault::kPosition);
  const auto apart = [&](const BodyPair& pair, int k) {
    loop.arm.set_position(good.x[k].head(6));
    return center_distance(loop.arm, pair);
  };
  RobotModel close = loop.model;  // one pair, which comes nearer on the way, and is near already
  const auto nears = [&](const BodyPair& pair) { return apart(pair, 0) - apart(pair, 8) > 0.005; };
  const auto found = std::find_if(loop.model.pairs.begin(), loop.model.pairs.end(), nears);
  ASSERT_NE(found, loop.model.pairs.end());
  close.pairs = {*found};
  close.bodies[found->first].shape.radius = apart(*found, 0) - 0.001 - close.bodies[found->second].shape.radius;
  EXPECT_EQ(with_limit([&](RobotModel& m) { m = close; }), PlanFault::kSelfCollision);
}

/// An arm that braked by itself may be slightly beyond a limit: a plan must be able to return it.
TEST(PlanCheck, LetsAPlanLeadBackFromBeyondALimitAndNoFurther) {
  Loop loop(10);
  const auto fault = [&](const RobotModel& model, double acceleration) {  // all joints for 0.1 s, and then to rest
    Plan plan;
    stand(model.home, Time(0), plan);
    plan.intervals = 4;
    for (int k = 0; k < 4; ++k) {
      plan.u[k] = JointVector::Constant(6, k < 2 ? acceleration : -acceleration);
      plan.x[k + 1].resize(12);
      plan.x[k + 1] << plan.x[k].head(6) + plan.dt * plan.x[k].tail(6) + 0.5 * plan.dt * plan.dt * plan.u[k],
          plan.x[k].tail(6) + plan.dt * plan.u[k];
    }
    Kinematics arm(model);
    return check_plan(plan, plan.x[0], {}, arm);
  };
  RobotModel beyond = loop.model;
  beyond.position_max = beyond.home.array() - 0.001;
  EXPECT_EQ(fault(beyond, -0.3), PlanFault::kNone);
  EXPECT_EQ(fault(beyond, 0.0), PlanFault::kNone);
  EXPECT_EQ(fault(beyond, 0.3), PlanFault::kPosition);

  RobotModel touching = loop.model;  // one pair of spheres, larger than where it is now
  const auto gap = [&](double offset) {
    loop.arm.set_position(loop.model.home.array() + offset);
    return center_distance(loop.arm, touching.pairs[0]);
  };
  const auto moves = [&](const BodyPair& pair) {
    touching.pairs = {pair};
    return std::abs(gap(1e-3) - gap(0.0)) > 1e-4;
  };
  ASSERT_TRUE(std::any_of(loop.model.pairs.begin(), loop.model.pairs.end(), moves));
  const auto [first, second] = touching.pairs[0];
  touching.bodies[first].shape.radius = gap(0.0) + 0.002 - touching.bodies[second].shape.radius;
  const double deeper = gap(1e-3) < gap(0.0) ? 0.3 : -0.3;
  EXPECT_EQ(fault(touching, -deeper), PlanFault::kNone);
  EXPECT_EQ(fault(touching, 0.0), PlanFault::kNone);
  EXPECT_EQ(fault(touching, deeper), PlanFault::kSelfCollision);
}

TEST(PlanCheck, LooksBetweenNodes) {
  Loop loop(10);
  const Plan plan = up_and_back(loop.model.home);
  RobotModel model = loop.model;
  EXPECT_EQ(check_plan(plan, plan.x[0], {}, loop.arm), PlanFault::kNone);
  model.position_max = model.home.array() + 0.002;
  Kinematics narrow(model);
  EXPECT_EQ(check_plan(plan, plan.x[0], {}, narrow), PlanFault::kPosition);

  // One pair of spheres that touches half-way only.
  const auto apart = [&](const BodyPair& pair, const JointVector& q) {
    loop.arm.set_position(q);
    return center_distance(loop.arm, pair);
  };
  const JointVector above = sample(plan, from_seconds(0.5 * plan.dt)).q, last = plan.x[2].head(6);
  const auto nears = [&](const BodyPair& pair) {
    return std::min(apart(pair, loop.model.home), apart(pair, last)) - apart(pair, above) > 1e-3;
  };
  const auto found = std::find_if(loop.model.pairs.begin(), loop.model.pairs.end(), nears);
  ASSERT_NE(found, loop.model.pairs.end());
  const auto touching = [&](double overlap_half_way) {
    RobotModel close = loop.model;
    close.pairs = {*found};
    close.bodies[found->first].shape.radius =
        apart(*found, above) + overlap_half_way - close.bodies[found->second].shape.radius;
    return close;
  };
  const RobotModel half_way = touching(5e-4);
  Kinematics arm(half_way);
  EXPECT_EQ(check_plan(plan, plan.x[0], {}, arm), PlanFault::kSelfCollision);

  // At rest nothing overlaps by more either.
  Plan there;
  stand(loop.model.home, Time(0), there);
  there.intervals = 2;
  const JointVector way = 2.0 * (above - loop.model.home);
  for (int k = 0; k < 2; ++k) {
    there.u[k] = (k == 0 ? 1.0 : -1.0) * way / (there.dt * there.dt);
    there.x[k + 1].resize(12);
    there.x[k + 1] << there.x[k].head(6) + there.dt * there.x[k].tail(6) + 0.5 * there.dt * there.dt * there.u[k],
        there.x[k].tail(6) + there.dt * there.u[k];
  }
  const double end = apart(*found, loop.model.home + way);
  ASSERT_LT(end, apart(*found, loop.model.home) - 4e-3);
  const RobotModel at_rest = touching(end + 3e-3 - apart(*found, above));
  Kinematics resting(at_rest);
  EXPECT_EQ(check_plan(there, there.x[0], {}, resting), PlanFault::kSelfCollision);
}

/// Fast swings past each pair of links, with bodies as large as the nodes and the points half-way just allow.
void look_at_all_times(Loop& loop) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int near = 0, passed_by_points = 0, refused = 0, free = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    Plan plan;  // to rest in six intervals of 50 ms
    stand(2.0 * JointVector::NullaryExpr(6, [&] { return unit(random); }), Time(0), plan);
    plan.intervals = 6;
    plan.x[0].tail(6) = 3.0 * JointVector::NullaryExpr(6, [&] { return unit(random); });
    for (int k = 0; k < 6; ++k) {
      plan.u[k] = -plan.x[0].tail(6) / (6.0 * plan.dt);
      plan.x[k + 1].resize(12);
      plan.x[k + 1] << plan.x[k].head(6) + plan.dt * plan.x[k].tail(6) + 0.5 * plan.dt * plan.dt * plan.u[k],
          plan.x[k].tail(6) + plan.dt * plan.u[k];
    }
    RobotModel close = loop.model;
    close.pairs = {loop.model.pairs[random() % loop.model.pairs.size()]};
    const auto apart = [&](double t) {
      loop.arm.set_position(sample(plan, from_seconds(t)).q);
      return gap(loop.arm, close.pairs[0]);
    };
    double at_points = 1e9, at_all_times = 1e9;
    for (int i = 0; i <= 2 * plan.intervals; ++i) at_points = std::min(at_points, apart(0.5 * i * plan.dt));
    for (int i = 0; i <= 64 * plan.intervals; ++i) at_all_times = std::min(at_all_times, apart(i * plan.dt / 64.0));
    if (at_all_times > 0.2 || at_all_times < 0.001) continue;
    ++near;
    const auto [first, second] = close.pairs[0];
    const auto fault_with_gap = [&](double left, double distance) {
      close.bodies[first].shape = loop.model.bodies[first].shape.inflated(distance - left);
      Kinematics arm(close);
      return check_plan(plan, plan.x[0], {}, arm);
    };
    passed_by_points += at_points - at_all_times > 5e-5;
    refused += at_points - at_all_times > 5e-5 && fault_with_gap(0.0, at_points) == PlanFault::kSelfCollision;
    free += fault_with_gap(1e-4, at_all_times) == PlanFault::kNone;
  }
  EXPECT_GT(passed_by_points, 20);
  EXPECT_EQ(refused, passed_by_points);
  EXPECT_EQ(free, near);
}

TEST(PlanCheck, LooksAtAllTimes) {
  Loop loop(10);
  look_at_all_times(loop);
}

TEST(PlanCheck, LooksAtAllTimesForEveryShape) {
  Loop loop(10);
  vary_bodies(loop.model, loop.random);
  for (Body& body : loop.model.bodies) {
    if (body.shape.kind == ShapeKind::kCylinder) body.shape = Shape::capsule(0.08, 0.03);  // which grow with corners
  }
  Kinematics other(loop.model);
  loop.arm = other;
  look_at_all_times(loop);
}

/// A small body on an arm of 1 m that turns at 3 rad/s flies past another one: it is nearest half-way between two
/// moments, at constant velocity, so the acceleration does not show it. Sharp bodies that overlap have no distance
/// between cores to use.
TEST(PlanCheck, SeesWhatFliesPastBetweenTwoLooks) {
  RobotModel model;
  model.name = "one joint";
  model.joints = {Joint{"turn", JointType::kRevolute, Eigen::Isometry3d::Identity(), Vector3::UnitZ()}};
  model.link_names = {"base", "arm"};
  model.tools = {{"tool", Eigen::Isometry3d(Eigen::Translation3d(1.0, 0.0, 0.0)), 1}};
  model.home = JointVector::Zero(1);
  model.velocity_max = JointVector::Constant(1, 4.0);
  model.acceleration_max = JointVector::Constant(1, 40.0);
  model.position_max = JointVector::Constant(1, 6.0);
  model.position_min = -model.position_max;
  constexpr double kRadius = 0.01, kSpeed = 3.0;
  Plan plan;  // an interval at constant speed, then to rest
  stand(model.home, Time(0), plan);
  plan.intervals = 4;
  plan.x[0][1] = kSpeed;
  for (int k = 0; k < 4; ++k) {
    plan.u[k] = JointVector::Constant(1, k == 0 ? 0.0 : -kSpeed / (3.0 * plan.dt));
    plan.x[k + 1] = StateVector::Zero(2);
    plan.x[k + 1] << plan.x[k][0] + plan.dt * plan.x[k][1] + 0.5 * plan.dt * plan.dt * plan.u[k][0],
        plan.x[k][1] + plan.dt * plan.u[k][0];
  }
  const double quarter = 0.25 * plan.dt * kSpeed;  // rad, between two looks
  const auto fault = [&](double nearest, const Shape& tip, const Shape& post) {
    const Eigen::AngleAxisd turned(quarter, Vector3::UnitZ());
    const Vector3 there = turned * Vector3(1.0 + 2.0 * kRadius + nearest, 0.0, 0.0);
    model.bodies = {Body{"post", 0, post, Eigen::Translation3d(there) * Eigen::Isometry3d(turned)},
                    Body{"tip", 1, tip, Eigen::Isometry3d(Eigen::Translation3d(1.0, 0.0, 0.0))}};
    model.pairs = {{0, 1}};
    Kinematics arm(model);
    return check_plan(plan, plan.x[0], {}, arm);
  };
  const Shape ball = Shape::sphere(kRadius), sharp = Shape::box(Vector3::Constant(kRadius)),
              disc = Shape::cylinder(kRadius, 0.002);
  for (const auto& [tip, post] : std::vector<std::pair<Shape, Shape>>{{ball, ball},
                                                                      {ball, Shape::capsule(0.05, kRadius)},
                                                                      {ball, sharp},
                                                                      {sharp, sharp},
                                                                      {disc, sharp},
                                                                      {sharp, disc},
                                                                      {disc, disc}}) {
    for (const double nearest : {-0.015, -0.01, -1e-3, -1e-4})
      EXPECT_EQ(fault(nearest, tip, post), PlanFault::kSelfCollision) << nearest;
    // Half of the way in the shortest span that is looked at, 0.3 mm, is all that is known of sharp ones.
    EXPECT_EQ(fault(tip.radius + post.radius > 0.0 ? 1e-4 : 5e-4, tip, post), PlanFault::kNone);
  }
}

TEST(PlanCheck, RefusesIntervalsThatAreNone) {
  Loop loop(10);
  for (const double dt : {0.0, -0.05, std::nan(""), 1e300, std::numeric_limits<double>::infinity()}) {
    Plan plan;
    stand(loop.model.home, Time(0), plan);
    plan.dt = dt;
    EXPECT_EQ(check_plan(plan, plan.x[0], {}, loop.arm), PlanFault::kNotFinite) << dt;
  }
}

/// The caps against speeds by differences: a plan passes with a little more than it has, and not with a little less.
TEST(PlanCheck, CapsTheSpeedOfToolAndElbow) {
  Loop loop(10);
  for (int i = 0; i < 5; ++i) (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
  const Plan plan = loop.planner->plan();
  const auto places = [&](Time t) {
    const JointVector q = sample(plan, t).q;
    loop.arm.set_position(q);
    Eigen::Isometry3d elbow = Eigen::Isometry3d::Identity();
    for (int k = 0; k < 3; ++k) elbow = elbow * loop.model.joints[k].origin * motion(loop.model.joints[k], q[k]);
    return std::pair(Vector3(loop.arm.p()), Vector3(elbow.translation()));
  };
  double tool = 0.0, elbow = 0.0;
  for (int i = 0; i <= 2 * plan.intervals; ++i) {  // a plan may begin beyond a cap, though not lead further
    const Time at = plan.start + from_seconds(0.5 * i * plan.dt), h = std::chrono::microseconds(10);
    const auto before = places(at - h), after = places(at);
    tool = std::max(tool, (after.first - before.first).norm() / to_seconds(h));
    elbow = std::max(elbow, (after.second - before.second).norm() / to_seconds(h));
  }
  ASSERT_GT(tool, 0.05);
  ASSERT_GT(elbow, 0.01);
  const auto fault = [&](double tool_max, double elbow_max) {
    PlanCheckSettings settings;
    settings.tool_speed_max = tool_max;
    settings.elbow_speed_max = elbow_max;
    return check_plan(plan, plan.x[0], settings, loop.arm);
  };
  EXPECT_EQ(fault(1.01 * tool, 1.01 * elbow), PlanFault::kNone);
  EXPECT_EQ(fault(0.99 * tool, 0.0), PlanFault::kToolSpeed);
  EXPECT_EQ(fault(0.0, 0.99 * elbow), PlanFault::kElbowSpeed);
}

TEST(Allocation, NoneInKinematicsEvaluationCheckAndTracking) {
  Loop loop(11);
  for (int i = 0; i < 5; ++i) (void)loop.planner->update(loop.reference(from_seconds(0.05 * i)));
  Evaluation evaluation(loop.planner->ocp());
  evaluation.set_instance(loop.planner->instance());
  Tracker tracker(loop.model.home);
  NodeGradient gradient = NodeGradient::Zero(18);
  NodeHessian hessian = NodeHessian::Zero(18, 18);

  AllocationGuard guard;
  evaluation.set_trajectory(loop.planner->solution().trajectory);
  for (int k = 0; k <= 8; ++k) {
    (void)evaluation.objective(k);
    evaluation.add_objective_gradient(k, 1.0, gradient);
    evaluation.add_objective_hessian(k, 1.0, hessian);
    for (const ConstraintRow row : evaluation.rows(k)) {
      evaluation.add_constraint_gradient(k, row, 1.0, gradient);
      evaluation.add_constraint_hessian(k, row, 1.0, hessian);
    }
  }
  (void)check_plan(loop.planner->plan(), loop.planner->instance().x0, {}, loop.arm);
  tracker.follow(loop.planner->plan());
  (void)tracker.update(from_seconds(0.1));
  EXPECT_EQ(guard.count(), 0u);
}

TEST(Allocation, TheGuardSeesOne) {
  AllocationGuard guard;
  double* volatile kept = new double[100];  // that the compiler may not leave out
  delete[] kept;
  EXPECT_GE(guard.count(), 1u);
}

TEST(Allocation, NoneInTheWholePlanner) {
  Loop loop(12);
  std::vector<Reference> references;
  for (int i = 0; i < 20; ++i) references.push_back(loop.reference(from_seconds(0.05 * i)));
  for (int i = 0; i < 10; ++i) (void)loop.planner->update(references[i]);
  for (int i = 10; i < 20; ++i) {
    AllocationGuard guard;
    (void)loop.planner->update(references[i]);
    EXPECT_EQ(guard.count(), 0u) << i;
  }
}

}  // namespace
}  // namespace steadyhand

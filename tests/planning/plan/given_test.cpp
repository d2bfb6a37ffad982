#include <gtest/gtest.h>

#include "planning/plan/loop.hpp"
#include "support/allocation_guard.hpp"

namespace steadyhand {
namespace {

constexpr auto kSecond = std::chrono::seconds(1);
const JointSet kRight(0b111110000);

/// A planner for two random arms, whose targets wander.
struct TwoArms {
  explicit TwoArms(unsigned seed, bool liquid = false)
      : random(seed), model(random_tree(0, 4, 5, random, false)), arm(model) {
    const auto fits = [&] {
      arm.set_position(model.home);
      return clearance(arm) > 0.02 && (!liquid || (arm.R(0)(2, 2) > 0.8 && arm.R(1)(2, 2) > 0.8));
    };
    while (!fits()) model.home = random_joints(9, 2.0, random);
    settings.weights = {{"position", {500}}, {"orientation", {5}}, {"velocity", {0.1}}, {"acceleration", {0.02}}};
    if (liquid) settings.liquid.emplace();
    planner = std::move(*Planner::make(model, settings, {}));
    way = random_joints(9, liquid ? 0.2 : 0.6, random);
  }

  const Plan& update(Time now) {
    Reference r;
    r.start = now;
    r.nodes = settings.horizon;
    for (int k = 1; k <= r.nodes; ++k) {
      arm.set_position(model.home + std::sin(2.0 * (to_seconds(now) + k * r.dt)) * way);
      for (int t = 0; t < 2; ++t) {
        r.tools[t].p[k - 1] = arm.p(t);
        r.tools[t].R[k - 1] = arm.R(t);
      }
    }
    AllocationGuard guard;
    const Plan& plan = planner->update(r);
    if (now >= kSecond) {
      EXPECT_EQ(guard.count(), 0u);
    }
    return plan;
  }

  std::mt19937 random;
  RobotModel model;
  Kinematics arm;
  OcpSettings settings;
  JointVector way;
  std::unique_ptr<Planner> planner;
};

/// The right arm stops where it is, stays there exactly, and follows again later. The left arm always follows.
TEST(GivenJoints, StopAndStayWhileTheOthersFollow) {
  for (const bool liquid : {false, true}) {
    int updates = 0, refused = 0, refused_given = 0, cut = 0, still = 0;
    double left_way = 0.0;
    for (unsigned seed = 1; seed <= 6; ++seed) {
      TwoArms arms(seed, liquid);
      JointCommand last = sample(arms.planner->plan(), Time(0));
      Plan plan = arms.planner->plan();
      for (Time now{0}; now < 4 * kSecond; now += std::chrono::milliseconds(20)) {
        const bool given = now >= kSecond && now < 3 * kSecond;
        arms.planner->set_given(given ? kRight : JointSet());
        plan = arms.update(now);
        ++updates;
        (given ? refused_given : refused) += arms.planner->fault() != PlanFault::kNone;
        const JointCommand command = sample(plan, now);
        EXPECT_LT((command.q - last.q).lpNorm<Eigen::Infinity>(), 0.02 * M_PI);
        if (given && last.dq.tail(5).isZero(0.0)) {
          ++still;
          EXPECT_EQ(command.q.tail(5), last.q.tail(5)) << to_seconds(now);
          for (int k = 0; k < plan.intervals; ++k) {
            EXPECT_EQ(plan.u[k].tail(5), JointVector::Zero(5));
            EXPECT_EQ(plan.x[k + 1].segment(4, 5), command.q.tail(5));
          }
          left_way += (command.q - last.q).head(4).norm();
        }
        if (given) {
          for (int k = 0; k < arms.settings.horizon; ++k)
            EXPECT_EQ(arms.planner->solution().trajectory.u[k].tail(5), arms.planner->guess().u[k].tail(5));
        }
        cut += plan.intervals > 0 && plan.start == now && plan.u[1] != arms.planner->solution().trajectory.u[1];
        last = command;
      }
    }
    std::cout << refused << " and " << refused_given << " of " << updates << " plans refused, " << cut << " cut short, "
              << still << " of stationary joints\n";
    // A hard stop may spill: then the arm first follows its last plan to the end.
    EXPECT_LT(refused_given, liquid ? updates / 5 : updates / 100);
    EXPECT_GT(still, updates / 5);
    EXPECT_GT(left_way, liquid ? 0.1 : 1.0);
  }
}

/// From any speed and near any limit a given joint is at rest after the fewest intervals, and within its limits.
TEST(GivenJoints, BrakeEvenlyInTheFewestIntervals) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int trial = 0; trial < 300; ++trial) {
    TwoArms arms(1 + trial % 3);
    const double a = arms.model.acceleration_max[5], dq = 2.0 * unit(random), dt = arms.settings.dt;
    Plan plan;
    stand(arms.model.home, Time(0), plan);
    plan.intervals = 1;
    plan.dt = dt;
    plan.x[1] = plan.x[0];
    plan.x[0][9 + 5] = dq;
    plan.u[0] = JointVector::Zero(9);
    // Stops at the hardest where the position limit is.
    const bool tight = trial % 2;
    if (tight) plan.x[0][5] = (dq > 0 ? 1.0 : -1.0) * (M_PI - dq * dq / (2.0 * a) - a * dt * dt / 8.0);
    plan.x[1][5] = plan.x[0][5];
    arms.planner->continue_from(plan);
    arms.planner->set_given(kRight);
    (void)arms.update(Time(0));
    const Trajectory& guess = arms.planner->guess();
    const int fewest = std::max(1, static_cast<int>(std::ceil(std::abs(dq) / (a * dt) - 1e-9)));
    for (int k = 0; k <= arms.settings.horizon; ++k) {
      const StateVector& x = guess.x[k];
      EXPECT_LE(std::abs(x[5]), M_PI + 1e-9);
      EXPECT_LT(std::abs(x[9 + 5]), k >= fewest ? 1e-12 : 2.1);
      if (k == arms.settings.horizon) continue;
      if (!tight && k < fewest) {
        EXPECT_NEAR(guess.u[k][5], -dq / (fewest * dt), 1e-9);
      }
      if (k > fewest) {
        EXPECT_EQ(guess.u[k][5], 0.0);
      }
    }
  }
}

}  // namespace
}  // namespace steadyhand

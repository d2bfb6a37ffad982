// The control stage alone: plans and states are handed to it as a test wants them.
#include "session/control_stage.hpp"

#include "plan/straight_stop.hpp"
#include "session/virtual_session.hpp"

namespace steadyhand {
namespace {

/// An arm that does at once what it is told.
struct Loop {
  explicit Loop(const RobotModel& arm, double soft_stop = 0.0) : model(arm) {
    ControlSettings settings;
    settings.soft_stop = soft_stop;
    control = std::make_unique<ControlStage>(model, settings, links);
    state.status = ArmStatus::kFollowing;
    state.joints = {{}, model.home, JointVector::Zero(model.dof())};
    command = {{}, model.home, state.joints.dq, state.joints.dq};
    state.joints.stamp.made = std::chrono::seconds(5);
    for (int i = 0; i < 3; ++i) cycle();
    EXPECT_EQ(control->state(), SupervisionState::kReady);
  }

  const JointCommand& cycle() {
    ++state.cycle;
    state.joints.stamp.made += kPeriod;
    state.joints.q = command.q + 0.002 * command.dq;
    state.joints.dq = command.dq;
    return command = control->step(state).command;
  }
  Time now() const { return state.joints.stamp.made; }
  /// A plan from home on, these accelerations of two joints for 20 ms each.
  Plan plan(const std::vector<double>& first, const std::vector<double>& last) const {
    Plan made;
    stand(model.home, now() + 5 * kPeriod, made);
    made.dt = 0.02;
    made.intervals = static_cast<int>(first.size());
    for (int k = 0; k < made.intervals; ++k) {
      made.u[k] = JointVector::Zero(6);
      made.u[k][0] = first[k];
      made.u[k][5] = last[k];
      const JointVector q = made.x[k].head(6), dq = made.x[k].tail(6);
      made.x[k + 1].resize(12);
      made.x[k + 1] << q + made.dt * dq + 0.5 * made.dt * made.dt * made.u[k], dq + made.dt * made.u[k];
    }
    return made;
  }

  static constexpr Time kPeriod = std::chrono::milliseconds(2);
  RobotModel model;
  Links links;
  std::unique_ptr<ControlStage> control;
  ArmState state;
  JointCommand command;
};

/// The first joint turns fast; the last one moves a little just then.
const std::vector<double> kTurn = {15, 15, 15, 15, 15, 15, 15, -15, -15, -15, -15, -15, -15, -15},
                          kMove = {0, 0, 0, 0, 0, 15, 0, -15, 0, 0, 0, 0, 0, 0};

/// Brakes in the fastest moment; where the last joint may not go beyond `room` rad from home.
struct Braked {
  double farthest = 0.0;  ///< rad, of the last joint
  double astray = 0.0;    ///< rad, most, from the plan
  double took = 0.0;      ///< s
};
Braked brake(double room) {
  RobotModel model = ur5e();
  model.position_max[5] = model.home[5] + room;
  Loop loop(model);
  const Plan plan = loop.plan(kTurn, kMove);
  loop.links.plan.write(plan);
  while (loop.now() < plan.start + std::chrono::milliseconds(140)) loop.cycle();
  EXPECT_NEAR(loop.command.dq[0], 2.1, 0.05);
  EXPECT_NEAR(loop.command.dq[5], 0.3, 0.05);
  const Time begin = loop.now();
  loop.links.asked.stop();
  Braked result;
  do {
    const JointCommand& c = loop.cycle();
    EXPECT_EQ(loop.control->state(), SupervisionState::kStopping);
    result.farthest = std::max(result.farthest, c.q[5] - model.home[5]);
    result.astray = std::max(result.astray, (c.q - sample(plan, loop.now()).q).cwiseAbs().maxCoeff());
  } while (!loop.control->at_rest() && loop.now() < begin + std::chrono::seconds(1));
  result.took = to_seconds(loop.now() - begin);
  EXPECT_TRUE(loop.command.dq.isZero(0.0));
  return result;
}

TEST(Brake, LeadsStraightOnWhereThereIsRoom) {
  const Braked result = brake(1.0);
  EXPECT_NEAR(result.took, 2.1 / 15.0, 0.006);
  EXPECT_GT(result.farthest, 0.025);  // 9 mrad, and on for half the time at 0.3 rad/s
  EXPECT_GT(result.astray, 0.01);
}

TEST(Brake, FollowsItsPlanToTheEndIfStraightOnWouldLeadIntoALimit) {
  const Braked result = brake(0.014);
  EXPECT_LT(result.farthest, 0.0125);  // as planned
  EXPECT_LT(result.astray, 1e-12);
  EXPECT_NEAR(result.took, 2.1 / 15.0, 0.006);
}

/// A plan is followed only if it begins in time and on what is followed.
TEST(TakingPlans, OnesThatDoNotContinueWhatIsFollowedAreRefused) {
  const auto taken = [](const std::function<void(Plan&)>& spoil) {
    Loop loop(ur5e());
    Plan plan = loop.plan(kTurn, kMove);
    spoil(plan);
    loop.links.plan.write(plan);
    for (int i = 0; i < 20; ++i) loop.cycle();
    ControlView view;
    EXPECT_TRUE(loop.links.control_view.read(view));
    EXPECT_EQ(view.plans + view.rejected_plans, 1u);
    EXPECT_EQ(view.plans == 1, loop.command.dq[0] > 0.0);
    return view.plans == 1;
  };
  EXPECT_TRUE(taken([](Plan&) {}));
  EXPECT_TRUE(taken([](Plan& p) { p.start -= 4 * Loop::kPeriod - Time(1); }));
  EXPECT_FALSE(taken([](Plan& p) { p.start -= 5 * Loop::kPeriod; }));  // that cycle is over
  EXPECT_FALSE(taken([](Plan& p) { p.x[0][3] += 1e-5; }));
  EXPECT_FALSE(taken([](Plan& p) { p.x[0][9] += 1e-5; }));
}

/// While it has a stop behind it, planned or not, the arm is off its plan when it is measured away from that.
TEST(OffPlan, IsJudgedByWhereTheArmWentInAGap) {
  for (const bool astray : {false, true}) {
    Loop loop(ur5e());
    const Plan plan = loop.plan(kTurn, kMove);
    loop.links.plan.write(plan);
    while (loop.now() < plan.start + std::chrono::milliseconds(100)) loop.cycle();
    // 40 ms without a command, in which it braked.
    const JointCommand before = loop.command;
    const double braked = 0.036;
    JointCommand own = before;
    own.stamp.made += 20 * Loop::kPeriod;
    own.dq = before.dq.array() - before.dq.array().sign() * 15.0 * braked;
    own.q += 0.004 * before.dq + 0.5 * braked * (before.dq + own.dq);
    loop.state.cycle += 20;
    loop.state.joints.stamp.made += 20 * Loop::kPeriod;
    loop.state.carried_on = own;
    loop.command = own;
    if (astray) loop.command.q[0] += 0.06;
    loop.cycle();
    EXPECT_EQ(loop.control->state(), astray ? SupervisionState::kStopping : SupervisionState::kReady);
    EXPECT_LT((loop.command.q - own.q - 0.002 * own.dq).cwiseAbs().maxCoeff(), 1e-4);
  }
}

}  // namespace
}  // namespace steadyhand

#include "steadyhand/arms/driver/composite_arm.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "support/allocation_guard.hpp"
#include "support/manual_clock.hpp"
#include "support/ur/lockstep.hpp"

namespace steadyhand {
namespace {

using Makers = std::array<CompositeArm::Make, kMaxTools>;

/// A simulated arm with faults.
class Faulty final : public Arm {
 public:
  Faulty(const RobotModel& model, const SimulatedArmSettings& settings, Clock& clock)
      : arm(model, model.home, settings, clock) {}
  const ArmInfo& info() const override { return arm.info(); }
  ArmState receive() override {
    for (; misses > 0; --misses) (void)arm.receive();
    ArmState state = arm.receive();
    if (std::exchange(lies, false)) state.joints.q[0] = std::numeric_limits<double>::quiet_NaN();
    bridged += state.carried_on.has_value();
    return state;
  }
  void send(const JointCommand& command) override {
    last = command;
    arm.send(command);
  }
  void restart() override {
    ++restarts;
    arm.restart();
  }

  SimulatedArm arm;
  bool lies = false;              ///< the next position is no number
  int misses = 0;                 ///< cycles, before the next
  int restarts = 0, bridged = 0;  ///< so far
  JointCommand last;
};

/// Two arms of three joints each, whose joints swing by 0.2 (1 - cos 2t) until they are to brake.
struct TwoArms : testing::Test {
  TwoArms() : random(3), robot(random_tree(0, 3, 3, random, false)) {
    robot.home = random_joints(6, 1.0, random);
    robot.tools[1].gripper_time = 0.5;
  }
  void start(CompositeArm::Turns turns = CompositeArm::Turns::kOneThread, Clock* of = nullptr) {
    Makers make;
    for (int i = 0; i < kMaxTools; ++i) {
      make[i] = [this, i](const RobotModel& model, Clock& own) -> Result<std::unique_ptr<Arm>> {
        auto made = std::make_unique<Faulty>(model, settings[i], own);
        part[i] = made.get();
        return std::unique_ptr<Arm>(std::move(made));
      };
    }
    auto made = CompositeArm::make(robot, make, of != nullptr ? *of : clock, turns);
    ASSERT_TRUE(made) << made.error().message;
    arm = *std::move(made);
    follow();
  }
  void follow() {
    for (int i = 0; i < 1000 && (i == 0 || state.status == ArmStatus::kStarting); ++i) state = arm->receive();
    ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
    begin = state.joints.stamp.made;
    from = state.joints.q;
    brakes = false;
  }
  /// Sends the command of this cycle, and receives the next.
  void cycle() {
    const Time now = state.joints.stamp.made;
    if (!brakes) {
      const double t = to_seconds(now - begin);
      const JointVector ones = JointVector::Ones(6);
      command = {{now, now},
                 from + 0.2 * (1.0 - std::cos(2.0 * t)) * ones,
                 0.4 * std::sin(2.0 * t) * ones,
                 0.8 * std::cos(2.0 * t) * ones};
      make_straight_stop(robot, command, 0.0, plan);
      arm->follow(plan);
    } else {
      command = sample(plan, now);
    }
    command.gripper = gripper;
    arm->send(command);
    state = arm->receive();
  }
  void run(double seconds) {
    const Time until = state.joints.stamp.made + from_seconds(seconds);
    while (state.status == ArmStatus::kFollowing && state.joints.stamp.made < until) cycle();
  }
  /// As the control loop does after carried_on, and after a stop.
  void brake(const JointCommand& own, double duration) {
    make_straight_stop(robot, own, duration, plan);
    arm->follow(plan);
    brakes = true;
  }

  std::mt19937 random;
  RobotModel robot;
  ManualClock clock;
  std::array<SimulatedArmSettings, kMaxTools> settings;
  std::array<Faulty*, kMaxTools> part{};
  std::unique_ptr<CompositeArm> arm;
  ArmState state;
  JointCommand command;
  Plan plan;
  bool brakes = false;
  Time begin{0};
  JointVector from;
  PerTool<std::optional<double>> gripper{};
};

TEST_F(TwoArms, HaveModelsWhoseToolsAreWhereThoseOfTheRobotAre) {
  const RobotModel tree = random_tree(0, 2, 5, random);
  const JointVector q = random_joints(7, 2.0, random);
  Kinematics whole(tree);
  whole.set_position(q);
  for (int i = 0; i < kMaxTools; ++i) {
    const auto model = arm_of(tree, i);
    ASSERT_TRUE(model) << model.error().message;
    Kinematics alone(*model);
    alone.set_position(q.segment(first_joint_of(tree, i), model->dof()));
    EXPECT_LT((alone.p() - whole.p(i)).norm(), 1e-12);
    EXPECT_LT((alone.R() - whole.R(i)).norm(), 1e-12);
  }
}

TEST_F(TwoArms, NeedARobotWithTwoAndNoSharedJoint) {
  const auto refusal = [](const RobotModel& model) { return arm_of(model, 0).error().message; };
  EXPECT_EQ(refusal(random_arm(6, random)), "robot 'random' has one tool; two drivers are for robots with two");
  EXPECT_NE(refusal(random_tree(1, 3, 3, random)).find("joint 'joint_0' of robot 'random' moves both arms"),
            std::string::npos);
}

TEST_F(TwoArms, AreOneOfTheSlowestAndEachMovesItsGripper) {
  settings[0].rate_hz = 125.0;
  settings[1].latency = 0.02;
  start();
  EXPECT_EQ(arm->info().joints, 6);
  EXPECT_EQ(arm->info().rate_hz, 500.0) << "that of the later one";
  EXPECT_NEAR(arm->info().delay, 0.03, 1e-9);
  EXPECT_FALSE(arm->info().hardware);
  EXPECT_EQ(arm->info().gripper, (PerTool<bool>{false, true}));
  EXPECT_EQ(arm->info().name, "left: random left (simulated); right: random right (simulated)");
  gripper = {1.0, 1.0};
  run(0.25);
  EXPECT_FALSE(state.joints.gripper[0]);
  EXPECT_NEAR(state.joints.gripper[1].value_or(-1.0), 0.5, 0.05);
}

/// Whatever their own delays and rates are.
TEST_F(TwoArms, LagAlike) {
  for (const double rate : {500.0, 180.0, 60.0}) {
    settings[0] = settings[1] = {};
    settings[0].rate_hz = rate;
    settings[0].quantisation = settings[1].quantisation = 0.0;
    settings[1].latency = 0.04;
    start();
    run(1.0);
    ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
    const double t = to_seconds(state.joints.stamp.made - begin) - arm->info().delay;
    const JointVector there = from + JointVector::Constant(6, 0.2 * (1.0 - std::cos(2.0 * t)));
    EXPECT_LT((state.joints.q - there).cwiseAbs().maxCoeff(), 3e-3) << rate;
    EXPECT_EQ(part[0]->bridged + part[1]->bridged, 0);
  }
}

TEST_F(TwoArms, BrakeTheOneThatFollowsWhenTheOtherStops) {
  for (const int stops : {0, 1}) {
    start();
    run(0.6);
    part[stops]->arm.trip("protective stop");
    while (state.status == ArmStatus::kFollowing) cycle();
    EXPECT_EQ(state.status, ArmStatus::kStopped);
    EXPECT_EQ(state.reason, stops == 0 ? "left: protective stop" : "right: protective stop");
    EXPECT_TRUE(state.part_follows);
    brake(command, 0.1);
    JointVector end = plan.x[plan.intervals].head(6);
    for (int i = 0; i < 200; ++i) {
      cycle();
      ASSERT_EQ(state.status, ArmStatus::kStopped);
      ASSERT_TRUE(state.part_follows) << i;
      ASSERT_TRUE(state.reason.ends_with(": protective stop"));
    }
    const int obeys = stops == 0 ? 3 : 0;
    EXPECT_LT((state.joints.q - end).segment(obeys, 3).cwiseAbs().maxCoeff(), 1e-4);
    EXPECT_LT(state.joints.dq.norm(), 1e-3);
    arm->restart();
    follow();
    EXPECT_EQ(part[stops]->restarts, 1);
    EXPECT_EQ(part[1 - stops]->restarts, 0) << "it followed all the time";
    run(0.5);
    EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  }
}

/// A control loop that does not brake it.
TEST_F(TwoArms, BrakeByThemselvesIfCommandsDoNotContinueTheirs) {
  start();
  run(0.6);
  part[0]->arm.trip("protective stop");
  while (state.status == ArmStatus::kFollowing) cycle();
  stand(state.joints.q, state.joints.stamp.made, plan);
  arm->follow(plan);
  arm->send(sample(plan, state.joints.stamp.made));
  for (int i = 0; i < 300; ++i) {
    state = arm->receive();
    EXPECT_FALSE(state.part_follows);
    EXPECT_EQ(state.reason, "left: protective stop");
  }
  EXPECT_LT(state.joints.dq.norm(), 1e-3);
  EXPECT_EQ(part[1]->arm.receive().status, ArmStatus::kFollowing) << "held";
}

TEST_F(TwoArms, StopWhereOneReportsNoNumbers) {
  start();
  run(0.5);
  part[1]->lies = true;
  while (state.status == ArmStatus::kFollowing) cycle();
  EXPECT_EQ(state.reason, "right: the arm reports no numbers");
  EXPECT_TRUE(state.part_follows) << "the left one";
  brake(command, 0.1);
  for (int i = 0; i < 200; ++i) cycle();
  EXPECT_EQ(state.status, ArmStatus::kStopped) << "also when it reports numbers again";
  EXPECT_LT(state.joints.dq.norm(), 1e-3);
  arm->restart();
  follow();
}

/// Neither thread got a turn: the control loop learns where both are, and continues from there.
TEST_F(TwoArms, ContinueWhereTheyAreAfterMissedCycles) {
  for (const int missed : {1, 3, 10}) {
    for (const double other_rate : {500.0, 180.0}) {
      settings[1].rate_hz = other_rate;
      start();
      run(0.6);
      part[1]->misses = missed;
      clock.advance((missed + 0.5) / other_rate);
      state = arm->receive();
      ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
      ASSERT_TRUE(state.carried_on);
      EXPECT_NEAR(to_seconds(state.joints.stamp.made - state.carried_on->stamp.made), 0.002, 1e-9);
      EXPECT_GT(part[1]->bridged, 0);
      brake(*state.carried_on, 0.3);
      run(0.5);
      EXPECT_EQ(state.status, ArmStatus::kFollowing) << missed << " at " << other_rate << ": " << state.reason;
      EXPECT_LT((part[1]->last.q - plan.x[plan.intervals].segment(3, 3)).norm(), 1e-9);
    }
  }
}

TEST_F(TwoArms, AreStoppedByACommandThatIsNotOnItsPlan) {
  start();
  run(0.3);
  make_straight_stop(robot, command, 0.0, plan);
  arm->follow(plan);
  command = sample(plan, state.joints.stamp.made);
  command.q[5] += 2e-6;
  arm->send(command);
  state = arm->receive();
  EXPECT_EQ(state.reason, "a command is not on the plan that was checked");
  for (int i = 0; i < 300; ++i) state = arm->receive();
  EXPECT_LT(state.joints.dq.norm(), 1e-3);
  EXPECT_FALSE(state.part_follows);
}

TEST_F(TwoArms, AllocateNothing) {
  settings[1].rate_hz = 180.0;
  start();
  const AllocationGuard guard;
  run(0.3);
  part[0]->arm.trip("protective stop");
  for (int i = 0; i < 10; ++i) cycle();
  arm->restart();
  for (int i = 0; i < 200 && state.status != ArmStatus::kFollowing; ++i) state = arm->receive();
  EXPECT_EQ(guard.count(), 0u);
  EXPECT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
}

TEST_F(TwoArms, RunOnTwoThreads) {
  MonotonicClock real;
  settings[1].rate_hz = 300.0;
  for (SimulatedArmSettings& each : settings) each.command_timeout = 10.0;
  start(CompositeArm::Turns::kThread, &real);
  for (int i = 0; i < 300 && state.status == ArmStatus::kFollowing; ++i) {
    if (state.carried_on) brake(*state.carried_on, 0.2);  // on a machine that has other things to do
    cycle();
  }
  EXPECT_TRUE(state.status == ArmStatus::kFollowing || state.reason.ends_with("no command arrived in time"))
      << state.reason;
  part[0]->arm.trip("protective stop");
  while (state.status == ArmStatus::kFollowing) cycle();
  EXPECT_FALSE(state.reason.empty());
  arm.reset();
}

/// An arm of Universal Robots and a simulated one.
TEST_F(TwoArms, OfDifferentKinds) {
  robot = random_tree(0, 6, 2, random, false);
  robot.home = random_joints(8, 1.0, random);
  UrLockstep* ur = nullptr;
  const Makers make = {[&](const RobotModel& model, Clock& own) -> Result<std::unique_ptr<Arm>> {
                         auto made = std::make_unique<UrLockstep>(model, FakeUrController::Settings(), own);
                         ur = made.get();
                         return std::unique_ptr<Arm>(std::move(made));
                       },
                       [](const RobotModel& model, Clock& own) -> Result<std::unique_ptr<Arm>> {
                         return std::unique_ptr<Arm>(new SimulatedArm(model, model.home, {}, own));
                       }};
  arm = *CompositeArm::make(robot, make, clock, CompositeArm::Turns::kOneThread);
  EXPECT_TRUE(arm->info().hardware);
  for (int i = 0; i < 5000 && state.status != ArmStatus::kFollowing; ++i) state = arm->receive();
  ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  const JointVector q0 = state.joints.q;
  begin = state.joints.stamp.made;
  const auto swing = [&] {
    const Time now = state.joints.stamp.made;
    const double t = to_seconds(now - begin);
    const JointVector ones = JointVector::Ones(8);
    command = {{now, now}, q0 + 0.2 * (1.0 - std::cos(2.0 * t)) * ones, 0.4 * std::sin(2.0 * t) * ones, 0.0 * ones};
    make_straight_stop(robot, command, 0.0, plan);
    arm->follow(plan);
    arm->send(command);
    state = arm->receive();
  };
  for (int i = 0; i < 400; ++i) swing();
  ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
  const double then = 0.8 - arm->info().delay;
  EXPECT_LT((state.joints.q - q0 - JointVector::Constant(8, 0.2 * (1.0 - std::cos(2.0 * then)))).cwiseAbs().maxCoeff(),
            5e-3);
  ur->controller.protective_stop();
  while (state.status == ArmStatus::kFollowing) swing();
  EXPECT_TRUE(state.reason.starts_with("left: protective stop")) << state.reason;
  EXPECT_TRUE(state.part_follows);
}

}  // namespace
}  // namespace steadyhand

// The contract of every arm: add a maker to the list below, and its arm is tested too.
#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/driver/composite_arm.hpp"
#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "steadyhand/core/arrows.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "support/manual_clock.hpp"
#include "support/ur/lockstep.hpp"
#ifdef STEADYHAND_MUJOCO
#include "steadyhand/arms/mujoco/mujoco_arm.hpp"
#include "steadyhand/arms/mujoco/mujoco_library.hpp"
#include "steadyhand/files/config/places.hpp"
#endif
#ifdef STEADYHAND_ROS2
#include "support/ros2/lockstep.hpp"
#endif

namespace steadyhand {
namespace {

struct ArmMaker {
  std::string name;
  std::function<std::unique_ptr<Arm>(const RobotModel&, Clock&)> make;
};

ArmMaker simulated(const std::string& name, const SimulatedArmSettings& settings) {
  return {name, [settings](const RobotModel& model, Clock& clock) {
            return std::make_unique<SimulatedArm>(model, model.home, settings, clock);
          }};
}

ArmMaker universal_robots(const std::string& name, const FakeUrController::Settings& settings) {
  return {name, [settings](const RobotModel& model, Clock& clock) {
            return std::make_unique<UrLockstep>(model, settings, clock);
          }};
}

/// The arm as two: each has half of the joints, and is simulated by itself.
class Halves final : public Arm {
 public:
  Halves(RobotModel model, const std::array<SimulatedArmSettings, kMaxTools>& settings, Clock& clock)
      : model_(std::move(model)) {
    model_.joints[3].parent = 0;
    model_.tools = {{"left", model_.tool().origin, 3}, {"right", model_.tool().origin, 6}};
    std::array<CompositeArm::Make, kMaxTools> make;
    for (int i = 0; i < kMaxTools; ++i) {
      make[i] = [&settings, i](const RobotModel& half, Clock& own) -> Result<std::unique_ptr<Arm>> {
        return std::unique_ptr<Arm>(new SimulatedArm(half, half.home, settings[i], own));
      };
    }
    arm_ = *CompositeArm::make(model_, make, clock, CompositeArm::Turns::kOneThread);
  }
  const ArmInfo& info() const override { return arm_->info(); }
  ArmState receive() override { return arm_->receive(); }
  void follow(const Plan& plan) override { arm_->follow(plan); }
  void send(const JointCommand& command) override { arm_->send(command); }
  void restart() override { arm_->restart(); }

 private:
  RobotModel model_;
  std::unique_ptr<CompositeArm> arm_;
};

ArmMaker halves(const std::string& name, const SimulatedArmSettings& left, const SimulatedArmSettings& right) {
  return {name, [left, right](const RobotModel& model, Clock& clock) {
            return std::make_unique<Halves>(model, std::array{left, right}, clock);
          }};
}

/// Where mujoco-core is installed.
std::vector<ArmMaker> mujoco() {
#ifdef STEADYHAND_MUJOCO
  const auto maker = [](const std::string& name, const MujocoSettings& settings) {
    return ArmMaker{name, [settings](const RobotModel& model, Clock& clock) {
                      EXPECT_TRUE(load_mujoco(Places::standard().packages));
                      ChainDynamics dynamics;
                      dynamics.links.assign(model.dof() + 1, {2.0, Vector3::Zero(), 0.01 * Matrix3::Identity()});
                      dynamics.effort_max = JointVector::Constant(model.dof(), 300.0);
                      return *MujocoArm::make(model, dynamics, {}, {}, settings, clock);
                    }};
  };
  MujocoSettings slow, yielding;
  slow.latency = 0.02;
  yielding.contact = ContactPolicy::kYield;
  return {maker("mujoco", {}), maker("mujoco_slow", slow), maker("mujoco_yielding", yielding)};
#else
  return {};
#endif
}

/// Where Cyclone DDS is installed.
std::vector<ArmMaker> ros2() {
#ifdef STEADYHAND_ROS2
  const auto maker = [](const std::string& name, const ReferenceController::Settings& settings) {
    return ArmMaker{name, [settings](const RobotModel& model, Clock& clock) {
                      return std::make_unique<Ros2Lockstep>(model, settings, clock);
                    }};
  };
  ReferenceController::Settings plain, desired, deferred;
  desired.parameters.interpolate_from_desired_state = true;
  desired.permuted = false;
  deferred.parameters.allow_trajectory_replacement = true;
  return {maker("ros2", plain), maker("ros2_from_desired_state", desired), maker("ros2_replacement", deferred)};
#else
  return {};
#endif
}

std::vector<ArmMaker> makers() {
  SimulatedArmSettings ideal, slow, noisy;
  ideal.latency = ideal.servo_lag = ideal.quantisation = 0.0;
  slow.latency = 0.02;
  slow.servo_lag = 0.04;
  noisy.noise = 2e-5;
  SimulatedArmSettings rare, rare_and_slow = slow;
  rare.rate_hz = rare_and_slow.rate_hz = 200.0;
  FakeUrController::Settings e_series, cb3, old_protocol;
  cb3.version = {3, 15, 8, 106339};
  old_protocol.version = cb3.version;
  old_protocol.newest_protocol = 1;
  std::vector<ArmMaker> all = {simulated("simulated", {}),
                               simulated("ideal", ideal),
                               simulated("slow", slow),
                               simulated("noisy", noisy),
                               halves("halves", {}, {}),
                               halves("halves_noisy", noisy, {}),
                               halves("halves_two_rates", rare, {}),
                               halves("halves_two_delays", {}, slow),
                               halves("halves_two_rates_and_delays", {}, rare_and_slow),
                               universal_robots("ur", e_series),
                               universal_robots("ur_cb3", cb3),
                               universal_robots("ur_protocol_1", old_protocol)};
  for (ArmMaker& maker : mujoco()) all.push_back(std::move(maker));
  for (ArmMaker& maker : ros2()) all.push_back(std::move(maker));
  return all;
}

class ArmContract : public testing::TestWithParam<ArmMaker> {
 protected:
  ArmContract() : random(3), model(random_arm(6, random, false)) {
    model.home = random_joints(6, 1.0, random);
    arm = GetParam().make(model, clock);
  }

  JointCommand command(const JointVector& q, const JointVector& dq, Time t) const {
    return {{t, t}, q, dq, JointVector::Zero(6)};
  }
  /// As a session does: first the plan, which goes from the command to the next one, and then to rest.
  void send(const JointCommand& command, const JointCommand& next) {
    const int braking = 1 + static_cast<int>(stop_time(model, next.dq) * arm->info().rate_hz);
    plan.stamp = command.stamp;
    plan.start = command.stamp.made;
    plan.dt = 1.0 / arm->info().rate_hz;
    plan.joints = 6;
    plan.intervals = 1 + braking;
    plan.x[0].resize(12);
    plan.x[0] << command.q, command.dq;
    for (int k = 0; k < plan.intervals; ++k) {
      const JointVector q = plan.x[k].head(6), dq = plan.x[k].tail(6);
      plan.u[k] = (k == 0 ? JointVector(next.dq - dq) : JointVector(-next.dq / braking)) / plan.dt;
      plan.x[k + 1].resize(12);
      plan.x[k + 1] << q + plan.dt * dq + 0.5 * plan.dt * plan.dt * plan.u[k], dq + plan.dt * plan.u[k];
    }
    arm->follow(plan);
    arm->send(command);
  }
  /// Receives until the arm follows; the last state.
  ArmState wait_until_following() {
    for (int i = 0; i < 5000; ++i) {
      const ArmState state = arm->receive();
      if (state.status == ArmStatus::kFollowing) return state;
    }
    ADD_FAILURE() << "never follows";
    return {};
  }
  /// Is stationary for some cycles, then moves by `amplitude` (1 - cos(speed t)), for `seconds`. Returns the last
  /// state.
  ArmState swing(double amplitude, double speed, double seconds) {
    ArmState state = wait_until_following();
    const JointVector q0 = state.joints.q;
    const Time begin = state.joints.stamp.made, period = from_seconds(1.0 / arm->info().rate_hz);
    const auto at = [&](Time now) {
      const double t = to_seconds(now - begin);
      const JointVector ones = JointVector::Ones(6);
      return command(q0 + amplitude * (1.0 - std::cos(speed * t)) * ones,
                     amplitude * speed * std::sin(speed * t) * ones, now);
    };
    while (to_seconds(state.joints.stamp.made - begin) < seconds && state.status == ArmStatus::kFollowing) {
      const double t = to_seconds(state.joints.stamp.made - begin);
      send(at(state.joints.stamp.made), at(state.joints.stamp.made + period));
      state = arm->receive();
      largest_error = std::max(largest_error, (state.joints.q - q0).cwiseAbs().maxCoeff() -
                                                  amplitude * (1.0 - std::cos(std::min(M_PI, speed * t))));
    }
    return state;
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
  std::unique_ptr<Arm> arm;
  Plan plan;
  double largest_error = -1.0;
};

TEST_P(ArmContract, PacesTheLoopAndCountsWhatWasSleptThrough) {
  const double period = 1.0 / arm->info().rate_hz;
  ArmState last = arm->receive();
  for (int i = 0; i < 100; ++i) {
    const int slept = i % 10 == 9 ? 7 : 0;
    clock.advance(slept * period + 0.3 * period);
    const ArmState state = arm->receive();
    const int cycles = std::max(1, slept);  // late: the cycle that has started; in time: the next
    EXPECT_EQ(state.cycle, last.cycle + cycles);
    EXPECT_NEAR(to_seconds(state.joints.stamp.made - last.joints.stamp.made), cycles * period, 1e-9);
    EXPECT_LE(clock.now() - state.joints.stamp.made, from_seconds(period));
    last = state;
  }
}

TEST_P(ArmContract, StandsUntilCommandedAndFollowsAfterItsDelay) {
  const ArmState start = wait_until_following();
  EXPECT_LT((start.joints.q - model.home).norm(), 1e-3);
  const ArmState end = swing(0.2, 2.0, 1.5);
  EXPECT_EQ(end.status, ArmStatus::kFollowing) << end.reason;
  EXPECT_LT(largest_error, 2e-3);  // it lags, and never runs ahead
  const double t = 1.5 - arm->info().delay;
  EXPECT_LT((end.joints.q - start.joints.q - JointVector::Constant(6, 0.2 * (1.0 - std::cos(2.0 * t)))).norm(), 0.02);
}

TEST_P(ArmContract, StopsByItselfWhenNoCommandComes) {
  ArmState state = swing(0.2, 2.0, 0.5);
  for (int i = 0; i < 1000 && state.status == ArmStatus::kFollowing; ++i) state = arm->receive();
  EXPECT_EQ(state.status, ArmStatus::kStopped);
  EXPECT_FALSE(state.reason.empty());
  for (int i = 0; i < 1000; ++i) state = arm->receive();
  EXPECT_LT(state.joints.dq.norm(), 0.05);
  EXPECT_EQ(state.status, ArmStatus::kStopped);
}

/// After missed cycles the arm reports where it has moved by itself. Commands that continue from there are no step. The
/// arm's own motion stays within its limits.
TEST_P(ArmContract, TellsWhereItWentWithoutCommandsAndGoesOnFromThere) {
  const double period = 1.0 / arm->info().rate_hz;
  for (const int lost : {1, 2, 4}) {
    ArmState state = swing(0.2, 4.0, 0.4);  // 0.8 rad/s, and about to change
    ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
    EXPECT_FALSE(state.carried_on);
    const JointCommand before = sample(plan, state.joints.stamp.made - from_seconds(period));
    clock.advance((lost + 0.5) * period);
    state = arm->receive();
    ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
    ASSERT_TRUE(state.carried_on);
    const JointCommand own = *state.carried_on;
    EXPECT_NEAR(to_seconds(state.joints.stamp.made - own.stamp.made), period, 2e-9);
    const double dt = to_seconds(own.stamp.made - before.stamp.made);
    EXPECT_LE((own.dq - before.dq).cwiseAbs().maxCoeff(), 1.001 * dt * 15.0);
    EXPECT_LE((own.q - before.q - 0.5 * dt * (own.dq + before.dq)).cwiseAbs().maxCoeff(), 0.26 * dt * dt * 15.0);
    make_straight_stop(model, own, 0.0, plan);
    arm->follow(plan);
    for (int i = 0; i < 200; ++i) {
      arm->send(sample(plan, state.joints.stamp.made));
      state = arm->receive();
      ASSERT_EQ(state.status, ArmStatus::kFollowing) << state.reason;
      ASSERT_FALSE(state.carried_on);
    }
    arm->restart();
  }
}

/// Each is refused with a stop that only restart() ends; then the arm follows again from its present position.
TEST_P(ArmContract, RefusesWhatIsOutOfItsLimits) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Bad {
    const char* name;
    std::function<void(JointCommand&)> spoil;
  };
  const Bad bad[] = {{"step", [](JointCommand& c) { c.q[2] += 0.02; }},
                     {"small step", [&](JointCommand& c) { c.q[2] += 75.0 / std::pow(arm->info().rate_hz, 2); }},
                     {"not a number", [=](JointCommand& c) { c.q[4] = nan; }},
                     {"infinite speed", [](JointCommand& c) { c.dq[0] = INFINITY; }},
                     {"wrong size", [](JointCommand& c) { c.q = JointVector::Zero(5); }},
                     {"beyond the limits", [this](JointCommand& c) { c.q = model.position_max.array() + 0.01; }},
                     {"back in time", [](JointCommand& c) { c.stamp.made -= std::chrono::milliseconds(20); }}};
  for (const Bad& each : bad) {
    ArmState state = swing(0.05, 1.0, 0.2);
    ASSERT_EQ(state.status, ArmStatus::kFollowing) << each.name << ": " << state.reason;
    JointCommand command{{state.joints.stamp.made, state.joints.stamp.made},
                         state.joints.q + arm->info().delay * state.joints.dq,
                         state.joints.dq,
                         JointVector::Zero(6)};
    each.spoil(command);
    arm->send(command);
    state = arm->receive();
    EXPECT_EQ(state.status, ArmStatus::kStopped) << each.name;
    EXPECT_FALSE(state.reason.empty());
    const JointVector before = state.joints.q;
    for (int i = 0; i < 200; ++i) state = arm->receive();
    EXPECT_EQ(state.status, ArmStatus::kStopped) << each.name;
    EXPECT_LT((state.joints.q - before).norm(), 0.1) << each.name;
    arm->restart();
  }
}

TEST_P(ArmContract, RefusesSpeedAndAccelerationBeyondTheModels) {
  EXPECT_EQ(swing(0.5, 2.5, 2.0).status, ArmStatus::kFollowing);  // up to 1.25 rad/s, 3.1 rad/s^2
  arm->restart();
  EXPECT_EQ(swing(0.9, 4.2, 2.0).status, ArmStatus::kStopped);  // 3.8 rad/s
  arm->restart();
  EXPECT_EQ(swing(0.01, 50.0, 2.0).status, ArmStatus::kStopped);  // 25 rad/s^2
}

TEST_P(ArmContract, ItSaysWhetherItIsHardware) {
  const std::string name = GetParam().name;
  EXPECT_EQ(arm->info().hardware, name.starts_with("ur") || name.starts_with("ros2")) << name;
}

INSTANTIATE_TEST_SUITE_P(, ArmContract, testing::ValuesIn(makers()),
                         [](const auto& param) { return param.param.name; });

}  // namespace
}  // namespace steadyhand

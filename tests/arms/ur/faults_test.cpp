// Faults of a UR arm in motion; docs/reference/ur.md has a row for each test.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "geometry/robot/random_arm.hpp"
#include "steadyhand/arms/ur/ur_dashboard.hpp"
#include "support/manual_clock.hpp"
#include "support/swing.hpp"
#include "support/ur/lockstep.hpp"

namespace steadyhand {
namespace {

constexpr double kGentle = 1.3 * 15.0 + 0.5;  ///< rad/s^2: on the way back to the set-points, as plans may and a bit

class UrFaults : public testing::Test {
 protected:
  UrFaults() : random(3), model(random_arm(6, random, false)) {
    model.home = random_joints(6, 1.0, random);
    swinging = Swing(model.home);
    arm = std::make_unique<UrLockstep>(model, FakeUrController::Settings{}, clock);
  }

  /// Continues the swing for `seconds`, up to 1.8 rad/s, as long as the arm follows. Returns its last state.
  ArmState run(double seconds) {
    const Time end = clock.now() + from_seconds(seconds);
    while (clock.now() < end) {
      state = arm->receive();
      if (state.status != ArmStatus::kFollowing) {
        swinging.forget();
        continue;
      }
      arm->send(swinging.next(state.joints, arm->info().delay));
    }
    return state;
  }
  /// Moves fast when the fault comes.
  void swing() {
    ASSERT_EQ(run(0.9).status, ArmStatus::kFollowing) << state.reason;
    ASSERT_GT(std::abs(state.joints.dq.mean()), 0.9);
  }
  void expect_rest() {
    EXPECT_LT(arm->controller.arm().dq().norm(), 0.02);
    EXPECT_LT((arm->controller.target() - arm->controller.arm().q()).norm(), 0.01);
    EXPECT_FALSE(arm->controller.program_running());
  }
  /// Runs the controller alone for `cycles`. Returns the largest change of its set-point.
  double wander(int cycles) {
    const JointVector before = arm->controller.target();
    double furthest = 0.0;
    for (int i = 0; i < cycles; ++i) {
      arm->controller.step();
      furthest = std::max(furthest, (arm->controller.target() - before).cwiseAbs().maxCoeff());
    }
    return furthest;
  }
  void expect_reason(const char* words) {
    EXPECT_EQ(state.status, ArmStatus::kStopped) << words;
    EXPECT_NE(state.reason.find(words), std::string_view::npos) << state.reason;
  }
  void expect_recovery() {
    arm->restart();
    EXPECT_EQ(run(1.0).status, ArmStatus::kFollowing) << state.reason;
    EXPECT_LE(arm->controller.largest_acceleration(), kGentle);
  }

  std::mt19937 random;
  RobotModel model;
  ManualClock clock;
  std::unique_ptr<UrLockstep> arm;
  ArmState state;
  Swing swinging{JointVector::Zero(6)};
};

TEST_F(UrFaults, FiveMillisecondsWithoutCableAreBridged) {
  swing();
  for (int i = 0; i < 20; ++i) {
    arm->controller.unplug(3);
    ASSERT_EQ(run(0.1).status, ArmStatus::kFollowing) << state.reason;
    EXPECT_LT(std::abs(swinging.error()), 0.02);
  }
  EXPECT_LE(arm->controller.largest_acceleration(), kGentle);
}

TEST_F(UrFaults, TwentyMillisecondsSlowTheArmAndItReturns) {
  swing();
  arm->controller.unplug(10);
  EXPECT_EQ(run(1.0).status, ArmStatus::kFollowing) << state.reason;
  EXPECT_LT(std::abs(swinging.error()), 0.02);
  EXPECT_LE(arm->controller.largest_acceleration(), kGentle);
}

TEST_F(UrFaults, AHundredMillisecondsStopTheArmUntilRestart) {
  swing();
  arm->controller.unplug(50);
  EXPECT_EQ(run(0.5).status, ArmStatus::kStopped);
  EXPECT_FALSE(state.reason.empty());
  expect_rest();
  expect_recovery();
}

TEST_F(UrFaults, ASecondStopsTheArmUntilRestart) {
  swing();
  arm->controller.unplug(500);
  EXPECT_EQ(run(1.6).status, ArmStatus::kStopped);
  EXPECT_FALSE(state.reason.empty());
  expect_rest();
  expect_recovery();
}

TEST_F(UrFaults, AControllerThatLagsIsFollowedLater) {
  arm->controller.lag(4);
  swing();
  EXPECT_LT(std::abs(swinging.error()), 0.03);
  EXPECT_LE(arm->controller.largest_acceleration(), kGentle);
}

TEST_F(UrFaults, AControllerThatBeginsToLagStopsTheArm) {
  swing();
  arm->controller.lag(40);
  EXPECT_EQ(run(1.0).status, ArmStatus::kStopped);
  expect_rest();
  EXPECT_LE(arm->controller.largest_acceleration(), kGentle);
}

TEST_F(UrFaults, AProtectiveStopIsReportedAndStaysUntilUnlocked) {
  swing();
  arm->controller.protective_stop();
  (void)run(0.5);
  expect_reason("protective stop");
  arm->restart();
  EXPECT_EQ(run(0.2).status, ArmStatus::kStopped);  // still locked
  arm->controller.unlock();
  expect_recovery();
}

/// The controller keeps the paused motion and would continue it.
TEST_F(UrFaults, AProgramThatIsResumedAfterASafetyStopMovesNothing) {
  swing();
  arm->controller.protective_stop();
  (void)run(0.5);
  expect_reason("protective stop");
  EXPECT_FALSE(arm->controller.program_running());  // pressing play cannot resume it
  arm->controller.unlock();
  EXPECT_FALSE(arm->controller.press_play());
  EXPECT_LT(wander(500), 1e-3);
  EXPECT_FALSE(arm->controller.program_running());
  expect_recovery();
}

/// As above, at any speed and moment, and with our process killed meanwhile: only the program itself can notice.
TEST_F(UrFaults, AProgramThatIsResumedAfterOurSideDiedMovesNothing) {
  for (const bool safety : {true, false}) {
    for (const double seconds : {0.2, 0.35, 0.5, 0.7, 0.9, 1.3}) {
      arm = std::make_unique<UrLockstep>(model, FakeUrController::Settings{}, clock);
      swinging.forget();
      ASSERT_EQ(run(seconds).status, ArmStatus::kFollowing) << state.reason;
      FakeUrController& controller = arm->controller;
      controller.unplug(1000000);
      if (safety) {
        controller.set_safety(UrSafety::kSafeguardStop);
      } else {
        controller.press_pause();
      }
      arm->kill_arm();
      (void)wander(500);
      controller.set_safety(UrSafety::kNormal);
      ASSERT_TRUE(controller.press_play());
      EXPECT_LT(wander(500), 2e-3) << safety << " " << seconds;
      expect_rest();
    }
  }
}

TEST_F(UrFaults, APauseAtThePendantIsAFaultAndPlayMovesNothing) {
  swing();
  arm->controller.press_pause();
  (void)run(0.5);
  expect_reason("paused");
  (void)arm->controller.press_play();
  EXPECT_LT(wander(500), 1e-3);
  expect_recovery();
}

TEST_F(UrFaults, AProgramThatIsPausedAtTheStartIsEndedFirst) {
  EXPECT_EQ(arm->controller.runtime(), UrRuntime::kPaused);  // as after switching on
  EXPECT_EQ(run(0.5).status, ArmStatus::kFollowing) << state.reason;
}

/// Until set-points go, what comes is acknowledged late, and a controller may hold the next until then.
TEST_F(UrFaults, SilenceBeforeItFollowsIsWaitedFor) {
  arm->controller.unplug(60);
  EXPECT_EQ(run(0.5).status, ArmStatus::kFollowing) << state.reason;
  arm->begin_process();
  swinging.forget();
  arm->controller.unplug(1000000);
  (void)run(8.0);
  expect_reason("no message");
}

TEST_F(UrFaults, SomebodyElsesProgramIsNotEndedUnasked) {
  arm->controller.play_foreign_program();
  (void)run(0.5);
  expect_reason("another program");
  EXPECT_EQ(arm->controller.program_name(), "palletizing");
  arm->controller.press_stop();
  expect_recovery();
  arm->controller.play_foreign_program();
  (void)run(0.5);
  expect_reason("stopped or replaced");
  UrSettings replaces;
  replaces.replace_program = true;
  arm = std::make_unique<UrLockstep>(model, FakeUrController::Settings{}, clock, replaces);
  arm->controller.play_foreign_program();
  EXPECT_EQ(run(0.5).status, ArmStatus::kFollowing) << state.reason;
}

/// A process that died left a program, paused, and what it read; the next one is not taken for it.
TEST_F(UrFaults, AnotherProcessNeverLeadsAnOldProgram) {
  ASSERT_EQ(run(0.2).status, ArmStatus::kFollowing) << state.reason;
  arm->controller.press_pause();
  arm->kill_arm();
  (void)wander(100);
  arm->controller.set_remote(false);  // the next process cannot end it, either
  arm->begin_process();
  const JointVector before = arm->controller.target();
  for (int i = 0; i < 1500; ++i) {
    if (i == 20) (void)arm->controller.press_play();
    state = arm->receive();
    EXPECT_NE(state.status, ArmStatus::kFollowing) << i;
    arm->send(
        {state.joints.stamp, before + JointVector::Constant(6, 0.004), JointVector::Zero(6), JointVector::Zero(6)});
    ASSERT_LT((arm->controller.target() - before).cwiseAbs().maxCoeff(), 1e-3) << i;
  }
  expect_reason("remote control");
}

/// Its number is another, too, and no number comes again.
TEST_F(UrFaults, EachStartOfEachProcessHasANumberOfItsOwn) {
  std::vector<std::int32_t> numbers;
  for (int process = 0; process < 3; ++process) {
    for (int start = 0; start < 2; ++start) {
      ASSERT_EQ(run(0.3).status, ArmStatus::kFollowing) << state.reason;
      const std::int32_t number = arm->controller.output_integer(UrRegisters::kOwner);
      EXPECT_TRUE(numbers.empty() || number > numbers.back()) << number;
      numbers.push_back(number);
      arm->restart();
      swinging.forget();
    }
    arm->kill_arm();
    (void)wander(100);
    arm->begin_process();
  }
}

TEST_F(UrFaults, TheSpeedSliderMustBeAtItsEnd) {
  arm->controller.set_slider(0.5);
  (void)run(0.5);
  expect_reason("the speed slider is at 50 %");
  arm->controller.set_slider(1.0);
  expect_recovery();
  swing();
  arm->controller.set_slider(0.9);
  (void)run(0.5);
  expect_reason("slows the arm down");
  expect_rest();
  EXPECT_LE(arm->controller.largest_acceleration(), kGentle);
}

TEST_F(UrFaults, ReducedModeIsRefused) {
  arm->controller.set_safety(UrSafety::kReduced);
  (void)run(0.5);
  expect_reason("reduced mode");
  arm->controller.set_safety(UrSafety::kNormal);
  expect_recovery();
  swing();
  arm->controller.set_safety(UrSafety::kReduced);
  (void)run(0.5);
  expect_reason("reduced mode");
}

TEST_F(UrFaults, ErrorsOfTheControllerAreTold) {
  UrSettings wrong;
  wrong.program.gain = 5000.0;
  arm = std::make_unique<UrLockstep>(model, FakeUrController::Settings{}, clock, wrong);
  (void)run(0.5);
  expect_reason("gain is 100 to 2000");
}

TEST_F(UrFaults, AnInterpreterThatIsTooSlowIsNamed) {
  FakeUrController::Settings slow;
  slow.budget = 60;
  arm = std::make_unique<UrLockstep>(model, slow, clock);
  (void)run(1.0);
  expect_reason("cycles");
  EXPECT_GT(arm->controller.overruns(), 0u);
}

TEST_F(UrFaults, AnEmergencyStopAndPowerOffAreNamed) {
  swing();
  arm->controller.set_safety(UrSafety::kRobotEmergencyStop);
  (void)run(0.5);
  expect_reason("emergency stop");
  arm->controller.set_safety(UrSafety::kNormal);
  arm->controller.set_mode(UrRobotMode::kPowerOff);
  arm->restart();
  (void)run(0.2);
  expect_reason("power is off");
  arm->controller.set_mode(UrRobotMode::kRunning);
  arm->restart();
  EXPECT_EQ(run(1.0).status, ArmStatus::kFollowing) << state.reason;
}

TEST_F(UrFaults, AProgramStoppedAtThePendantIsAFault) {
  swing();
  arm->controller.press_stop();
  (void)run(0.5);
  expect_reason("stopped or replaced");
  expect_rest();
}

TEST_F(UrFaults, AKilledProgramLeavesTheArmAtRest) {
  swing();
  arm->controller.unplug(1000000);  // not even a farewell arrives
  arm->kill_arm();
  for (int i = 0; i < 300; ++i) arm->controller.step();
  expect_rest();
  EXPECT_LE(arm->controller.largest_acceleration(), kGentle);
}

/// Whether a connection takes programs is settled when it is opened.
TEST_F(UrFaults, RemoteControlMayBeSwitchedOnLater) {
  FakeUrController::Settings settings;
  settings.remote_control = false;
  arm = std::make_unique<UrLockstep>(model, settings, clock);
  (void)run(1.0);
  expect_reason("remote control");
  arm->restart();
  (void)run(1.0);
  expect_reason("remote control");
  arm->controller.set_remote(true);
  expect_recovery();
}

TEST_F(UrFaults, RemoteControlMayBeSwitchedOffMeanwhile) {
  swing();
  arm->controller.set_remote(false);
  EXPECT_EQ(run(0.5).status, ArmStatus::kFollowing) << state.reason;
  arm->controller.press_stop();
  (void)run(0.1);
  arm->restart();
  (void)run(1.0);
  expect_reason("remote control");
}

/// Over real sockets, with threads: the controller goes and comes back.
TEST(UrOverTcp, AControllerThatRestartsIsFoundAgain) {
  std::mt19937 random(3);
  RobotModel model = random_arm(6, random, false);
  model.home = random_joints(6, 1.0, random);
  FakeUrController::Settings settings;
  auto controller = std::make_unique<FakeUrController>(model, settings);
  ASSERT_TRUE(controller->listen());
  settings.rtde_port = controller->rtde_port();
  settings.script_port = controller->script_port();
  settings.dashboard_port = controller->dashboard_port();
  controller->run();
  MonotonicClock clock;
  UrSettings ur;
  ur.host = settings.address;
  ur.rtde_port = settings.rtde_port;
  ur.script_port = settings.script_port;
  ur.state_timeout = 5.0;  // for a machine under load
  ur.connect_timeout = 20.0;
  ur.start_within = 20.0;
  auto arm = UniversalRobotsArm::connect(model, ur, clock);
  ASSERT_TRUE(arm) << arm.error().message;
  const auto wait_for = [&](ArmStatus status) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    ArmState state = (*arm)->receive();
    std::uint64_t last = 0;
    while (state.status != status && std::chrono::steady_clock::now() < until) {
      state = (*arm)->receive();
      EXPECT_GT(state.cycle, last);
      last = state.cycle;
    }
    EXPECT_EQ(state.status, status) << state.reason;
    return state;
  };
  (void)wait_for(ArmStatus::kFollowing);
  auto dashboard = UrDashboard::connect(ur.host, settings.dashboard_port, std::chrono::seconds(20));
  ASSERT_TRUE(dashboard) << dashboard.error().message;
  EXPECT_EQ(*dashboard->ask("robotmode"), "Robotmode: RUNNING");
  EXPECT_EQ(*dashboard->ask("safetystatus"), "Safetystatus: NORMAL");

  controller.reset();
  const ArmState lost = wait_for(ArmStatus::kStopped);
  EXPECT_NE(lost.reason.find("lost"), std::string_view::npos) << lost.reason;
  controller = std::make_unique<FakeUrController>(model, settings);
  ASSERT_TRUE(controller->listen());
  controller->run();
  (*arm)->restart();
  (void)wait_for(ArmStatus::kFollowing);
  arm->reset();
  controller.reset();
}

TEST(UrOverTcp, NobodyThereIsAnErrorThatNamesTheAddress) {
  MonotonicClock clock;
  std::mt19937 random(3);
  const RobotModel model = random_arm(6, random, false), seven = random_arm(7, random, false);
  UrSettings ur;
  ur.host = "127.0.0.1";
  ur.rtde_port = 1;
  ur.connect_timeout = 1.0;
  const auto arm = UniversalRobotsArm::connect(model, ur, clock);
  ASSERT_FALSE(arm);
  EXPECT_NE(arm.error().message.find("127.0.0.1:1"), std::string::npos) << arm.error().message;
  ur.host = "no.such.host.invalid";
  const auto nowhere = UniversalRobotsArm::connect(model, ur, clock);
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().message.find("no.such.host.invalid"), std::string::npos) << nowhere.error().message;
  const auto wrong = UniversalRobotsArm::connect(seven, ur, clock);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("7 joints"), std::string::npos) << wrong.error().message;
}

}  // namespace
}  // namespace steadyhand

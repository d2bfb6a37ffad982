#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <stdexcept>
#include <thread>

#include "steadyhand/arms/ur/ur_arm.hpp"
#include "support/ur/fake_ur_controller.hpp"

namespace steadyhand {

/// A UR arm and its fake controller on one thread and the session's clock: for each cycle that passes on the clock the
/// controller runs one, and messages arrive at once. This makes contracts testable to the nanosecond.
class UrLockstep final : public Arm {
 public:
  UrLockstep(const RobotModel& model, const FakeUrController::Settings& settings, Clock& clock, UrSettings ur = {})
      : clock_(&clock), controller(model, settings), now_(clock.now()), model_(&model), ur_(ur) {
    ur_.state_timeout = 0.001;   // real time: what is to come is there
    ur_.connect_timeout = 60.0;  // on a machine that has other things to do
    begin_process();
  }
  ~UrLockstep() override { arm_.reset(); }

  const ArmInfo& info() const override { return arm_->info(); }
  ArmState receive() override {
    const Time period = from_seconds(controller.period());
    const Time target = now_ + period;
    const auto late = std::max(Time(0), clock_->now() - target) / period;
    clock_->sleep_until(target + late * period);
    for (int i = 0; i <= late; ++i) step();
    // The arm waits for a word from the controller, though not for ever.
    for (int i = 0; !controller.spoke() && i < kSilence; ++i) {
      step();
      clock_->sleep_until(now_);
    }
    if (!keeper_sleeps) arm_->keep();
    around_arm(true);
    const ArmState state = arm_->receive();
    around_arm(false);
    return state;
  }
  void send(const JointCommand& command) override {
    around_arm(true);
    arm_->send(command);
    around_arm(false);
  }
  void restart() override { arm_->restart(); }
  void take_gripper(std::unique_ptr<RobotiqGripper> gripper) { arm_->take_gripper(std::move(gripper)); }
  /// As if the program had been killed.
  void kill_arm() { arm_.reset(); }
  /// As another process of this program, on the same controller.
  void begin_process() {
    arm_.reset();
    controller.serve();
    auto ends = Socket::pair();
    EXPECT_TRUE(ends);
    controller.accept_rtde(std::move(ends->second));
    auto first = std::make_shared<Socket>(std::move(ends->first));
    const auto rtde = [first]() -> Result<Socket> {
      if (!*first) return Error{"a second time is not for tests"};
      return std::move(*first);
    };
    const auto script = [this]() -> Result<Socket> {
      if (before_dialling) before_dialling();
      auto both = Socket::pair();
      if (!both) return both.error();
      controller.accept_script(std::move(both->second));
      return std::move(both->first);
    };
    std::atomic<bool> connecting{true};
    std::thread pump([&] {
      while (connecting) {
        controller.serve();
        std::this_thread::yield();
      }
    });
    auto made = UniversalRobotsArm::over(rtde, script, *model_, ur_, *clock_);
    connecting = false;
    pump.join();
    if (!made) throw std::runtime_error(made.error().message);  // ends the test
    arm_ = *std::move(made);
  }

 private:
  void step() {
    now_ += from_seconds(controller.period());
    controller.step();
    if (each_cycle) each_cycle();
  }
  static constexpr int kSilence = 20;  ///< cycles
  Clock* clock_;

 public:
  FakeUrController controller;
  std::function<void()> each_cycle;  ///< called after each cycle of the controller
  /// Called before (true) and after (false) the arm does something, without the controller.
  std::function<void(bool begins)> around_arm = [](bool) {};
  std::function<void()> before_dialling;  ///< called before a connection for programs is made
  bool keeper_sleeps = false;             ///< the arm's second thread gets no turn

 private:
  Time now_;
  const RobotModel* model_;
  UrSettings ur_;
  std::unique_ptr<UniversalRobotsArm> arm_;
};

}  // namespace steadyhand

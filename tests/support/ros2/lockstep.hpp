#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <stdexcept>

#include "steadyhand/arms/ros2/ros2_arm.hpp"
#include "support/ros2/reference_controller.hpp"

namespace steadyhand {

/// DDS stays on this computer and needs no multicast, which containers seldom have. @return a domain for this process;
/// it may have a namesake, so that topics should be named after the process, too
inline int isolated_ros2_domain() {
  setenv("CYCLONEDDS_URI",
         "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
         "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
         "<MaxAutoParticipantIndex>50</MaxAutoParticipantIndex><Peers><Peer address='127.0.0.1'/></Peers></Discovery>"
         "</Domain></CycloneDDS>",
         1);
  return 1 + static_cast<int>(getpid() % 100);
}

/// An arm behind the reference controller, over DDS, on one thread and the session's clock: within a process DDS
/// delivers before it returns. For each cycle that passes on the clock the controller runs one, which makes contracts
/// testable to the nanosecond.
class Ros2Lockstep final : public Arm {
 public:
  Ros2Lockstep(const RobotModel& model, ReferenceController::Settings settings, Clock& clock, Ros2Settings ros2 = {})
      : clock_(&clock), now_(clock.now()) {
    static int made = 0;
    ros2.domain = settings.domain = isolated_ros2_domain();
    const std::string mine = "/test" + std::to_string(getpid()) + "_" + std::to_string(made++);
    ros2.controller = settings.controller = mine;
    ros2.joint_states = settings.joint_states = mine + "/joint_states";
    if (settings.prefix.empty()) settings.prefix = ros2.prefix;
    settings_ = settings;
    ros2_ = ros2;
    start_controller(model, model.home);
    start_arm(model);
  }

  const ArmInfo& info() const override { return arm_->info(); }
  ArmState receive() override {
    const Time period = from_seconds(1.0 / arm_->info().rate_hz);
    const Time target = now_ + period;
    const auto late = std::max(Time(0), clock_->now() - target) / period;
    clock_->sleep_until(target + late * period);
    for (int i = 0; i <= late; ++i) step(period);
    return arm_->receive();
  }
  void follow(const Plan& plan) override { arm_->follow(plan); }
  void send(const JointCommand& command) override {
    arm_->send(command);
    arm_->talk();
  }
  void restart() override { arm_->restart(); }

  void start_controller(const RobotModel& model, const JointVector& q) {
    auto made = ReferenceController::make(model, q, settings_);
    if (!made) throw std::runtime_error(made.error().message);  // ends the test
    controller = *std::move(made);
  }
  void start_arm(const RobotModel& model) {
    auto made = Ros2Arm::without_thread(model, ros2_, *clock_);
    if (!made) throw std::runtime_error(made.error().message);
    arm_ = *std::move(made);
  }
  const Ros2Settings& ros2() const { return ros2_; }
  /// As if the program, or the ROS machine, had been killed.
  void kill_arm() { arm_.reset(); }
  void kill_controller() { controller.reset(); }

  std::unique_ptr<ReferenceController> controller;
  std::function<void()> each_cycle;  ///< called after each cycle of the controller

 private:
  void step(Time period) {
    now_ += period;
    if (arm_) arm_->talk();
    if (controller) controller->step();
    if (each_cycle) each_cycle();
  }
  Clock* clock_;
  ReferenceController::Settings settings_;
  Ros2Settings ros2_;
  Time now_;
  std::unique_ptr<Ros2Arm> arm_;
};

}  // namespace steadyhand

#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "steadyhand/arms/driver/simulated_arm.hpp"
#include "steadyhand/arms/ros2/node.hpp"
#include "support/manual_clock.hpp"
#include "support/ros2/joint_trajectory_controller.hpp"

namespace steadyhand {

/// A ROS 2 machine with a joint trajectory controller and a joint state broadcaster, over DDS, and the simulated arm
/// behind them. It has its own clock, like another computer. One thread calls everything that has no other note.
class ReferenceController {
 public:
  struct Settings {
    int domain = 0;
    std::string controller = "/joint_trajectory_controller", joint_states = "/joint_states";
    std::string speed_scaling;  ///< topic that tells of it, in %; empty: none does
    std::string prefix;
    bool permuted = true;         ///< joint states name the joints in another order than the arm's, as those of a UR do
    double told_speeds = 1.0;     ///< by which speeds of joint states are multiplied; NaN: positions only
    double told_positions = 1.0;  ///< the same
    int states_every = 1;         ///< cycles
    double pace = 1.0;            ///< s of stamps for each s
    std::optional<Time> stamp;    ///< for every joint state
    double rate_hz = 500.0;
    double servo_lag = 0.03;  ///< s, of the arm
    /// Shares of the model's limits at which the arm stops by itself; mock hardware of ros2_control never does.
    double hardware_speed = 1.2, hardware_acceleration = 1.5;
    /// s from one trajectory to the next, by which lost() counts.
    double expected_every = 0.01;
    Time epoch = std::chrono::hours(24 * 20000);  ///< its clock's time in the first cycle
    /// While the arm is stopped the controller is inactive, as the driver's controller stopper has it.
    bool stopper = true;
    bool active = true;                              ///< the controller is; else it is only loaded
    JointTrajectoryController::Settings parameters;  ///< joints: set by the model
  };

  /// The model must outlive it. The arm starts at `q`, stationary. Fails with DDS's message.
  static Result<std::unique_ptr<ReferenceController>> make(const RobotModel& model, const JointVector& q,
                                                           const Settings& settings);
  ~ReferenceController();

  /// One control cycle.
  void step();
  double period() const { return 1.0 / settings_.rate_hz; }
  /// Cycles in real time, on a separate thread, until stop().
  void run();
  void stop();

  // ---- faults; any thread
  /// Messages in both directions are lost in the next cycles.
  void unplug(int cycles) { unplugged_ = cycles; }
  /// The same for what comes only.
  void deafen(int cycles) { deaf_ = cycles; }
  /// Everything that goes out or comes in does so that many cycles later.
  void lag(int cycles) { lag_ = cycles; }
  /// The controller manager misses so many cycles; the arm stays at its last commanded position.
  void freeze(int cycles) { frozen_ = cycles; }
  /// The controller executes trajectories at that share of their speed.
  void scale(double speed) { scaling_ = speed; }
  /// The controller is activated, or deactivated.
  void activate(bool active) { activity_asked_ = active ? 1 : -1; }
  /// Joint states lack one joint.
  void hide_joint(bool hidden) { hidden_ = hidden; }
  /// The arm brakes and ignores commands until it is unlocked; joint states continue.
  void protective_stop() { protective_asked_ = true; }
  void unlock() { unlock_asked_ = true; }
  /// Its clock is set. Not while run() does.
  void set_clock(Time change) { now_ += change; }

  SimulatedArm& arm() { return *arm_; }
  const JointTrajectoryController::State& desired() const { return desired_; }
  /// Largest changes of what the joints are to do, from cycle to cycle: rad, rad/s; and rad/s^2, by differences.
  struct Largest {
    double q = 0.0, dq = 0.0, ddq = 0.0;
    /// Steps by the controller's own speeds: of the position, beyond what the mean of both cycles' speeds explains; of
    /// the speed, all of it.
    double position_step = 0.0, speed_step = 0.0;
  };
  const Largest& largest() const { return largest_; }
  void forget_largest() { largest_ = {}; }
  std::uint64_t accepted() const { return accepted_; }
  /// Trajectories that had not come when they were due, late or lost.
  std::uint64_t lost() const { return lost_; }
  std::uint64_t refused() const { return refused_; }
  const std::string& last_refusal() const { return last_refusal_; }
  /// Why the arm or the controller stopped last; empty: they did not.
  const std::string& last_stop() const { return last_stop_; }
  /// The last trajectory that came.
  JointTrajectory last_trajectory() const;
  Ros2Node& node() { return *node_; }

 private:
  ReferenceController(const RobotModel& model, const JointVector& q, const Settings& settings);
  Status join();
  void hear(const JointTrajectoryMessage& message);
  void take_in();
  void stop_or_unlock();
  void send_states();
  void tell();
  void thaw();
  void measure(const JointTrajectoryController::State& desired);

  Settings settings_;
  RobotModel model_;  ///< with limits at which hardware stops: far beyond those that plans keep
  ManualClock arm_clock_;
  std::unique_ptr<SimulatedArm> arm_;
  JointTrajectoryController controller_;
  JointTrajectoryController::State desired_;
  Time now_;
  std::uint64_t cycle_ = 0;
  bool locked_ = false;
  std::vector<JointTrajectoryController::State> past_;  ///< two set-points before this one
  Largest largest_;
  std::uint64_t accepted_ = 0, refused_ = 0;
  std::string last_refusal_, last_stop_;

  mutable std::mutex mutex_;                                        ///< guards received data
  std::deque<std::pair<std::uint64_t, JointTrajectory>> incoming_;  ///< cycle in which it counts
  std::uint64_t last_came_ = 0;                                     ///< cycle
  JointTrajectory last_trajectory_;
  std::deque<std::pair<std::uint64_t, std::pair<Time, JointState>>> outgoing_;

  std::atomic<int> unplugged_{0}, deaf_{0}, lag_{0}, frozen_{0}, activity_asked_{0};
  std::atomic<double> scaling_{1.0};
  int slept_ = 0;  ///< cycles in which it was frozen, before this one
  std::atomic<bool> hidden_{false}, running_{false}, protective_asked_{false}, unlock_asked_{false};
  std::atomic<std::uint64_t> cycle_now_{0}, lost_{0};
  Ros2Publisher<JointStateMessage> states_;
  Ros2Publisher<ControllerStateMessage> controller_states_;
  Ros2Publisher<Float64Message> speed_scaling_;
  std::thread thread_;
  std::unique_ptr<Ros2Node> node_;  ///< last: goes first
};

}  // namespace steadyhand

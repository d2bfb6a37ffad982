#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "steadyhand/arms/driver/command_check.hpp"
#include "steadyhand/arms/ros2/ros2_feedback.hpp"
#include "steadyhand/arms/ros2/ros2_gripper.hpp"
#include "steadyhand/arms/ros2/trajectory.hpp"
#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// An arm behind a joint trajectory controller of ROS 2. The controller takes motions, not set-points. Each trajectory
/// begins with the commands of the last `look_ahead` seconds, which the controller is executing at that time. It
/// continues along the plan of which the newest command is a sample, and ends at rest. The controller can thus
/// replace one trajectory by the next at any point, and if a connection is lost, the arm stops along checked motion. A
/// thread of the arm sends over DDS; a thread of DDS listens. See docs/how-to/ros2.md.
class Ros2Arm final : public Arm {
 public:
  /// Joins the domain; does not wait for other nodes. Fails with what to do. Model and clock must outlive it.
  static Result<std::unique_ptr<Ros2Arm>> connect(const RobotModel& model, const Ros2Settings& settings, Clock& clock);
  /// Without the thread that sends: talk() does it. For tests on one thread.
  static Result<std::unique_ptr<Ros2Arm>> without_thread(const RobotModel& model, const Ros2Settings& settings,
                                                         Clock& clock);
  ~Ros2Arm() override;

  const ArmInfo& info() const override { return info_; }
  ArmState receive() override;
  void follow(const Plan& plan) override { plan_ = plan; }
  /// @pre a plan was given, and the command lies on it: anything else is refused with a stop
  void send(const JointCommand& command) override;
  void restart() override;

  /// Sends what is due. Only without a thread.
  void talk();
  /// Waits for the first joint states, and for the gripper's action server where the robot has a gripper; where the
  /// joints are then. Fails if they did not come in time, with what to do. Before the first receive().
  Result<JointVector> wait_for_states();

 private:
  enum class Phase { kWaiting, kSettling, kFollowing, kStopped };
  Ros2Arm(const RobotModel& model, const Ros2Settings& settings, Clock& clock, const std::vector<std::string>& names);
  static Result<std::unique_ptr<Ros2Arm>> make(const RobotModel& model, const Ros2Settings& settings, Clock& clock);
  Status join(int domain);
  void hear_gripper(const JointStateMessage& message);
  void speak();
  void keep_gripper();
  void keep_time();
  void proceed();
  void begin_settling();
  void hold_here();
  void carry_on();
  void order(const JointCommand& command, Time now);
  bool off_path() const;
  bool misled() const;
  bool stepped() const;
  JointCommand commanded(Time then) const;
  bool standing() const;
  bool long_ago(double seconds) const;
  void post(Time begin);
  void stop(std::string_view reason);

  const RobotModel* model_;
  Ros2Settings settings_;
  Clock* clock_;
  ArmInfo info_;
  std::vector<std::string> beyond_limits_;  ///< a reason for each joint
  Time period_, look_ahead_;
  int cycles_per_order_ = 1;
  Ros2Feedback feedback_;
  TrajectorySender sender_;

  // ---- of the control thread
  ArmState state_;
  Phase phase_ = Phase::kWaiting;
  Time phase_since_{0}, last_command_{0};
  CommandCheck check_;
  Plan plan_;
  JointVector settled_at_;
  TrajectoryOrder order_;
  int cycles_since_order_ = 0;
  bool lets_go_ = false;  ///< stopped: the controller must still be commanded to hold the position where the arm stops
  Time moved_{0};         ///< when the arm was last seen to move
  SentCommands sent_;     ///< while following

  std::atomic<bool> running_{false};
  std::thread speaker_, gripper_keeper_;
  std::unique_ptr<Ros2Gripper> gripper_;  ///< null: none
  int gripper_tool_ = 0;                  ///< the tool that it is
  std::unique_ptr<Ros2Node> node_;        ///< last: goes first, and with it all callbacks
};

}  // namespace steadyhand

#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "steadyhand/arms/driver/command_check.hpp"
#include "steadyhand/arms/driver/offset_filter.hpp"
#include "steadyhand/arms/driver/ros2_settings.hpp"
#include "steadyhand/arms/ros2/joint_states.hpp"
#include "steadyhand/arms/ros2/node.hpp"
#include "steadyhand/arms/ros2/ros2_gripper.hpp"
#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/latest_value.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// An arm behind a joint trajectory controller of ROS 2. The controller takes motions, not set-points: each trajectory
/// that is sent begins with the commands of the last `lead` seconds, which the controller is executing just then, goes
/// on along the plan that the newest command is a sample of, and ends at rest. So the controller may replace one by the
/// next wherever it stands, and whatever is cut, the arm comes to rest as checked. A thread of the arm's talks DDS;
/// another, of DDS, listens. docs/how-to/ros2.md has the whole story.
class Ros2Arm final : public Arm {
 public:
  /// Joins the domain; does not wait for anybody. Fails with what to do. Model and clock must outlive it.
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
  /// What the threads that listen and speak noticed.
  enum class Trouble : int { kNone, kTwoStatePublishers, kTwoCommanders, kClockJumped, kThrew };
  /// The newest joint states.
  struct Received {
    JointVector q, dq;
    Time theirs{0}, arrival{0};  ///< stamp on the controller's clock; when it came, on ours
    Time offset{0};              ///< ours less theirs
    Time gap{0};                 ///< since the state before, on our clock
    bool off_pace = false;       ///< their clock is slower or faster than ours
    int controllers = 0;         ///< that listen to our trajectories
  };
  /// The newest that the controller tells of itself, as it does only while it is active.
  struct Told {
    JointVector q;  ///< its set-point; of size 0 where it names other joints
    Time theirs{0}, arrival = -std::chrono::hours(1);
  };
  /// What is to be sent next.
  struct Order {
    static constexpr int kCommands = 128;
    std::array<JointCommand, kCommands> commands;  ///< in order of time
    int count = 0;
    Plan plan;
    Time begin{0};  ///< the trajectory's, on our clock
    Time offset{0};

    Order() = default;
    Order(const Order& other) { *this = other; }
    Order& operator=(const Order& other);  ///< copies the entries in use
  };
  /// A message in the form in which DDS wants it, with the memory behind it.
  struct Letter {
    std::vector<JointCommand> points;
    std::vector<JointTrajectoryPointMessage> messages;
    std::vector<char*> names;
    std::string frame;
  };

  Ros2Arm(const RobotModel& model, const Ros2Settings& settings, Clock& clock, std::vector<std::string> names);
  static Result<std::unique_ptr<Ros2Arm>> make(const RobotModel& model, const Ros2Settings& settings, Clock& clock);
  Status join(int domain);
  void receive(const JointStateMessage& message, Ros2PublisherId publisher);
  void receive(const ControllerStateMessage& message);
  void clock_jumped(bool follows);
  void take_speeds(const JointVector& sent, bool same_publisher, Received& news) const;
  void hear_gripper(const JointStateMessage& message);
  void speak();
  void keep_gripper();
  void write_letter();
  void keep_time();
  void proceed();
  void begin_settling();
  void hold_here();
  void carry_on();
  void remember(const JointCommand& command);
  void order(const JointCommand& command, Time now);
  bool off_path() const;
  bool misled() const;
  bool stepped() const;
  JointCommand commanded(Time then) const;
  bool states_are_recent() const;
  bool standing() const;
  bool long_ago(double seconds) const;
  void post(Time begin);
  void stop(std::string_view reason);
  std::string_view why_no_states() const;
  std::string_view why_not() const;

  const RobotModel* model_;
  Ros2Settings settings_;
  Clock* clock_;
  ArmInfo info_;
  std::string no_controller_, not_active_, seldom_;          ///< reasons that name a topic
  std::array<std::string, kJointStateFaults> state_faults_;  ///< the same, by JointStateFault
  std::vector<std::string> beyond_limits_;                   ///< a reason for each joint
  Time period_, look_ahead_;
  int cycles_per_order_ = 1;

  // ---- of the control thread
  ArmState state_;
  Phase phase_ = Phase::kWaiting;
  Time phase_since_{0}, last_command_{0};
  Received received_, received_before_;
  Told told_;
  bool known_ = false;
  CommandCheck check_;
  Plan plan_;
  JointVector settled_at_;
  Order order_;
  int cycles_since_order_ = 0;
  bool lets_go_ = false;  ///< stopped: the controller is still to be told to stay where the arm comes to stand
  Time moved_{0};         ///< when the arm was last seen to move
  static constexpr int kSent = 512;
  std::array<JointCommand, kSent> sent_;  ///< ring of commands while following; holds any lead and delay
  int newest_sent_ = 0, sent_count_ = 0;
  LatestValue<Order> orders_;  ///< to the thread that speaks
  std::atomic<int> posted_{0};

  // ---- of the thread that listens
  JointOrder joints_, told_joints_;
  Received newest_;
  Told newest_told_;
  Ros2PublisherId state_publisher_ = 0;
  ClockPace pace_;
  OffsetFilter offset_;
  LatestValue<Received> received_news_;  ///< to the control thread
  LatestValue<Told> told_news_;
  std::atomic<JointStateFault> state_fault_{JointStateFault::kOtherJoints};  ///< of the newest that was not used ...
  std::atomic<Time> state_fault_at_{Time::min()};                            ///< ... and when that came
  std::atomic<bool> slowed_down_{false};                                     ///< the hardware is, by what it tells
  std::atomic<Trouble> trouble_{Trouble::kNone};
  std::atomic<bool> following_{false};

  // ---- of the thread that speaks
  Ros2Publisher<JointTrajectoryMessage> trajectories_;
  Order letter_order_;
  Letter letter_;
  std::atomic<bool> running_{false};
  std::thread speaker_, gripper_keeper_;
  std::unique_ptr<Ros2Gripper> gripper_;  ///< null: none
  std::unique_ptr<Ros2Node> node_;        ///< last: goes first, and with it all callbacks
};

}  // namespace steadyhand

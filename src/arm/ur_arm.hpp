#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "arm/arm.hpp"
#include "arm/carry_on.hpp"
#include "arm/command_check.hpp"
#include "arm/offset_filter.hpp"
#include "arm/rtde_client.hpp"
#include "arm/ur_modes.hpp"
#include "arm/ur_program.hpp"
#include "core/clock.hpp"

namespace steadyhand {

struct UrSettings {
  std::string host;
  std::uint16_t rtde_port = 30004, script_port = 30002;
  UrProgramSettings program;  ///< its session, limits and state_period are set by the arm
  double silence = 0.04;      ///< s without a word from the controller after which the arm counts as stopped
  double start_within = 5.0;  ///< s in which the controller has to start the program
  double start_tolerance =
      0.02;               ///< rad, between where the controller wants the joints and where they are, at the start
  double delay = 0.035;   ///< s, ArmInfo::delay: mostly the lookahead of servoj
  double patience = 2.0;  ///< s, for each step of connecting
};

/// A Universal Robots arm without ROS: state over RTDE, set-points into its registers, and a program of ours on the
/// controller that follows them with servoj and stops by itself when they stop coming (ur_program.hpp). A second thread
/// connects again after a loss; the control thread never waits for it. docs/universal-robots.md has the whole story.
class UniversalRobotsArm final : public Arm {
 public:
  /// Connects and reads the state; sends no program before the first receive(). Fails with what to do. Model and clock
  /// must outlive it. @pre the model has six joints in the controller's order, base to wrist
  static Result<std::unique_ptr<UniversalRobotsArm>> connect(const RobotModel& model, const UrSettings& settings,
                                                             Clock& clock);
  /// Over connections that are there already; a loss is for good then. For tests.
  static Result<std::unique_ptr<UniversalRobotsArm>> over(Socket rtde, Socket script, const RobotModel& model,
                                                          const UrSettings& settings, Clock& clock);
  ~UniversalRobotsArm() override;

  const ArmInfo& info() const override { return info_; }
  ArmState receive() override;
  void send(const JointCommand& command) override;
  void restart() override;

  const ControllerVersion& controller() const { return version_; }
  int protocol() const { return protocol_; }
  /// Where the joints were at the newest word from the controller. Not while another thread is in receive().
  const JointVector& q() const { return state_.joints.q; }

 private:
  /// What goes and comes over one connection's life.
  struct Connection {
    std::unique_ptr<RtdeClient> rtde;
    Socket script;
  };
  /// The output recipe's variables.
  struct Report {
    double timestamp = 0.0;  ///< s, of the controller
    std::array<double, 6> target_q{}, q{}, dq{};
    UrRobotMode mode = UrRobotMode::kNoController;
    UrSafety safety = UrSafety::kUndefined;
    std::uint32_t status_bits = 0;
    UrProgramState program = UrProgramState::kNone;
    std::int32_t cycle = 0, owner = 0;  ///< of our program
  };
  enum class Phase { kWaiting, kUploading, kStarting, kFollowing, kStopped };

  UniversalRobotsArm(const RobotModel& model, const UrSettings& settings, Clock& clock,
                     std::unique_ptr<Connection> first);
  static Result<std::unique_ptr<Connection>> open(Socket rtde, Socket script, double patience);
  static Result<std::unique_ptr<Connection>> open(const UrSettings& settings);
  void take_connection();
  void lose_connection();
  void reconnect();
  bool listen();
  void read(RtdeReader& data);
  void drain_script();
  void keep_time();
  void keep_time_alone();
  void proceed();
  void tell_what_was_carried_on();
  bool long_ago(double seconds) const;
  void begin_program();
  void upload();
  void stop(std::string_view reason);
  void send_input(const JointCommand* command);
  bool ours() const { return report_.owner == program_.session; }

  const RobotModel* model_;
  UrSettings settings_;
  Clock* clock_;
  ArmInfo info_;
  ControllerVersion version_;
  int protocol_ = 2;
  UrProgramSettings program_;
  std::string program_text_;
  std::array<std::size_t, 2> session_at_{};  ///< where the session's number stands in the text
  std::size_t uploaded_ = 0;

  std::unique_ptr<Connection> connection_;  ///< of the control thread; null: lost
  Report report_;
  ArmState state_;
  Phase phase_ = Phase::kWaiting;
  CommandCheck check_;
  CarryOn carry_on_;           ///< of the program
  JointCommand last_command_;  ///< since it follows; without joints: none yet
  bool silent_ = false, known_ = false;
  std::uint64_t phase_since_ = 0;  ///< cycle
  Time period_, last_timestamp_{0};
  OffsetFilter offset_;

  std::atomic<Connection*> incoming_{nullptr}, outgoing_{nullptr};
  std::atomic<int> lost_{0};  ///< connections lost, for the other thread to wait on
  std::atomic<bool> running_{true};
  std::thread keeper_;
};

}  // namespace steadyhand

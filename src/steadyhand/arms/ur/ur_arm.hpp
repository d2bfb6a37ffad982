#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "steadyhand/arms/driver/carry_on.hpp"
#include "steadyhand/arms/driver/command_check.hpp"
#include "steadyhand/arms/driver/offset_filter.hpp"
#include "steadyhand/arms/driver/ur_settings.hpp"
#include "steadyhand/arms/ur/robotiq_gripper.hpp"
#include "steadyhand/arms/ur/ur_connections.hpp"
#include "steadyhand/arms/ur/ur_modes.hpp"
#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// A Universal Robots arm without ROS: state over RTDE, set-points into its registers, and a program of ours on the
/// controller that follows them with servoj and stops by itself when they stop coming (ur_program.hpp). A second thread
/// makes connections: one for states after a loss, and a new one for each program, since the controller decides when a
/// connection is opened whether it may send programs. The control thread never waits for it. See docs/reference/ur.md.
class UniversalRobotsArm final : public Arm {
 public:
  using Dial = UrConnections::Dial;

  /// Connects and reads the state; sends no program before the first receive(). Fails with what to do. Model and clock
  /// must outlive it. @pre the model has six joints in the controller's order, base to wrist
  static Result<std::unique_ptr<UniversalRobotsArm>> connect(const RobotModel& model, const UrSettings& settings,
                                                             Clock& clock);
  /// Over given connections, without a second thread: the caller also calls keep(). For tests.
  static Result<std::unique_ptr<UniversalRobotsArm>> over(Dial rtde, Dial script, const RobotModel& model,
                                                          const UrSettings& settings, Clock& clock);
  ~UniversalRobotsArm() override;

  const ArmInfo& info() const override { return info_; }
  ArmState receive() override;
  void send(const JointCommand& command) override;
  void restart() override;

  /// Commands' gripper positions go to this gripper, and the arm stops while it has an error. Before the first
  /// receive().
  void take_gripper(std::unique_ptr<RobotiqGripper> gripper);

  const ControllerVersion& controller() const { return version_; }
  int protocol() const { return protocol_; }
  /// State of the controller's one program, in its newest message; as q().
  UrRuntime runtime() const { return report_.runtime; }
  bool program_is_ours() const;
  /// One pass of the second thread.
  void keep() { connections_.keep(); }
  /// The joints' positions in the controller's newest message. Not while another thread is in receive().
  const JointVector& q() const { return state_.joints.q; }

 private:
  enum class Phase { kWaiting, kDialling, kUploading, kStarting, kFollowing, kStopped };

  UniversalRobotsArm(const RobotModel& model, const UrSettings& settings, Clock& clock, Dial rtde, Dial script,
                     std::unique_ptr<RtdeClient> first);
  void lose_connection();
  bool listen();
  void read(RtdeReader& data);
  void read_script();
  void keep_time();
  void keep_time_alone();
  void proceed();
  void tell_what_was_carried_on();
  void watch_program();
  bool counts_cycles();
  bool long_ago(double seconds) const;
  void begin_program();
  void dial();
  void upload();
  void await_program();
  void stop(std::string_view reason);
  std::span<char> next_words();
  void send_input(const JointCommand* command);
  bool ours() const { return report_.owner == program_.session(); }

  const RobotModel* model_;
  UrSettings settings_;
  Clock* clock_;
  ArmInfo info_;
  ControllerVersion version_;
  int protocol_ = 2;
  UrProgramText program_;
  std::size_t uploaded_ = 0;

  std::unique_ptr<RobotiqGripper> gripper_;  ///< null: none

  UrConnections connections_;
  std::unique_ptr<RtdeClient> rtde_;                ///< used by the control thread; null: lost
  std::unique_ptr<UrConnections::Script> primary_;  ///< the same; null: none since the last program was sent
  UrReport report_;
  ArmState state_;
  Phase phase_ = Phase::kWaiting;
  CommandCheck check_;
  CarryOn carry_on_;           ///< how the program bridges missing set-points
  JointCommand last_command_;  ///< since it follows; without joints: none yet
  bool silent_ = false, known_ = false;
  std::uint64_t phase_since_ = 0;  ///< cycle
  Time period_, last_timestamp_{0};
  OffsetFilter offset_;

  std::uint64_t counted_from_ = 0;  ///< cycle, see counts_cycles()
  int quiet_ = 0;                   ///< states in which the program's cycle did not change
  std::int32_t begun_at_ = 0;       ///< the program's cycle then, or when its first cycle was read
  bool asked_to_stop_ = false;      ///< is the paused program

  /// Why the arm stopped, where that is no static text. Kept for long, since others read it later.
  std::array<std::array<char, 240>, 16> words_{};
  std::size_t next_words_ = 0;
};

}  // namespace steadyhand

#pragma once

#include <vector>

#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/planning/plan/tracker.hpp"
#include "steadyhand/session/live/links.hpp"
#include "steadyhand/session/live/live_settings.hpp"

namespace steadyhand {

/// The control loop's work, once a cycle: take the newest plan if it continues the followed one, supervise, and make
/// the next command. Control thread; never waits, allocates nothing after construction.
class ControlStage {
 public:
  /// Model and links must outlive it.
  ControlStage(const RobotModel& model, const ControlSettings& settings, Links& links);

  struct Output {
    JointCommand command;
    bool restart_arm = false;       ///< call Arm::restart()
    const Plan* follows = nullptr;  ///< the plan that the command samples, if it changed in this cycle
  };
  /// @param state as the arm reports it now; its time is the time of the cycle
  const Output& step(const ArmState& state);

  /// See SessionSnapshot::state.
  SupervisionState state() const { return foremost().state(); }
  bool at_rest() const { return at_rest_; }

 private:
  const Supervisor& foremost() const;
  void supervise(const ArmState& state, std::uint64_t missed);
  void halt(const ArmState& state, SupervisionState after);
  void take_obstacles(Time now);
  void take_plan(Time now);
  void take_gripper(int tool, const JointState& measured);
  void publish(const ArmState& state, std::uint64_t missed);
  bool knows_obstacles(const Plan& plan, Time now);
  void follow(const Plan& plan);
  void remember(const JointCommand& command);
  void resume(const JointCommand& carried_on);
  void anchor(const JointVector& q, Time now);
  void brake();
  void end_giving_way();
  void give_way(const JointState& measured);
  void begin_stop(const Transition& transition, Time now);
  const JointCommand& command_before(int age) const;
  bool off_path(const JointState& measured) const;

  ControlSettings settings_;
  Links* links_;
  Kinematics kinematics_;
  std::vector<Supervisor> supervisors_;  ///< of each tool's hand
  SupervisionInput input_;               ///< of this cycle; `hand` is that of the last tool
  PerTool<const Transition*> taken_{};   ///< in this cycle
  bool stop_asked_ = false;              ///< the same
  Tracker tracker_;
  Plan pending_, candidate_;
  bool has_pending_ = false, at_rest_ = true;
  bool anew_ = true;   ///< the next command that taps see is the first after an anchor
  bool soft_ = false;  ///< stopping by the planner's plans
  Time stop_by_{0};
  bool held_off_ = false;      ///< halted, and the arm was not at its commands
  Time holds_still_since_{0};  ///< since when the commands are stationary while the arm is kept away from them
  std::optional<JointVector> gives_way_to_;  ///< measured position that the commands move to after that
  double gave_way_by_ = 0.0;                 ///< rad (m), largest move of a joint to there; infinite: no move yet
  PerTool<HandReport> hands_;
  Time last_plan_{0}, last_hand_counted_{0};
  std::uint64_t last_cycle_ = 0;
  JointCommand last_;  ///< command of the last cycle
  /// Of a tool.
  struct Gripper {
    std::optional<double> command, last_wish;  ///< commanded position; last request of the operator
    std::optional<double> waiting_wish;        ///< requested, not done yet
  };
  PerTool<Gripper> grippers_;
  Output output_;
  ControlView view_;

  std::vector<JointCommand> history_;  ///< ring of commands since the anchor, covers more than the arm's delay
  int newest_ = 0, stored_ = 0;
};

}  // namespace steadyhand

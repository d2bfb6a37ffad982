#pragma once

#include <array>
#include <functional>
#include <memory>

#include "steadyhand/arms/driver/command_check.hpp"
#include "steadyhand/core/arm.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/core/time.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// One arm of a robot with two tools, for its own driver: the joints that move this tool, with their limits; no bodies.
/// Fails, with the reason, if the robot has one tool, or a joint moves both.
Result<RobotModel> arm_of(const RobotModel& robot, int tool);
/// Index of the first of those joints in the robot; they are contiguous.
int first_joint_of(const RobotModel& robot, int tool);

/// Two arms of one robot, each behind its own driver, as one arm.
///
/// The arm with the larger delay paces the cycle; of equal ones the faster, then the first. The other runs at its own
/// rate, on a thread. It samples the plans at its own cycles, later by a constant: that gives a plan time to arrive
/// before it starts, and lets both arms lag alike, so that they keep the distances that were planned. ArmInfo::delay is
/// the larger delay, and what is measured can be compared with the commands of that time for all joints.
///
/// Each arm is commanded in all of its cycles while it follows: before both follow it is held where it is; where it
/// moved by itself in missed cycles it brakes gently until the control loop continues from there (carried_on). If one
/// stops, the other obeys commands until restart(), which restarts only the stopped one.
class CompositeArm final : public Arm {
 public:
  using Make = std::function<Result<std::unique_ptr<Arm>>(const RobotModel& model, Clock& clock)>;
  /// Where the arm runs that does not pace the cycle.
  enum class Turns {
    kThread,    ///< on its own thread
    kOneThread  ///< in receive(), for each of its cycles that has started: for simulated arms, deterministic
  };

  /// Makes each arm with its model (arm_of) and a clock. Fails as these do. Robot and clock must outlive it.
  /// @param on_thread called first on the thread
  static Result<std::unique_ptr<CompositeArm>> make(const RobotModel& robot, const std::array<Make, kMaxTools>& make,
                                                    Clock& clock, Turns turns = Turns::kThread,
                                                    std::function<void()> on_thread = {});
  ~CompositeArm() override;

  const ArmInfo& info() const override { return info_; }
  ArmState receive() override;
  void follow(const Plan& plan) override;
  /// @pre a plan was given, and the command lies on it: anything else is refused with a stop
  void send(const JointCommand& command) override;
  void restart() override;

 private:
  struct Part;
  CompositeArm(const RobotModel& robot, Clock& clock);
  void pair_up(Turns turns, std::function<void()> on_thread);
  Part& pacing() const { return *parts_[pacing_]; }
  Part& other() const { return *parts_[1 - pacing_]; }
  void await_first_state();
  void join_states(ArmState& state);
  void proceed(ArmState& state);
  void tell_what_was_carried_on(ArmState& state);
  void post(Time from);
  void wish(const PerTool<std::optional<double>>& gripper);
  void halt(std::string_view reason);

  const RobotModel* robot_;
  Clock* clock_;
  ArmInfo info_;
  std::array<std::unique_ptr<Part>, kMaxTools> parts_;
  int pacing_ = 0;
  bool one_thread_ = false;
  Time period_{0}, now_{0};

  CommandCheck check_;
  Plan plan_;  ///< of the newest command
  ArmStatus status_ = ArmStatus::kStarting;
  std::string_view reason_;
  bool passes_ = false;    ///< commands, to the arms that follow
  bool unposted_ = false;  ///< the plan is not yet known to an arm that moved by itself
  JointVector q_;          ///< of the last state
  std::uint64_t restarts_ = 0, halts_ = 0;
  PerTool<std::uint64_t> answered_{};  ///< departure of each arm from its plans that these continue from

  /// Why it stopped, with the name of the arm. Kept for long, since others read it later.
  std::array<std::array<char, 280>, 16> words_{};
  std::size_t next_words_ = 0;
};

}  // namespace steadyhand

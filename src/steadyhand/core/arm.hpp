#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// Whether an arm follows commands.
enum class ArmStatus {
  kStarting,   ///< not yet: it is being switched on, or recovers from a stop
  kFollowing,  ///< the arm goes from kStarting to this by itself, also when a session begins, without restart()
  kStopped,    ///< it stopped by itself (protective stop, connection lost); only restart() brings it back
};

/// What an arm reports once a cycle.
struct ArmState {
  JointState joints;                        ///< measured at `joints.stamp.made`, the session's clock
  std::uint64_t cycle = 0;                  ///< counts control cycles of the arm, also those that the program missed
  ArmStatus status = ArmStatus::kStarting;  ///< whether it follows commands
  std::string_view reason;                  ///< why it stopped; static text
  /// It stopped, but a part of it, one arm of two, still follows commands: they brake it.
  bool part_follows = false;
  /// Set while the arm follows if it got no command for the cycle before this one: where its own set-point has gone
  /// meanwhile, in that cycle, within its limits. The next command must continue from there.
  std::optional<JointCommand> carried_on;
};

/// Properties of an arm, and whether it is dangerous.
struct ArmInfo {
  std::string name;         ///< for people
  int joints = 0;           ///< n
  double rate_hz = 500.0;   ///< of control cycles
  double delay = 0.0;       ///< s, between a command and its measured effect, about; of all joints
  bool hardware = true;     ///< can hurt a person: recorded hands need an explicit option, and it starts slowly
  PerTool<bool> gripper{};  ///< takes that of JointCommand::gripper, and reports that of JointState::gripper
};

/// An arm that takes joint positions, real or simulated. It paces the control loop: receive, think, send, once a cycle.
/// receive(), follow() and send() belong to the control thread and allocate nothing.
class Arm {
 public:
  virtual ~Arm() = default;
  virtual const ArmInfo& info() const = 0;  ///< never changes

  /// Waits for the arm's next cycle. A caller that comes late gets the newest state, not those it missed.
  virtual ArmState receive() = 0;
  /// The next commands are samples of this plan, which was checked to its end, where it is at rest. Called before the
  /// first of them, each time the plan changes. For arms that receive whole motions; other arms ignore it.
  virtual void follow(const Plan& plan) { (void)plan; }
  /// The set-point of this cycle. Ignored unless the arm is following. It must continue the earlier ones,
  /// and ArmState::carried_on: an arm may stop by itself at a step, or beyond its limits.
  virtual void send(const JointCommand& command) = 0;
  /// Asks the arm to follow commands again after a stop, from where it is; the first command must be there. A session
  /// calls this after each reset, and not when it begins. Does not wait: the status shows when the arm follows.
  virtual void restart() = 0;

 protected:
  Arm() = default;
};

}  // namespace steadyhand

#pragma once

#include <span>
#include <string_view>

#include "steadyhand/session/supervise/hand_gate.hpp"

namespace steadyhand {

/// What the control loop knows in one cycle.
struct SupervisionInput {
  Time now{0};
  bool arm_follows = false;  ///< the arm takes commands
  bool arm_stopped = false;  ///< the arm stopped by itself
  std::string_view arm_reason;
  std::string_view failure;    ///< of a part of the program; empty: none
  std::uint64_t stops = 0;     ///< how often a stop was asked for, ever
  std::uint64_t reset_of = 0;  ///< Supervisor::halts of when a reset was asked for last
  bool at_rest = false;        ///< commands and arm
  bool off_path = false;       ///< measured too far from what was commanded
  bool stalled = false;        ///< the loop slept through too many cycles
  Time last_plan{0};           ///< when a new plan was taken last
  HandReport hand;
};

/// What may change the state. In one cycle several may be true.
enum class SupervisionEvent {
  kArmStopped,
  kFailed,  ///< a part of the program
  kArmFollows,
  kArmLate,  ///< it has not followed for a while
  kStopAsked,
  kStalled,
  kOffPath,
  kResetAsked,   ///< of what halted the arm last, no stop has come since, and the arm is at rest
  kSilence,      ///< the device says nothing
  kReleased,     ///< clutch open
  kGripped,      ///< clutch closed anew, the pose can be trusted
  kHandLost,     ///< the pose cannot be trusted
  kHandBack,     ///< it can again, and plans come
  kPlannerLate,  ///< no new plan for a while
};

/// One way from state to state. Of the rows that apply the first in the table is taken.
struct Transition {
  SupervisionState from;
  SupervisionEvent event;
  SupervisionState to;
  std::string_view reason;  ///< for people; empty: the arm's or the hand's own
};

/// All of them.
std::span<const Transition> transitions();

/// The one place that decides what the arm may do. Pure logic, no clock of its own; control thread; allocates nothing.
class Supervisor {
 public:
  explicit Supervisor(const SupervisorSettings& settings = {}) : settings_(settings) {}

  /// Once a cycle. @return the row that was taken, or null if the state stays
  const Transition* update(const SupervisionInput& input);

  SupervisionState state() const { return state_; }
  std::string_view reason() const { return reason_; }  ///< for people
  Cause cause() const { return cause_; }               ///< the same for programs
  /// Counts every time that following begins, also after holding: each starts from where the arm is.
  std::uint64_t engagements() const { return engagements_; }
  /// Counts what halts the arm: every stop that is asked for, in whatever state, and everything else that leads to
  /// stopping or fault. A reset names the one that it undoes, so none undoes what came after it was asked for.
  std::uint64_t halts() const { return halts_; }
  /// SupervisionInput::stops of the last update: these were obeyed.
  std::uint64_t stops() const { return stops_; }
  /// HandReport::grips when the state changed last: while following, the grip that is followed.
  std::uint64_t grip() const { return grips_used_; }

 private:
  const Transition* step(const SupervisionInput& input);
  bool happened(SupervisionEvent event, const SupervisionInput& input) const;

  SupervisorSettings settings_;
  SupervisionState state_ = SupervisionState::kIdle;
  std::string_view reason_ = "starting";
  Cause cause_;
  Time since_{0};
  std::uint64_t engagements_ = 0, grips_used_ = 0, halts_ = 0, stops_ = 0;
};

}  // namespace steadyhand

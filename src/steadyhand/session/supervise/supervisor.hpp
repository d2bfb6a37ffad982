#pragma once

#include <span>
#include <string_view>

#include "steadyhand/session/supervise/hand_gate.hpp"

namespace steadyhand {

/// Input of the supervisor in one cycle.
struct SupervisionInput {
  Time now{0};
  bool arm_follows = false;  ///< the arm takes commands
  bool arm_stopped = false;  ///< the arm stopped by itself
  std::string_view arm_reason;
  std::string_view failure;    ///< failed part of the program; empty: none
  std::uint64_t stops = 0;     ///< number of stops requested so far
  std::uint64_t reset_of = 0;  ///< Supervisor::halts at the last request for a reset
  bool at_rest = false;        ///< commands and arm are stationary
  bool off_path = false;       ///< measured too far from the commanded position
  bool stalled = false;        ///< the loop missed too many cycles
  Time last_plan{0};           ///< when the last new plan was taken
  HandReport hand;
  bool other_lost = false;    ///< so is the hand of another tool that follows, see Supervisor::loses_hand
  bool other_silent = false;  ///< the same of Supervisor::misses_device
};

/// Events that may change the state. Several may be true in one cycle.
enum class SupervisionEvent {
  kArmStopped,
  kFailed,  ///< a part of the program
  kArmFollows,
  kArmLate,  ///< it has not followed commands for a while
  kStopAsked,
  kStalled,
  kOffPath,
  kResetAsked,   ///< for the last halt; no stop since, and the arm is at rest
  kSilence,      ///< the device has stopped sending
  kReleased,     ///< clutch open
  kGripped,      ///< clutch closed again, the pose can be trusted
  kHandLost,     ///< the pose cannot be trusted
  kHandBack,     ///< it can again, and plans come
  kPlannerLate,  ///< no new plan for a while
  kOtherLost,    ///< kHandLost of another tool's hand
  kOtherSilent,  ///< kSilence of another tool's hand
};

/// A transition between states. The first row of the table that applies is taken.
struct Transition {
  SupervisionState from;
  SupervisionEvent event;
  SupervisionState to;
  std::string_view reason;  ///< for people; empty: the arm's or the hand's reason
};

/// All of them.
std::span<const Transition> transitions();

/// Decides what the arm may do; nothing else does. A robot with several tools has one for each; what concerns the arm
/// is the same for all, so that they halt, and are reset, in the same cycle. Pure logic without a clock; control
/// thread; allocates nothing.
class Supervisor {
 public:
  explicit Supervisor(const SupervisorSettings& settings = {}) : settings_(settings) {}

  /// Call it once a cycle. @return the row that was taken, or null if the state stays
  const Transition* update(const SupervisionInput& input);

  /// Before update(): whether the tool follows, or holds for, a hand that cannot be trusted now.
  bool loses_hand(const SupervisionInput& input) const {
    return leads() && happened(SupervisionEvent::kHandLost, input);
  }
  /// The same of a hand whose device has stopped sending.
  bool misses_device(const SupervisionInput& input) const {
    return leads() && happened(SupervisionEvent::kSilence, input);
  }

  SupervisionState state() const { return state_; }
  std::string_view reason() const { return reason_; }  ///< for people
  Cause cause() const { return cause_; }               ///< the same for programs
  /// Counts every start of following, also after holding: each starts from where the arm is.
  std::uint64_t engagements() const { return engagements_; }
  /// Counts everything that halts the arm: each requested stop, in any state, and everything else that causes stopping
  /// or fault. A reset names the halt that it undoes, so it cannot undo a later one.
  std::uint64_t halts() const { return halts_; }
  /// SupervisionInput::stops of the last update: these stops have been executed.
  std::uint64_t stops() const { return stops_; }
  /// HandReport::grips when the state changed last; while following, the grip that is followed.
  std::uint64_t grip() const { return grips_used_; }

 private:
  const Transition* step(const SupervisionInput& input);
  bool happened(SupervisionEvent event, const SupervisionInput& input) const;
  bool leads() const { return state_ == SupervisionState::kEngaged || state_ == SupervisionState::kHolding; }

  SupervisorSettings settings_;
  SupervisionState state_ = SupervisionState::kIdle;
  std::string_view reason_ = "starting";
  Cause cause_;
  Time since_{0};
  std::uint64_t engagements_ = 0, grips_used_ = 0, halts_ = 0, stops_ = 0;
};

}  // namespace steadyhand

#pragma once

#include <cstdint>
#include <string_view>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// State of the supervision, which decides whether the arm moves.
enum class SupervisionState : std::uint8_t {
  kIdle,      ///< the arm does not follow set-points yet
  kReady,     ///< the arm is stationary; closing the clutch engages it
  kEngaged,   ///< the arm follows the hand
  kHolding,   ///< engaged, but the hand cannot be trusted now: the arm rests
  kStopping,  ///< a stop was asked for: the arm stops and then waits for a reset
  kFault,     ///< the arm or a part of the program failed: nothing moves until a reset
};

/// Their names in recordings and the protocol.
constexpr auto names_of(SupervisionState) {
  using enum SupervisionState;
  return named("SessionState", {Name{kIdle, "idle", "the arm does not follow commands yet"},
                                Name{kReady, "ready", "the arm is stationary; closing the clutch engages it"},
                                Name{kEngaged, "engaged", "the arm follows the hand"},
                                Name{kHolding, "holding", "engaged, but the hand cannot be trusted now: the arm rests"},
                                Name{kStopping, "stopping", "the arm stops and waits for a reset"},
                                Name{kFault, "fault", "the arm or the program failed: nothing moves until a reset"}});
}

/// Why the state is what it is, for programs. The text for people may change.
enum class ReasonCode : std::uint8_t {
  kStarting,
  kArmStopped,    ///< the arm stopped by itself
  kFailed,        ///< a part of the program failed
  kReady,         ///< the arm takes commands
  kStopAsked,     ///< a client, or the terminal, asked for a stop
  kStalled,       ///< the control loop missed too many cycles
  kOffPath,       ///< the arm is not at its commanded position
  kReset,         ///< after a stop or a fault
  kSilent,        ///< the device stopped sending
  kReleased,      ///< the clutch is open
  kProfileWaits,  ///< the hand was released for a new profile, which starts after the arm has stopped
  kGripped,       ///< the clutch closed
  kHandLost,      ///< poses of the hand cannot be trusted
  kNoPose,        ///< no pose of the hand was received for a while
  kHandBack,      ///< poses can be trusted again
  kPlannerLate,   ///< no plan was received for a while
  kOtherLost,     ///< poses of the other hand cannot be trusted
  kOtherSilent,   ///< the other hand's device stopped sending
};

/// Likewise.
constexpr auto names_of(ReasonCode) {
  using enum ReasonCode;
  return named(
      "ReasonCode",
      {Name{kStarting, "starting"}, Name{kArmStopped, "arm_stopped", "by itself"},
       Name{kFailed, "failed", "a part of the program"}, Name{kReady, "ready", "the arm takes commands"},
       Name{kStopAsked, "stop_asked"}, Name{kStalled, "stalled", "the control loop missed cycles"},
       Name{kOffPath, "off_path", "the arm is not at its commanded position"}, Name{kReset, "reset"},
       Name{kSilent, "silent", "the device stopped sending"}, Name{kReleased, "released"},
       Name{kProfileWaits, "profile_waits", "released, because a profile starts after the arm has stopped"},
       Name{kGripped, "gripped"}, Name{kHandLost, "hand_lost", "poses cannot be trusted"},
       Name{kNoPose, "no_pose", "no pose was received for a while"}, Name{kHandBack, "hand_back"},
       Name{kPlannerLate, "planner_late"}, Name{kOtherLost, "other_lost", "poses of the other hand cannot be trusted"},
       Name{kOtherSilent, "other_silent", "the other hand's device stopped sending"}});
}

/// A reason, and whose hand was on the clutch then.
struct Cause {
  ReasonCode code = ReasonCode::kStarting;  ///< why
  Leader leader = Leader::kPerson;          ///< whose hand
};

/// The state of supervision changed.
struct SupervisionChange {
  Time at{0};                                       ///< session's clock
  SupervisionState from = SupervisionState::kIdle;  ///< before
  SupervisionState to = SupervisionState::kIdle;    ///< from now on
  std::string_view reason;                          ///< static text
  bool is_failure = false;                          ///< the arm stops without a request
  ReasonCode code = ReasonCode::kStarting;          ///< code of reason
  int tool = 0;                                     ///< of the hand; what concerns the arm comes once for each tool
};

/// Times after which the arm is no longer engaged.
struct SupervisorSettings {
  double hold_after = 0.1;           ///< s without a good pose of the hand: hold
  double disengage_after = 0.25;     ///< s without a message from the device: disengage
  double planner_late_after = 0.25;  ///< s without a new plan while engaged: hold
  double arm_late_after = 10.0;      ///< s in idle: report that the arm does not follow yet, again and again
  bool together = true;              ///< with a hand that is lost or silent, the tool of the other rests too
};

/// s of live sessions, without a sample, after which a closed clutch means nothing.
inline constexpr double kSampleTimeout = 0.25;

/// Which poses of a hand are trusted.
struct HandGateSettings {
  bool accept_emulated = false;  ///< take poses whose position the headset guesses
  /// A hand's speed: reaching and throwing stay below 6 m/s and 25 rad/s at the hand. The allowances
  /// are for noise at high rates.
  double speed_max = 6.0, jump_allowance = 0.02;  ///< m/s, m
  double turn_rate_max = 30.0;                    ///< rad/s
  double turn_allowance = 0.15;                   ///< rad
  /// Limits of a policy, whose targets are smoothed to its pace (PolicyHand): for a tool, not a hand.
  double policy_speed_max = 2.0, policy_jump_allowance = 0.005;  ///< m/s, m
  double policy_turn_rate_max = 6.0;                             ///< rad/s
  double policy_turn_allowance = 0.05;                           ///< rad
  double gap_max = 0.1;                                          ///< s without a good pose: the hand is lost
  double resume_distance = 0.1;  ///< m, from where it was lost, within which it is trusted again
  double resume_angle = 0.5;     ///< rad, likewise
  int resume_samples = 3;        ///< good ones in a row after a loss
  double age_max = 0.2;          ///< s from the hand to here
  double ahead_max = 0.05;       ///< s: no stamp is later than its arrival by more
  double clock_step = 1.0;       ///< s: stamps that go back by more are a clock that was set
};

}  // namespace steadyhand

#pragma once

#include <cstdint>
#include <string_view>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// What the arm is allowed to do now.
enum class SupervisionState : std::uint8_t {
  kIdle,      ///< the arm does not follow set-points yet
  kReady,     ///< the arm stands; an engagement would move it
  kEngaged,   ///< the arm follows the hand
  kHolding,   ///< engaged, but the hand cannot be trusted now: the arm rests where it was led
  kStopping,  ///< a stop was asked for: the arm comes to rest and then waits for a reset
  kFault,     ///< the arm or a part of the program failed: nothing moves until a reset
};

constexpr auto names_of(SupervisionState) {
  using enum SupervisionState;
  return named("SessionState", {Name{kIdle, "idle", "the arm does not follow commands yet"},
                                Name{kReady, "ready", "the arm stands; closing the clutch moves it"},
                                Name{kEngaged, "engaged", "the arm follows the hand"},
                                Name{kHolding, "holding", "engaged, but the hand cannot be trusted now: the arm rests"},
                                Name{kStopping, "stopping", "the arm comes to rest and waits for a reset"},
                                Name{kFault, "fault", "the arm or the program failed: nothing moves until a reset"}});
}

/// Why the state is what it is, for programs. The words for people may change.
enum class ReasonCode : std::uint8_t {
  kStarting,
  kArmStopped,    ///< the arm stopped by itself
  kFailed,        ///< a part of the program failed
  kReady,         ///< the arm takes commands
  kStopAsked,     ///< a client, or the terminal, asked for a stop
  kStalled,       ///< the control loop missed too many cycles
  kOffPath,       ///< the arm is not where its commands lead
  kReset,         ///< after a stop or a fault
  kSilent,        ///< the device stopped sending
  kReleased,      ///< the clutch is open
  kProfileWaits,  ///< the hand was released for a new profile, which takes effect at rest
  kGripped,       ///< the clutch closed
  kHandLost,      ///< poses of the hand cannot be trusted
  kNoPose,        ///< no pose of the hand came for a while
  kHandBack,      ///< poses can be trusted again
  kPlannerLate,   ///< no plan came for a while
};

constexpr auto names_of(ReasonCode) {
  using enum ReasonCode;
  return named("ReasonCode",
               {Name{kStarting, "starting"}, Name{kArmStopped, "arm_stopped", "by itself"},
                Name{kFailed, "failed", "a part of the program"}, Name{kReady, "ready", "the arm takes commands"},
                Name{kStopAsked, "stop_asked"}, Name{kStalled, "stalled", "the control loop missed cycles"},
                Name{kOffPath, "off_path", "the arm is not where its commands lead"}, Name{kReset, "reset"},
                Name{kSilent, "silent", "the device stopped sending"}, Name{kReleased, "released"},
                Name{kProfileWaits, "profile_waits", "released, since a profile takes effect at rest"},
                Name{kGripped, "gripped"}, Name{kHandLost, "hand_lost", "poses cannot be trusted"},
                Name{kNoPose, "no_pose", "none came for a while"}, Name{kHandBack, "hand_back"},
                Name{kPlannerLate, "planner_late"}});
}

/// A reason, and whose hand was on the clutch then.
struct Cause {
  ReasonCode code = ReasonCode::kStarting;
  Leader leader = Leader::kPerson;
};

/// The state of supervision changed.
struct SupervisionChange {
  Time at{0};
  SupervisionState from = SupervisionState::kIdle, to = SupervisionState::kIdle;
  std::string_view reason;  ///< static text
  bool is_failure = false;  ///< the arm stops, and nobody asked for it
};

}  // namespace steadyhand

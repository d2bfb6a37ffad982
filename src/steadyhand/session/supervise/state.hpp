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

/// As recordings and the protocol call it, e.g. "engaged".
std::string_view to_string(SupervisionState state);

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

/// As the protocol calls it, e.g. "stop_asked".
std::string_view to_string(ReasonCode code);

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

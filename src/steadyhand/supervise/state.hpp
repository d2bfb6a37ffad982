#pragma once

#include <cstdint>
#include <string_view>

#include "steadyhand/core/time.hpp"

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

/// The state of supervision changed.
struct SupervisionChange {
  Time at{0};
  SupervisionState from = SupervisionState::kIdle, to = SupervisionState::kIdle;
  std::string_view reason;  ///< static text
  bool is_failure = false;  ///< the arm stops, and nobody asked for it
};

}  // namespace steadyhand

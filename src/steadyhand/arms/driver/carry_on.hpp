#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// What an arm that is sent set-points does in cycles for which none came: for a moment it takes that for a lost
/// message and carries the motion on, then each joint brakes.
struct CarryOn {
  double bridged = 0.004;  ///< s at the acceleration of the last set-point
  JointVector braking;     ///< rad/s^2 (m/s^2), after that
};

/// The arm's own set-point `seconds` after the last that it was sent. Allocates nothing.
JointCommand carried_on(const JointCommand& last, double seconds, const CarryOn& how);

}  // namespace steadyhand

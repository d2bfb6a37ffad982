#pragma once

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// How an arm bridges cycles without a set-point: at first it assumes a lost message and continues the motion, then
/// each joint brakes.
struct CarryOn {
  double bridged = 0.004;  ///< s at the acceleration of the last set-point
  JointVector braking;     ///< rad/s^2 (m/s^2), after that
};

/// The arm's own set-point, `seconds` after the last one that it received. Allocates nothing.
JointCommand carried_on(const JointCommand& last, double seconds, const CarryOn& how);

}  // namespace steadyhand

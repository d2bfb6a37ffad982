#pragma once

namespace steadyhand {

/// Behavior of a simulated arm with contact when an obstacle blocks its commanded motion.
enum class ContactPolicy {
  kStop,   ///< the session stops when the tracking error reaches control.path_tolerance
  kYield,  ///< it presses with a small share of its torque, lags, and catches up when the way is free
  kPush,   ///< it presses with all of its torque
};

struct MujocoSettings {
  double rate_hz = 500.0;                        ///< control cycles, > 0
  double latency = 0.004;                        ///< s from a command to its effect, >= 0
  ContactPolicy contact = ContactPolicy::kStop;  ///< behavior when an obstacle blocks the arm
  double yield = 0.1;                            ///< share of the torque with ContactPolicy::kYield
  double command_timeout = 0.1;                  ///< s without a command after which the arm stops by itself, > 0
  double start_time = 0.05;                      ///< s from restart() to following
  unsigned seed = 1;                             ///< for the initial poses of a task's things
};

}  // namespace steadyhand

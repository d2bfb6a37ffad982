#pragma once

namespace steadyhand {

/// What a simulated arm with contact does where something is in the way of its commands.
enum class ContactPolicy {
  kStop,   ///< the session stops when the arm is off its commands by control.path_tolerance
  kYield,  ///< it presses with a small share of its torque, stays behind, and comes after when the way is free
  kPush,   ///< it presses with all of its torque
};

struct MujocoSettings {
  double rate_hz = 500.0;                        ///< of control cycles, > 0
  double latency = 0.004;                        ///< s from a command to its effect, >= 0
  ContactPolicy contact = ContactPolicy::kStop;  ///< what contact does to the commands
  double yield = 0.1;                            ///< of ContactPolicy::kYield: that share of the torque
  double command_timeout = 0.1;                  ///< s without a command after which the arm stops by itself, > 0
  double start_time = 0.05;                      ///< s from restart() to following
  unsigned seed = 1;                             ///< of the first places of a task's things
};

}  // namespace steadyhand

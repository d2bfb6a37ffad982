#pragma once

#include <string>

#include "steadyhand/arms/ros2/joint_order.hpp"
#include "steadyhand/arms/ros2/types.hpp"

namespace steadyhand {

/// Why joint states cannot be used.
enum class JointStateFault { kNone, kOtherJoints, kCounts, kNotFinite, kNoStamp, kSameStamp };
inline constexpr int kJointStateFaults = 6;

/// For people, with what to do. @param topic of the joint states
std::string describe(JointStateFault fault, const std::string& topic);

/// Reads positions (rad, m) and speeds of the joints from a message. Arms that measure positions only publish no
/// speeds, or NaN: then dq is of size 0. Allocates nothing.
/// @return kNone, or why the message cannot be used. Then q and dq are undefined.
JointStateFault read_joint_state(const JointStateMessage& message, JointOrder& joints, JointVector& q, JointVector& dq);

/// Whether another clock is slower or faster than ours by 4 % or more, as that of a simulation. The least difference of
/// both stays from block to block, however late messages are; a lag that begins changes it once. Allocates nothing.
class ClockPace {
 public:
  /// @param theirs stamp of a message @param ours when it came @return whether their clock is off, known after 0.75 s
  bool update(Time theirs, Time ours);

 private:
  int blocks_ = 0;  ///< started so far
  Time begin_{0}, least_{0}, before_{0}, drift_{0};
  bool off_ = false;
};

}  // namespace steadyhand

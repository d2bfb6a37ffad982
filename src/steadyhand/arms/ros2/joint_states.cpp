#include "steadyhand/arms/ros2/joint_states.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "steadyhand/arms/ros2/stamps.hpp"

namespace steadyhand {

namespace {

constexpr Time kBlock = std::chrono::milliseconds(250);  ///< in which some message is in time
constexpr Time kOff = std::chrono::milliseconds(10);     ///< between clocks, in a block

}  // namespace

bool ClockPace::update(Time theirs, Time ours) {
  const Time difference = ours - theirs;
  if (blocks_ == 0 || ours - begin_ > kBlock) {
    const Time drift = blocks_ > 1 ? least_ - before_ : Time(0);
    off_ = (drift > kOff && drift_ > kOff) || (drift < -kOff && drift_ < -kOff);
    drift_ = drift;
    before_ = least_;
    least_ = difference;
    begin_ = ours;
    ++blocks_;
  }
  least_ = std::min(least_, difference);
  return off_;
}

std::string describe(JointStateFault fault, const std::string& topic) {
  switch (fault) {
    case JointStateFault::kNone:
      return "";
    case JointStateFault::kOtherJoints:
      return fmt::format("no joint states with this arm's joints are received from {}", topic);
    case JointStateFault::kCounts:
      return fmt::format("joint states on {} have more or fewer positions than names: correct their publisher", topic);
    case JointStateFault::kNotFinite:
      return fmt::format("joint states on {} have a position that is not a finite number: correct their publisher",
                         topic);
    case JointStateFault::kNoStamp:
      return fmt::format(
          "joint states on {} carry no stamp, so trajectories cannot be timed: have their publisher set "
          "header.stamp",
          topic);
    case JointStateFault::kSameStamp:
      return fmt::format(
          "the stamp of the joint states on {} does not change, so trajectories cannot be timed: have "
          "their publisher set header.stamp to the time of each measurement",
          topic);
  }
  return "";
}

JointStateFault read_joint_state(const JointStateMessage& message, JointOrder& joints, JointVector& q,
                                 JointVector& dq) {
  const std::uint32_t count = message.name._length;
  if (!joints.find({message.name._buffer, count})) return JointStateFault::kOtherJoints;
  if (message.position._length != count) return JointStateFault::kCounts;
  const int n = static_cast<int>(joints.names().size());
  const bool has_speeds = message.velocity._length == count;
  q.resize(n);
  dq.resize(has_speeds ? n : 0);
  for (int i = 0; i < n; ++i) {
    q[i] = message.position._buffer[joints[i]];
    if (has_speeds) dq[i] = message.velocity._buffer[joints[i]];
  }
  if (!q.allFinite()) return JointStateFault::kNotFinite;
  if (!dq.allFinite()) dq.resize(0);
  const auto& stamp = message.header.stamp;
  return is_time(stamp) && time_of(stamp) > Time(0) ? JointStateFault::kNone : JointStateFault::kNoStamp;
}

}  // namespace steadyhand

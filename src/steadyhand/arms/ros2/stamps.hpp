#pragma once

#include <cstdint>
#include <limits>

#include "steadyhand/arms/ros2/types.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

inline Time time_of(const builtin_interfaces_msg_dds__Time_& stamp) {
  return std::chrono::seconds(stamp.sec) + Time(stamp.nanosec);
}

/// Whether it is a time at all, with room for what is sent soon after: ROS's seconds end in 2038.
inline bool is_time(const builtin_interfaces_msg_dds__Time_& stamp) {
  return stamp.sec >= 0 && stamp.sec < std::numeric_limits<std::int32_t>::max() - 86400 && stamp.nanosec < 1000000000;
}

/// @pre time >= 0, before 2038
template <typename Stamp>
Stamp stamp_of(Time time) {
  constexpr Time kSecond = std::chrono::seconds(1);
  Stamp stamp{};
  stamp.sec = static_cast<std::int32_t>(time / kSecond);
  stamp.nanosec = static_cast<std::uint32_t>((time % kSecond).count());
  return stamp;
}

}  // namespace steadyhand

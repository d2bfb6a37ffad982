#pragma once

#include "steadyhand/core/time.hpp"
#include "steadyhand/ros2/types.hpp"

namespace steadyhand {

inline Time time_of(const builtin_interfaces_msg_dds__Time_& stamp) {
  return std::chrono::seconds(stamp.sec) + Time(stamp.nanosec);
}

/// @pre time >= 0; ROS's seconds end in 2038
template <typename Stamp>
Stamp stamp_of(Time time) {
  constexpr Time kSecond = std::chrono::seconds(1);
  Stamp stamp{};
  stamp.sec = static_cast<std::int32_t>(time / kSecond);
  stamp.nanosec = static_cast<std::uint32_t>((time % kSecond).count());
  return stamp;
}

}  // namespace steadyhand

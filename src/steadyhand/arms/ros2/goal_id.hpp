#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <random>

#include "steadyhand/arms/ros2/types.hpp"

namespace steadyhand {

/// By which clients and servers of an action know a goal.
using GoalId = std::array<std::uint8_t, 16>;

inline GoalId goal_id_of(const unique_identifier_msgs_msg_dds__UUID_& message) {
  GoalId id;
  std::copy_n(message.uuid, id.size(), id.begin());
  return id;
}

inline unique_identifier_msgs_msg_dds__UUID_ message_of(const GoalId& id) {
  unique_identifier_msgs_msg_dds__UUID_ message{};
  std::copy_n(id.begin(), id.size(), message.uuid);
  return message;
}

/// Ids of one client's goals: random, but that it knows its own by how they begin.
class GoalIds {
 public:
  GoalIds() {
    std::random_device random;
    for (std::uint8_t& byte : begin_) byte = static_cast<std::uint8_t>(random());
  }
  GoalId next() {
    GoalId id{};
    std::copy(begin_.begin(), begin_.end(), id.begin());
    ++made_;
    std::memcpy(id.data() + begin_.size(), &made_, sizeof(made_));
    return id;
  }
  bool owns(const GoalId& id) const { return std::equal(begin_.begin(), begin_.end(), id.begin()); }

 private:
  std::array<std::uint8_t, 12> begin_{};
  std::uint32_t made_ = 0;
};

}  // namespace steadyhand

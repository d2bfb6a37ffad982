#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "steadyhand/arms/driver/ros2_settings.hpp"
#include "steadyhand/core/math.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

/// The joints' names on the ROS side, from the base: the settings', or the prefix before the model's. Fails if they are
/// not as many as the model's joints, or not different from each other.
Result<std::vector<std::string>> ros2_joint_names(const RobotModel& model, const Ros2Settings& settings);

/// Which entry of a message belongs to which joint: by name, never by position. Allocates nothing once made.
class JointOrder {
 public:
  explicit JointOrder(std::vector<std::string> names) : names_(std::move(names)) {}

  /// Looks for every joint among the message's names. @return whether each is there; the message may name others too
  bool find(std::span<char* const> names);
  /// Index of joint i in the message of the last find().
  std::size_t operator[](int i) const { return at_[i]; }
  const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
  std::array<std::size_t, kMaxJoints> at_{};
};

}  // namespace steadyhand

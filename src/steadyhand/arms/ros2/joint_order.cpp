#include "steadyhand/arms/ros2/joint_order.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace steadyhand {

Result<std::vector<std::string>> ros2_joint_names(const RobotModel& model, const Ros2Settings& settings) {
  std::vector<std::string> names;
  if (settings.joints.empty()) {
    for (const Joint& joint : model.joints) names.push_back(settings.prefix + joint.name);
    return names;
  }
  for (std::size_t begin = 0; begin <= settings.joints.size();) {
    const std::size_t end = std::min(settings.joints.find(',', begin), settings.joints.size());
    std::string name = settings.joints.substr(begin, end - begin);
    std::erase(name, ' ');
    names.push_back(settings.prefix + name);
    begin = end + 1;
  }
  if (names.size() != model.joints.size()) {
    return Error{fmt::format("ros2.joints has {} names ({}); robot '{}' has {} joints", names.size(),
                             fmt::join(names, ", "), model.name, model.dof())};
  }
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (*name == settings.prefix) return Error{fmt::format("ros2.joints '{}' has an empty name", settings.joints)};
    if (std::find(names.begin(), name, *name) != name) {
      return Error{fmt::format("ros2.joints names '{}' twice", *name)};
    }
  }
  return names;
}

bool JointOrder::find(std::span<char* const> names) {
  for (std::size_t i = 0; i < names_.size(); ++i) {
    if (at_[i] < names.size() && names_[i] == names[at_[i]]) continue;  // mostly where it was in the last message
    const auto found = std::find(names.begin(), names.end(), names_[i]);
    if (found == names.end()) return false;
    at_[i] = static_cast<std::size_t>(found - names.begin());
  }
  return true;
}

}  // namespace steadyhand

#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace steadyhand {

/// An arm that the program can control.
struct ArmKind {
  std::string_view name;   ///< in settings and on the command line
  std::string_view guide;  ///< a file in docs/; empty: none
  bool hardware = false;   ///< it moves and can hurt people, see ArmInfo::hardware
  bool has_host = false;   ///< its controller has an address that must be given
};

inline constexpr ArmKind kSimulated{"sim", ""};
inline constexpr ArmKind kMujoco{"mujoco", "reference/tasks.md"};
inline constexpr ArmKind kRos2Controller{"ros2", "how-to/ros2.md", true};
inline constexpr ArmKind kUniversalRobots{"ur", "reference/ur.md", true, true};

/// All of them: a new one is added here.
inline constexpr const ArmKind* kArmKinds[] = {&kSimulated, &kMujoco, &kRos2Controller, &kUniversalRobots};

/// Null: there is none of this name.
inline const ArmKind* find_arm_kind(std::string_view name) {
  for (const ArmKind* kind : kArmKinds) {
    if (kind->name == name) return kind;
  }
  return nullptr;
}

inline std::vector<std::string> arm_names() {
  std::vector<std::string> names;
  for (const ArmKind* kind : kArmKinds) names.emplace_back(kind->name);
  return names;
}

}  // namespace steadyhand

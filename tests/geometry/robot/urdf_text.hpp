#pragma once

#include <fmt/format.h>

#include <string>

namespace steadyhand {

inline std::string urdf_link(const std::string& name, const std::string& content = "") {
  return fmt::format("<link name=\"{}\">{}</link>\n", name, content);
}

inline std::string urdf_joint(const std::string& name, const std::string& type, const std::string& parent,
                              const std::string& child,
                              const std::string& content =
                                  "<axis xyz='0 0 1'/><limit lower='-3' upper='3' velocity='2' "
                                  "effort='10'/>") {
  return fmt::format(
      "<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/><origin xyz='0.3 0 0' rpy='1.2 0 0'/>{}"
      "</joint>\n",
      name, type, parent, child, content);
}

inline std::string urdf_robot(const std::string& content) {
  return "<?xml version=\"1.0\"?>\n<robot name=\"arm\">\n" + content + "</robot>\n";
}

/// Links l0..ln, revolute joints j1..jn about z, limits -3..3 rad and 2 rad/s.
inline std::string urdf_serial_arm(int dof) {
  std::string content = urdf_link("l0");
  for (int k = 1; k <= dof; ++k) {
    content += urdf_link(fmt::format("l{}", k));
    content += urdf_joint(fmt::format("j{}", k), "revolute", fmt::format("l{}", k - 1), fmt::format("l{}", k));
  }
  return content;
}

/// Links l0..lSHARED as urdf_serial_arm; behind the last one two arms with links left_1.. and right_1..
inline std::string urdf_two_arms(int shared, int left, int right, const std::string& content = "") {
  std::string text = urdf_serial_arm(shared);
  for (const auto& [side, dof] : {std::pair("left", left), std::pair("right", right)}) {
    std::string parent = fmt::format("l{}", shared);
    for (int k = 1; k <= dof; ++k) {
      const std::string link = fmt::format("{}_{}", side, k);
      text += urdf_link(link, content) + urdf_joint("j_" + link, "revolute", parent, link);
      parent = link;
    }
  }
  return text;
}

}  // namespace steadyhand

#include "steadyhand/apps/commands/version.hpp"

#include <fmt/format.h>

#include "steadyhand/core/configuration.hpp"
#include "steadyhand/core/processor.hpp"

namespace steadyhand {

std::string version_text() {
  std::string parts;
#ifdef STEADYHAND_UR
  parts += " ur";
#endif
#ifdef STEADYHAND_ROS2
  parts += " ros2";
#endif
#ifdef STEADYHAND_MUJOCO
  parts += " mujoco";
#endif
#ifdef STEADYHAND_CAMERA
  parts += " cameras";
#endif
#ifdef STEADYHAND_FIT
  parts += " fit";
#endif
#ifdef STEADYHAND_PAGE
  parts += " page";
#endif
  return fmt::format("steadyhand {}\ncommit {}\nprocessor {}\nbuilt in:{}", STEADYHAND_VERSION, kCommit,
                     compiled_processor(), parts.empty() ? " nothing more" : parts);
}

}  // namespace steadyhand

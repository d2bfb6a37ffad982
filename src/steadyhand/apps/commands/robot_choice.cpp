#include "steadyhand/apps/commands/robot_choice.hpp"

#include <iostream>

#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/robot_file.hpp"
#ifdef STEADYHAND_FIT
#include "steadyhand/apps/commands/progress_bar.hpp"
#include "steadyhand/files/fitted/cache.hpp"
#endif

namespace steadyhand {

#ifdef STEADYHAND_FIT
Result<RobotModel> choose_robot(const std::string& name, const std::string& tip, const Places& places, bool no_fit) {
  if (no_fit) return open_urdf(name, tip, places);
  ProgressBar bar(1, "fit:");
  const auto say = [&](const std::string& line) {
    bar.finish();
    std::cerr << "steadyhand: " << line << "\n";
  };
  const auto show = [&](const std::string& what, double fraction) { bar.show(what, fraction); };
  Result<RobotModel> model = open_fitted_robot(name, tip, places, say, show);
  bar.finish();
  return model;
}
#else
Result<RobotModel> choose_robot(const std::string& name, const std::string& tip, const Places& places, bool no_fit) {
  const auto file = find_named_file(places, "robots", name);
  if (!tip.empty() || (!no_fit && file && !is_robot_file(*file)))
    return Error{"--robot is '" + name + "', a URDF: this program was built without fitting, -DSTEADYHAND_WITH_FIT=ON"};
  return open_robot(name, places);
}
#endif

Kinematics at_home(const RobotModel& model) {
  Kinematics arm(model);
  arm.set_position(model.home);
  return arm;
}

}  // namespace steadyhand

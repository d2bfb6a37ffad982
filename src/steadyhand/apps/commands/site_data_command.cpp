#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>

#include "steadyhand/apps/browser/setup_json.hpp"
#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/apps/commands/robot_choice.hpp"
#include "steadyhand/apps/commands/session_choice.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/geometry/robot/cell.hpp"
#include "steadyhand/operator/console/settings.hpp"
#ifdef STEADYHAND_MESHES
#include "steadyhand/files/visual/arm_scene.hpp"
#endif
#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {

namespace {

/// What the page draws of the robot, as a binary glTF file, if its URDF shows anything.
Status write_scene([[maybe_unused]] const std::string& robot, [[maybe_unused]] const Places& places,
                   [[maybe_unused]] const std::filesystem::path& path) {
#ifdef STEADYHAND_MESHES
  const Result<std::string> scene = arm_scene(robot, "", places);
  if (!scene) return scene.error();
  if (!scene->empty() && !(std::ofstream(path, std::ios::binary) << *scene)) {
    return Error{"cannot write " + path.string()};
  }
#endif
  return Done{};
}

Status print_setup(const std::string& robot, const std::filesystem::path& scene) {
  const Places places = Places::standard();
  const SessionSettings settings;
  BrowserSetup setup;
  Result<RobotModel> model = open_robot(robot, places);
  if (!model) return model.error();
  if (!scene.empty()) {
    if (Status s = write_scene(robot, places, scene); !s) return s;
  }
  const Result<Cell> cell = open_cell(settings.cell, places);
  if (!cell) return cell.error();
  setup.cell = in_base(*cell, *model);
  if (Status s = check_carried(setup.cell, at_home(*model)); !s) return s;
  setup.robot = *std::move(model);
  Result<std::vector<Profile>> profiles = all_profiles(settings.profile, places, setup.robot, setup.profile);
  if (!profiles) return profiles.error();
  for (Profile& profile : *profiles) add_posture_where_redundant(profile.ocp, setup.robot);
  setup.profiles = *std::move(profiles);
  Result<std::vector<NamedRecording>> recordings = bundled_recordings(places);
  if (!recordings) return recordings.error();
  setup.recordings = *std::move(recordings);
  std::cout << setup_json(setup) << "\n";
  return Done{};
}

}  // namespace

void add_site_data_command(CommandLine& app, Command& chosen) {
  const auto robot = std::make_shared<std::string>(), scene = std::make_shared<std::string>();
  CommandLine* command = app.add_subcommand(
      "site-data", "Print the data of a session in a browser as JSON: robot, cell, profiles, recorded hands");
  command->add_option("robot", *robot, "Name (ur5e), robot file (*.yaml) or URDF")->required();
  command->add_option("--scene", *scene, "Write the robot's meshes for the page, as glTF (.glb)");
  command->footer(
      "`./steadyhand site` puts it among the files of a site that needs no program (docs/how-to/browser.md).");
  command->callback([=, &chosen] { chosen = [=] { return print_setup(*robot, *scene); }; });
}

}  // namespace steadyhand

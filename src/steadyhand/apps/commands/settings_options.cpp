#include "steadyhand/apps/commands/settings_options.hpp"

#include <fmt/format.h>

#include <cmath>

#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

Status SettingsOptions::apply(SettingsTable& table) const {
  if (!file.empty()) {
    if (Status s = table.load(file); !s) return s;
  }
  for (const Given& each : given) {
    std::string value = each.value;
    if (each.option == "--yaw") {  // people think in degrees
      const Result<double> degrees = parse_number(value);
      if (!degrees) return Error{fmt::format("--yaw {}, in degrees", degrees.error().message)};
      value = fmt::format("{}", *degrees * M_PI / 180.0);
    }
    if (Status s = table.set(each.key, value, each.option); !s) return s;
  }
  for (const std::string& assignment : assignments) {
    if (Status s = table.set(assignment); !s) return s;
  }
  return Done{};
}

void add_settings_options(CommandLine& command, SettingsOptions& options, OptionsFor who) {
  command.add_option("--settings", options.file, "YAML file of settings; `steadyhand config` prints one");
  command.add_option("--set", options.assignments, "KEY=VALUE of any setting, also several")->expected(1, -1);
  const auto value = [&](const std::string& name, const std::string& key, const std::string& what) {
    command.add_option_function(
        name, [&options, key, name](const std::string& text) { options.given.push_back({key, text, name}); }, what);
  };
  const auto flag = [&](const std::string& name, const std::string& key, const std::string& text,
                        const std::string& what) {
    command.add_flag_callback(name, [&options, key, text, name] { options.given.push_back({key, text, name}); }, what);
  };
  value("--robot", "robot", "Name, robot file or URDF");
  value("--cell", "cell", "Obstacles: name, cell file or none");
  value("--rate", "planner.rate", "Plans per second, Hz, or auto: as many as the machine sustains");
  value("--solver", "planner.solver", "Solver, instead of the profile's: " + list_solvers());
  value("--sessions", "recording.folder", "Folder of the recordings");
  flag("--no-recording", "recording.enabled", "false", "Record only what precedes a fault");
  if (who == OptionsFor::kTasks) return;
  value("--task", "task", "Task, with --arm mujoco: name in tasks/ or task file");
  value("--profile", "profile", "Name or file of a profile");
  value("--scale", "hand.scale", "Tool motion divided by hand motion");
  value("--yaw", "hand.yaw", "Rotation of the operator's axes about the base's z, degrees");
  flag("--accept-emulated", "gate.accept_emulated", "true",
       "Accept poses with a guessed position (emulated headsets mark all poses so)");
  flag("--lan", "server.lan", "true", "Serve the local network too, over HTTPS");
  value("--port", "server.port", "Port of the page on this computer; 0: any");
}

}  // namespace steadyhand

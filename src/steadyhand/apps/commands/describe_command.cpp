#include <iostream>
#include <memory>
#include <string>

#include "steadyhand/apps/commands/commands.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/record/model_json.hpp"

namespace steadyhand {

namespace {

struct DescribeOptions {
  std::string robot;
  bool pretty = false;
};

Status run_describe(const DescribeOptions& options) {
  const Result<RobotModel> model = open_robot(options.robot);
  if (!model) return model.error();
  for (const std::string& doubt : doubts_about(*model)) std::cerr << "note: " << doubt << "\n";
  std::cout << robot_json(*model, options.pretty ? 2 : -1) << "\n";
  return Done{};
}

}  // namespace

void add_describe_command(CommandLine& app, Command& chosen) {
  const auto options = std::make_shared<DescribeOptions>();
  CommandLine* command = app.add_subcommand("describe", "Print a robot as JSON: joints, tool, limits, bodies, pairs");
  command->add_option("robot", options->robot, "Name (ur5e), robot file (*.yaml) or URDF")->required();
  command->add_flag("--pretty", options->pretty, "Print on several lines");
  command->footer(
      "Examples:\n"
      "  steadyhand describe ur5e\n"
      "  steadyhand describe my_arm.urdf --pretty");
  command->callback([options, &chosen] { chosen = [options] { return run_describe(*options); }; });
}

}  // namespace steadyhand

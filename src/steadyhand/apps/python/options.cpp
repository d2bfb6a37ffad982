#include "steadyhand/apps/python/options.hpp"

#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/tuple.h>

#include <algorithm>

#include "steadyhand/apps/python/objective.hpp"
#include "steadyhand/files/config/open.hpp"
#include "steadyhand/planning/ocp/objectives.hpp"

namespace steadyhand::python {

namespace {

template <typename Value>
void take(const nb::dict& options, const char* key, Value& value) {
  if (options.contains(key)) value = nb::cast<Value>(options[key]);
}

void take_frame(const nb::dict& options, const char* key, MotionFrame& frame) {
  if (!options.contains(key)) return;
  const auto name = nb::cast<std::string>(options[key]);
  if (name != "base" && name != "tool") throw Refused(fmt::format("{} is '{}'; the frames are base, tool", key, name));
  frame = name == "tool" ? MotionFrame::kTool : MotionFrame::kBase;
}

void take_positive(const nb::dict& options, const char* key, double most, double& value) {
  take(options, key, value);
  if (!(value > 0.0) || value > most)
    throw Refused(
        fmt::format("{} is {}; it must be above 0{}", key, value, most < 1e300 ? fmt::format(", to {}", most) : ""));
}

}  // namespace

GlassSettings to_glass(nb::handle glass) {
  const auto [radius, height, fill, viscosity, factor] =
      nb::cast<std::tuple<double, double, double, double, double>>(glass);
  return {radius, height, fill, viscosity, factor};
}

double to_tilt(double tilt) {
  if (!(tilt >= 0.0) || tilt > M_PI + 1e-6) throw Refused(fmt::format("tilt is {}; it must be from 0 to pi", tilt));
  return std::min(tilt, M_PI);
}

RetargetSettings retarget_settings(const nb::dict& options, RetargetSettings settings) {
  take_positive(options, "scale", 1e308, settings.scale);
  take(options, "yaw", settings.yaw);
  take(options, "ramp", settings.ramp);
  if (settings.ramp < 0.0) throw Refused(fmt::format("ramp is {} s; it must be at least 0", settings.ramp));
  if (options.contains("tilt")) settings.tilt_max = to_tilt(nb::cast<double>(options["tilt"]));
  take_frame(options, "translation_frame", settings.translation_frame);
  take_frame(options, "rotation_frame", settings.rotation_frame);
  take(options, "accept_emulated", settings.accept_emulated);
  return settings;
}

PipelineSettings pipeline_settings(const RobotModel& model, const std::string& profile, const nb::dict& options) {
  const Profile loaded = value_of(load_profile(profile));
  check(suits(loaded, model));
  PipelineSettings settings(loaded);
  settings.retarget = retarget_settings(options, settings.retarget);
  if (options.contains("glass")) {
    if (!settings.ocp.liquid) throw Refused(fmt::format("glass: profile '{}' knows no liquid", profile));
    settings.ocp.liquid->glass = to_glass(options["glass"]);
  }
  take(options, "rate", settings.rate_hz);
  take(options, "horizon", settings.ocp.horizon);
  take_positive(options, "dt", 10.0, settings.ocp.dt);
  take_positive(options, "velocity_scale", 1.0, settings.ocp.velocity_scale);
  take_positive(options, "acceleration_scale", 1.0, settings.ocp.acceleration_scale);
  Weights weights;
  take(options, "weights", weights);
  for (const auto& [name, values] : weights) settings.ocp.weights[name] = values;
  for (auto& objective : objectives_of(options)) settings.ocp.objectives.push_back(objective);
  add_optional_objectives(settings.ocp);
  add_posture_where_redundant(settings.ocp, model);
  take(options, "solver", settings.planner.solver);
  take_positive(options, "tolerance", 0.1, settings.planner.tolerance);
  take(options, "time_budget_us", settings.planner.budget.time_us);
  if (const double us = settings.planner.budget.time_us; us < 0.0 || us > 1e9)
    throw Refused(fmt::format("time_budget_us is {}; it must be from 0 to 1e9", us));
  take_positive(options, "window", 1e308, settings.predictor.window);
  return settings;
}

}  // namespace steadyhand::python

#pragma once

#include "steadyhand/apps/python/module.hpp"
#include "steadyhand/planning/pipeline/pipeline.hpp"

namespace steadyhand::python {

/// A profile's settings and what keyword arguments change of them. The dict has only keys that are named there, with
/// numbers that are finite; what is out of range is refused.
PipelineSettings pipeline_settings(const RobotModel& model, const std::string& profile, const nb::dict& options);
/// @param settings where nothing is given
RetargetSettings retarget_settings(const nb::dict& options, RetargetSettings settings = {});
/// Of radius, height, fill, viscosity and frequency_factor.
GlassSettings to_glass(nb::handle glass);
/// rad; refused if it is not from 0 to pi.
double to_tilt(double tilt);

}  // namespace steadyhand::python

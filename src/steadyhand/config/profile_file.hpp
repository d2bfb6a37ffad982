#pragma once

#include <string>
#include <vector>

#include "steadyhand/config/places.hpp"
#include "steadyhand/core/result.hpp"
#include "steadyhand/ocp/settings.hpp"
#include "steadyhand/predict/predictor.hpp"
#include "steadyhand/solve/solver.hpp"

namespace steadyhand {

/// How the arm shall follow: a profile file, profiles/NAME.yaml.
struct Profile {
  std::string name;   ///< in paths and tables
  std::string label;  ///< for people
  OcpSettings ocp;
  Prediction prediction = Prediction::kConstantVelocity;  ///< how the hand goes on
  double tilt_max = M_PI;                                 ///< rad, see RetargetSettings
  std::string solver = kDefaultSolver;
  double tolerance = 1e-6;  ///< of the KKT conditions
};

/// A profile by name ("tracking") or path, that may weigh these objectives. Keys: name, label, weights, horizon, dt,
/// prediction, tilt, liquid, solver, tolerance, limits. Refuses with file and line: keys and terms that do not exist
/// (and lists those that do), negative weights, values out of range.
Result<Profile> load_profile(const std::string& name, const Places& places = Places::standard(),
                             const Objectives& objectives = default_objectives());

/// Its weights on one line, for people.
std::string describe_weights(const OcpSettings& ocp);

}  // namespace steadyhand

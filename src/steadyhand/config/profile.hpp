#pragma once

#include <string>

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

/// Its weights on one line, for people.
std::string describe_weights(const OcpSettings& ocp);

}  // namespace steadyhand

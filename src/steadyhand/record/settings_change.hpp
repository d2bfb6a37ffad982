#pragma once

#include <map>
#include <string>
#include <vector>

#include "steadyhand/core/time.hpp"

namespace steadyhand {

/// What the operator has set, in force from here on: a message on /operator_settings.
struct SettingsChange {
  Time at{0};
  std::map<std::string, std::vector<double>> weights;  ///< by name of the term; empty: as they were
  double scale = 1.0;                                  ///< metres of the tool for each metre of the hand
  double yaw = 0.0;                                    ///< rad, turn of the operator's axes about the base's z
};

}  // namespace steadyhand

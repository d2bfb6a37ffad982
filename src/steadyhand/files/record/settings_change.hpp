#pragma once

#include <map>
#include <optional>
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
  std::optional<double> tilt;                          ///< rad, how far the glass may lean with the hand; so, too
  std::optional<bool> no_spill;                        ///< plans spill nothing; so, too
  std::optional<double> fill;                          ///< m of liquid in the glass; absent: as it was
  std::optional<double> latency;                       ///< s, added on purpose to the hand's way; absent: none
  std::string prediction;                              ///< of the hand, by its name; empty: as it was
  std::string profile;                                 ///< that these began with; empty: not told

  /// Leaves out what a profile says.
  void keep_profile() {
    weights.clear();
    tilt.reset();
    no_spill.reset();
    prediction.clear();
  }
};

}  // namespace steadyhand

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "steadyhand/core/time.hpp"
#include "steadyhand/planning/ocp/ocp.hpp"

namespace steadyhand {

/// The operator's settings, in force from here on: a message on /operator_settings.
struct SettingsChange {
  Time at{0};
  Weights weights;                ///< empty: as they were
  double scale = 1.0;             ///< metres of the tool for each metre of the hand
  double yaw = 0.0;               ///< rad, turn of the operator's axes about the base's z
  std::optional<double> tilt;     ///< rad, how far the glass may lean with the hand; so, too
  std::optional<bool> no_spill;   ///< plans spill nothing; so, too
  std::optional<double> fill;     ///< m of liquid in the glass; absent: as it was
  std::optional<double> latency;  ///< s, added on purpose to the hand's way; absent: none
  std::string prediction;         ///< name of the hand's prediction; empty: as it was
  std::string profile;            ///< from which these started; empty: not reported

  /// Leaves out the profile's values.
  void keep_profile() {
    weights.clear();
    tilt.reset();
    no_spill.reset();
    prediction.clear();
  }
};

/// The metadata `weights` of a run: JSON, an object.
std::string weights_text(const Weights& weights);
/// The weights again; also of "position 1500, posture 1 1 2", as version 0.2 wrote them. None of what is neither.
Weights read_weights(std::string_view text);

}  // namespace steadyhand

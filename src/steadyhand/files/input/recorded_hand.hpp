#pragma once

#include <string>
#include <vector>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// A hand's motion, read from a file.
struct Recording {
  std::string name;   ///< the file's name without its extension
  std::string track;  ///< key of the A-Frame track; empty for CSV
  /// At least 2, in robot axes (z up). Stamps strictly increase from 0; `made` equals `hand`.
  std::vector<OperatorSample> samples;

  double duration() const { return to_seconds(samples.back().stamp.hand); }                  ///< s
  double mean_rate() const { return static_cast<double>(samples.size() - 1) / duration(); }  ///< Hz
};

}  // namespace steadyhand

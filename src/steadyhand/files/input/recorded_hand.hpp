#pragma once

#include <string>
#include <vector>

#include "steadyhand/core/arrows.hpp"

namespace steadyhand {

/// The motion of a hand, or of one for each tool, read from a file.
struct Recording {
  std::string name;   ///< the file's name without its extension
  std::string track;  ///< keys of the hands in the file, separated by commas; empty: it names none
  /// At least 2, in robot axes (z up), in order of time. Stamps of each hand strictly increase; the first of all is 0,
  /// and `made` equals `hand`.
  std::vector<OperatorSample> samples;
  std::string note{};  ///< for people, on hands of the file that are not used; empty: there are none

  double duration() const { return to_seconds(samples.back().stamp.hand); }                  ///< s
  double mean_rate() const { return static_cast<double>(samples.size() - 1) / duration(); }  ///< Hz
};

}  // namespace steadyhand

#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/input/recorded_hand.hpp"

namespace steadyhand {

struct RecordingOptions {
  /// Key of the hand in the file; empty: `rhand` or `right`, or the only one. If the robot has several tools, keys in
  /// their order, separated by commas, and a key alone moves the tool on its side, or the first. Empty: each hand moves
  /// the tool of its name, or on its side: `lhand` or `left`, `rhand` or `right`.
  std::string track{};
  double from = 0.0;                                       ///< s after the file's first sample; >= 0
  double until = std::numeric_limits<double>::infinity();  ///< s after the file's first sample; > from
  std::vector<std::string> tools{};                        ///< names of the robot's; none: it has one
};

/// Reads one of two formats, distinguished by the extension `.json` or a first character `{` or `[`:
///
/// - CSV with the header `t,px,py,pz,qx,qy,qz,qw[,clutch]`, columns in any order: s, m, unit quaternion of the hand in
///   the operator's frame (z up), clutch 0 or 1. Without the clutch column the hand is engaged throughout. A file of
///   several hands has the name of the hand before each column except t, as in `left_px`; where a hand has no sample,
///   its cells are empty.
/// - A-Frame motion capture, {KEY: {"poses": [{"position": {x, y, z}, "rotation": {x, y, z}, "timestamp"}, ...]}}:
///   m, degrees (R = Ry Rx Rz, three.js order YXZ), ms, in WebXR axes: x right, y up, z backward. They are turned to
///   robot axes (x forward, y left, z up) here, the hand's and the room's. Engaged throughout.
///
/// Refuses, naming file, line or key, value and what would be right: files that cannot be read or are no such
/// recording, numbers that are missing or not finite, times of a hand that repeat or go backwards or span over a day,
/// positions over 100 m, quaternions off unit norm by over 1e-3 (closer ones are normalised), tracks of one name, and
/// fewer than 2 samples of a hand, or in range.
Result<Recording> load_recording(const std::filesystem::path& path, const RecordingOptions& options = {});

}  // namespace steadyhand

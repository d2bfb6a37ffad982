#pragma once

#include <filesystem>
#include <limits>
#include <string>

#include "steadyhand/core/result.hpp"
#include "steadyhand/files/input/recorded_hand.hpp"

namespace steadyhand {

struct RecordingOptions {
  /// Which track of an A-Frame file; empty: `rhand`, or the only track that there is. A CSV file has none.
  std::string track;
  double from = 0.0;                                       ///< s after the file's first sample; >= 0
  double until = std::numeric_limits<double>::infinity();  ///< s after the file's first sample; > from
};

/// Reads one of two formats, distinguished by the extension `.json` or a first character `{` or `[`:
///
/// - CSV with the header `t,px,py,pz,qx,qy,qz,qw[,clutch]`, columns in any order: s, m, unit quaternion of the hand in
///   the operator's frame (z up), clutch 0 or 1. Without the clutch column the hand is engaged throughout.
/// - A-Frame motion capture, {KEY: {"poses": [{"position": {x, y, z}, "rotation": {x, y, z}, "timestamp"}, ...]}}:
///   m, degrees (R = Ry Rx Rz, three.js order YXZ), ms, in WebXR axes: x right, y up, z backward. They are turned to
///   robot axes (x forward, y left, z up) here, the hand's and the room's. Engaged throughout.
///
/// Refuses, naming file, line or key, value and what would be right: files that cannot be read or are no such
/// recording, numbers that are missing or not finite, times that repeat or go backwards or span over a day, positions
/// over 100 m, quaternions off unit norm by over 1e-3 (closer ones are normalised), and fewer than 2 samples in range.
Result<Recording> load_recording(const std::filesystem::path& path, const RecordingOptions& options = {});

}  // namespace steadyhand

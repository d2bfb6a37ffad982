#pragma once

#include <map>
#include <string>
#include <vector>

namespace steadyhand {

/// The optimal control problem as a profile file states it (profiles/*.yaml).
struct OcpSettings {
  int horizon = 8;   ///< N, intervals, 1..kMaxHorizon
  double dt = 0.05;  ///< s
  /// By objective name (see objectives()); one number stands for all entries. An objective that is absent has weight 0.
  std::map<std::string, std::vector<double>> weights;
  double velocity_scale = 1.0;      ///< (0, 1], of the robot's velocity limits
  double acceleration_scale = 1.0;  ///< (0, 1], of the robot's acceleration limits
};

}  // namespace steadyhand

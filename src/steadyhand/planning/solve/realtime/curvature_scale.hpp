#pragma once

#include <vector>

#include "steadyhand/planning/ocp/evaluation.hpp"

namespace steadyhand::realtime {

/// Curvature of the objectives by an acceleration, at the robot's home: linear in their weights.
class CurvatureScale {
 public:
  explicit CurvatureScale(const Ocp& ocp);
  /// 1 where nothing has a weight.
  double of(const std::vector<JointVector>& weights) const;

 private:
  std::vector<JointVector> unit_;  ///< by objective and weight entry
};

}  // namespace steadyhand::realtime

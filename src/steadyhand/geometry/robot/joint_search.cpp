#include "steadyhand/geometry/robot/joint_search.hpp"

#include <algorithm>
#include <cmath>

namespace steadyhand {

JointBox::JointBox(const RobotModel& model, int first, int last)
    : middle_(last - first), half_(last - first), full_turn_(last - first, false) {
  for (int k = 0; k < size(); ++k) {
    const double low = model.position_min[first + k], high = model.position_max[first + k];
    middle_[k] = 0.5 * (low + high);
    half_[k] = 0.5 * (high - low);
    if (model.joints[first + k].type == JointType::kRevolute && half_[k] >= M_PI) {
      half_[k] = M_PI;
      full_turn_[k] = true;
    }
  }
}

JointVector JointBox::sample(std::mt19937& random) const {
  // Not std::uniform_real_distribution: its numbers differ between standard libraries.
  return JointVector::NullaryExpr(
      size(), [&](Eigen::Index k) { return middle_[k] + half_[k] * (2.0 * (random() / 4294967296.0) - 1.0); });
}

double JointBox::clip(int k, double q) const {
  if (full_turn_[k]) return middle_[k] + std::remainder(q - middle_[k], 2.0 * M_PI);
  return std::clamp(q, middle_[k] - half_[k], middle_[k] + half_[k]);
}

}  // namespace steadyhand

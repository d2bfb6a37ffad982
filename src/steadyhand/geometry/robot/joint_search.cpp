#include "steadyhand/geometry/robot/joint_search.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace steadyhand {

static std::vector<int> all_joints(const RobotModel& model) {
  std::vector<int> joints(model.dof());
  std::iota(joints.begin(), joints.end(), 0);
  return joints;
}

JointBox::JointBox(const RobotModel& model) : JointBox(model, all_joints(model)) {}

JointBox::JointBox(const RobotModel& model, const std::vector<int>& joints)
    : middle_(joints.size()), half_(joints.size()), full_turn_(joints.size(), false) {
  for (int k = 0; k < size(); ++k) {
    const double low = model.position_min[joints[k]], high = model.position_max[joints[k]];
    middle_[k] = 0.5 * (low + high);
    half_[k] = 0.5 * (high - low);
    if (model.joints[joints[k]].type == JointType::kRevolute && half_[k] >= M_PI) {
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

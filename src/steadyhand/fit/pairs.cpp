#include <algorithm>
#include <cmath>
#include <random>

#include "steadyhand/collision/proximity.hpp"
#include "steadyhand/fit/fit.hpp"
#include "steadyhand/robot/kinematics.hpp"

namespace steadyhand {

namespace {

constexpr int kSteps = 20'000;
constexpr double kLeastMove = 1e-6;  // m

/// Searches the joints between two bodies for a place where they are near, and leaves out boxes of joint angles in
/// which a bound on how far the second one can move shows that there is none.
class NearSearch {
 public:
  NearSearch(const RobotModel& model, const BodyPair& pair, double margin)
      : model_(model), a_(model.bodies[pair.first]), b_(model.bodies[pair.second]), margin_(margin) {
    const int count = b_.link - a_.link;
    middle_.resize(count);
    half_.resize(count);
    reach_.resize(count);
    // Distance of the second body's furthest point from a joint's axis: at most that from its origin.
    double behind = b_.origin.translation().norm() + b_.shape.extent();
    for (int k = count - 1; k >= 0; --k) {
      const Joint& joint = model.joints[a_.link + k];
      const double low = model.position_min[a_.link + k], high = model.position_max[a_.link + k];
      middle_[k] = 0.5 * (low + high);
      half_[k] = 0.5 * (high - low);
      if (joint.type == JointType::kPrismatic) {
        reach_[k] = 1.0;
        behind += std::max(std::abs(low), std::abs(high));
      } else {
        half_[k] = std::min(half_[k], M_PI);
        reach_[k] = behind;
        if (k == count - 1) {
          reach_[k] = b_.origin.translation().cross(joint.axis).norm() + b_.shape.extent();
        }
      }
      behind += joint.origin.translation().norm();
    }
  }

  /// False: shown that they never are.
  bool may_meet() {
    steps_ = kSteps;
    return search(middle_, half_);
  }

 private:
  double distance_at(const JointVector& q) const {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (int k = a_.link; k < b_.link; ++k) T = T * model_.joints[k].origin * motion(model_.joints[k], q[k - a_.link]);
    const Eigen::Isometry3d B = T * b_.origin;
    return distance(a_.shape, Placed{a_.origin.translation(), a_.origin.linear()}, b_.shape,
                    Placed{B.translation(), B.linear()});
  }

  bool search(const JointVector& middle, const JointVector& half) {
    if (--steps_ < 0) return true;
    const double there = distance_at(middle);
    if (there < margin_) return true;
    const JointVector moves = half.cwiseProduct(reach_);
    if (there - moves.sum() > margin_) return false;
    if (moves.sum() < kLeastMove) return true;  // along where they are just so near it would go on for ever
    int k = 0;
    moves.maxCoeff(&k);
    JointVector halved = half, lower = middle, upper = middle;
    halved[k] *= 0.5;
    lower[k] -= halved[k];
    upper[k] += halved[k];
    return search(lower, halved) || search(upper, halved);
  }

  const RobotModel& model_;
  const Body &a_, &b_;
  double margin_;
  int steps_ = 0;
  JointVector middle_, half_, reach_;  // reach: m that a point of the second body moves at most for joint velocity 1
};

}  // namespace

std::vector<BodyPair> pairs_that_meet(const RobotModel& model, const std::vector<BodyPair>& pairs, double margin) {
  std::vector<BodyPair> kept;
  for (const BodyPair& pair : pairs) {
    if (NearSearch(model, pair, margin).may_meet()) kept.push_back(pair);
  }
  return kept;
}

}  // namespace steadyhand

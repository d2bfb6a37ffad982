#include "steadyhand/geometry/robot/pairs.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/fit/fit.hpp"

namespace steadyhand {

namespace {

constexpr int kSteps = 20'000;
constexpr int kStepsOfParts = 100'000;
constexpr double kLeastMove = 1e-6;  // m

/// Searches the joints between two solids for a place where they are near, and leaves out boxes of joint angles in
/// which a bound on how far the second one can move shows that there is none.
/// @tparam Distance of the second's pose in the frame of the first's link, m; never more than the solids' own
template <typename Distance>
class NearSearch {
 public:
  /// @param furthest m, of the second's points from the origin of its link
  /// @param turned m, of the same from the axis of the last joint
  NearSearch(const RobotModel& model, int first, int last, double furthest, double turned, double margin,
             const Distance& distance)
      : model_(model), way_(way_between(model, first, last)), margin_(margin), distance_(distance) {
    const int count = static_cast<int>(way_.size());
    middle_.resize(count);
    half_.resize(count);
    reach_.resize(count);
    double behind = furthest;
    for (int k = count - 1; k >= 0; --k) {
      const auto [index, sign] = way_[k];
      const Joint& joint = model.joints[index];
      const double low = model.position_min[index], high = model.position_max[index];
      // Where the way goes towards the base, the joint's frame is behind its origin.
      if (sign < 0.0) behind += joint.origin.translation().norm();
      middle_[k] = 0.5 * (low + high);
      half_[k] = 0.5 * (high - low);
      if (joint.type == JointType::kPrismatic) {
        reach_[k] = 1.0;
        behind += std::max(std::abs(low), std::abs(high));
      } else {
        half_[k] = std::min(half_[k], M_PI);
        reach_[k] = k == count - 1 ? turned : behind;
      }
      if (sign > 0.0) behind += joint.origin.translation().norm();
    }
  }

  /// False: shown that they never are.
  bool may_meet(int& steps) { return search(middle_, half_, steps); }

 private:
  bool search(const JointVector& middle, const JointVector& half, int& steps) {
    if (--steps < 0) return true;
    const Eigen::Isometry3d T = pose_along(model_, way_, middle);
    const JointVector moves = half.cwiseProduct(reach_);
    const double there = distance_(T, margin_ + moves.sum());
    if (there < margin_) return true;
    if (there - moves.sum() > margin_) return false;
    if (moves.sum() < kLeastMove) return true;  // along where they are just so near it would go on for ever
    int k = 0;
    moves.maxCoeff(&k);
    JointVector halved = half, lower = middle, upper = middle;
    halved[k] *= 0.5;
    lower[k] -= halved[k];
    upper[k] += halved[k];
    return search(lower, halved, steps) || search(upper, halved, steps);
  }

  const RobotModel& model_;
  std::vector<SignedJoint> way_;
  double margin_;
  const Distance& distance_;
  JointVector middle_, half_, reach_;  // reach: m that a point of the second moves at most for joint velocity 1
};

bool may_meet(const RobotModel& model, const BodyPair& pair, double margin) {
  const Body &a = model.bodies[pair.first], &b = model.bodies[pair.second];
  const Placed A{a.origin.translation(), a.origin.linear()};
  const auto apart = [&](const Eigen::Isometry3d& T, double) {
    const Eigen::Isometry3d B = T * b.origin;
    return distance(a.shape, A, b.shape, Placed{B.translation(), B.linear()});
  };
  const double furthest = b.origin.translation().norm() + b.shape.extent();
  const double turned = b.origin.translation().cross(model.joints[b.link - 1].axis).norm() + b.shape.extent();
  int steps = kSteps;
  return NearSearch(model, a.link, b.link, furthest, turned, margin, apart).may_meet(steps);
}

}  // namespace

bool parts_may_meet(const RobotModel& model, int first, const std::vector<Points>& parts_of_first, int second,
                    const std::vector<Points>& parts_of_second, double margin) {
  int steps = kStepsOfParts;
  for (const Points& a : parts_of_first) {
    for (const Points& b : parts_of_second) {
      double furthest = 0.0, turned = 0.0;
      for (const Vector3& corner : b) {
        furthest = std::max(furthest, corner.norm());
        turned = std::max(turned, corner.cross(model.joints[second - 1].axis).norm());
      }
      const auto apart = [&](const Eigen::Isometry3d& T, double enough) {
        return nearest_points(a, b, T, enough).distance;
      };
      if (NearSearch(model, first, second, furthest, turned, margin, apart).may_meet(steps)) return true;
    }
  }
  return false;
}

std::vector<BodyPair> pairs_that_meet(const RobotModel& model, const std::vector<BodyPair>& pairs, double margin) {
  std::vector<BodyPair> kept;
  for (const BodyPair& pair : pairs) {
    if (may_meet(model, pair, margin)) kept.push_back(pair);
  }
  return kept;
}

}  // namespace steadyhand

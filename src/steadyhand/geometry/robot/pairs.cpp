#include "steadyhand/geometry/robot/pairs.hpp"

#include <algorithm>

#include "steadyhand/geometry/collision/proximity.hpp"
#include "steadyhand/geometry/robot/joint_search.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"

namespace steadyhand {

namespace {

constexpr int kPartingSamples = 1000;
constexpr int kPartingAscents = 4;

/// m, positive when the bodies are apart; see proximity_value.
double separation(const RobotModel& model, const BodyPair& pair, const Eigen::Isometry3d& T) {
  const auto placed = [](const Eigen::Isometry3d& origin) { return Placed{origin.translation(), origin.linear()}; };
  const Body &a = model.bodies[pair.first], &b = model.bodies[pair.second];
  return proximity_value(a.shape, placed(a.origin), b.shape, placed(T * b.origin));
}

/// A pair that no configuration has parted yet, with the configurations in which it came closest to parting.
struct Candidate {
  BodyPair pair;
  std::vector<std::pair<double, JointVector>> best;  ///< separation and joints, largest separation first
};

void remember(Candidate& candidate, double value, const JointVector& q) {
  auto& best = candidate.best;
  if (best.size() == kPartingAscents && value <= best.back().first) return;
  const auto place = std::find_if(best.begin(), best.end(), [&](const auto& entry) { return value > entry.first; });
  best.insert(place, {value, q});
  if (best.size() > kPartingAscents) best.pop_back();
}

/// Appends those of the wanted pairs between two links that can come apart.
void add_pairs_that_part(const RobotModel& model, int first, int last, const std::function<bool(int, int)>& wanted,
                         std::vector<BodyPair>& result) {
  std::vector<Candidate> candidates;
  for (int i = 0; i < static_cast<int>(model.bodies.size()); ++i) {
    for (int j = 0; j < static_cast<int>(model.bodies.size()); ++j) {
      if (model.bodies[i].link != first || model.bodies[j].link != last) continue;
      if (!wanted || wanted(i, j)) candidates.push_back({{i, j}, {}});
    }
  }
  if (candidates.empty()) return;
  const std::vector<SignedJoint> way = way_between(model, first, last);
  std::vector<int> joints;
  for (const SignedJoint& each : way) joints.push_back(each.joint);
  const JointBox box(model, joints);
  std::mt19937 random(1);
  for (int s = 0; s < kPartingSamples && !candidates.empty(); ++s) {
    const JointVector q = box.sample(random);
    const Eigen::Isometry3d T = pose_along(model, way, q);
    std::erase_if(candidates, [&](Candidate& candidate) {
      const double value = separation(model, candidate.pair, T);
      if (value > 0.0) {
        result.push_back(candidate.pair);
        return true;
      }
      remember(candidate, value, q);
      return false;
    });
  }
  for (const Candidate& candidate : candidates) {
    const auto value = [&](const JointVector& q) {
      return separation(model, candidate.pair, pose_along(model, way, q));
    };
    for (const auto& [start_value, start] : candidate.best) {
      if (value(box.ascend(start, value)) > 0.0) {
        result.push_back(candidate.pair);
        break;
      }
    }
  }
}

}  // namespace

Eigen::Isometry3d pose_along(const RobotModel& model, const std::vector<SignedJoint>& way, const JointVector& q) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (std::size_t k = 0; k < way.size(); ++k) {
    const Joint& joint = model.joints[way[k].joint];
    const Eigen::Isometry3d step = joint.origin * motion(joint, q[static_cast<Eigen::Index>(k)]);
    T = T * (way[k].sign > 0.0 ? step : step.inverse());
  }
  return T;
}

std::vector<BodyPair> default_pairs(const RobotModel& model, const std::function<bool(int, int)>& wanted) {
  std::vector<BodyPair> pairs;
  for (int first = 0; first <= model.dof(); ++first) {
    for (int last = first + 1; last <= model.dof(); ++last) {
      if (may_be_pair(model, first, last)) add_pairs_that_part(model, first, last, wanted, pairs);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace steadyhand

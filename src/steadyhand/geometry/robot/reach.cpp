#include <algorithm>
#include <cmath>

#include "steadyhand/geometry/robot/joint_search.hpp"
#include "steadyhand/geometry/robot/kinematics.hpp"
#include "steadyhand/geometry/robot/model.hpp"

namespace steadyhand {

namespace {

constexpr int kReachSamples = 20000;
constexpr int kReachAscents = 8;
constexpr double kMargin = 1e-4;  // m

/// @param q of the chain's joints
Vector3 tool_position(const RobotModel& model, const Tool& tool, const std::vector<int>& chain, const JointVector& q) {
  Vector3 p = tool.origin.translation();
  for (int k = static_cast<int>(chain.size()) - 1; k >= 0; --k) {
    const Joint& joint = model.joints[chain[k]];
    if (joint.type == JointType::kPrismatic) {
      p += q[k] * joint.axis;
    } else {  // Rodrigues: a matrix for each joint takes four times as long
      const double cosine = std::cos(q[k]);
      p = cosine * p + std::sin(q[k]) * joint.axis.cross(p) + (1.0 - cosine) * joint.axis.dot(p) * joint.axis;
    }
    p = joint.origin.linear() * p + joint.origin.translation();
  }
  return p;
}

double farthest(const std::vector<Vector3>& points, const Vector3& from) {
  double largest = 0.0;
  for (const Vector3& point : points) largest = std::max(largest, (point - from).squaredNorm());
  return std::sqrt(largest);
}

/// The s at which the farthest point is nearest to origin + s * axis: a convex function, so golden section finds it.
double best_along_axis(const std::vector<Vector3>& points, const Vector3& origin, const Vector3& axis) {
  double low = -farthest(points, origin), high = -low;
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0);
  while (high - low > 1e-4) {
    const double left = high - ratio * (high - low), right = low + ratio * (high - low);
    if (farthest(points, origin + left * axis) < farthest(points, origin + right * axis)) {
      high = right;
    } else {
      low = left;
    }
  }
  return 0.5 * (low + high);
}

}  // namespace

Reach compute_reach(const RobotModel& model, int index) {
  const Tool& tool = model.tools[index];
  const std::vector<int> chain = model.chain(tool.link);
  const JointBox box(model, chain);
  std::mt19937 random(1);
  std::vector<JointVector> samples(kReachSamples);
  std::vector<Vector3> points(kReachSamples);
  for (int i = 0; i < kReachSamples; ++i) {
    samples[i] = box.sample(random);
    points[i] = tool_position(model, tool, chain, samples[i]);
  }
  const Joint& first = model.joints[chain[0]];
  const Vector3 origin = first.origin.translation(), axis = first.origin.linear() * first.axis;
  Reach reach{origin + best_along_axis(points, origin, axis) * axis, 0.0};

  const auto distance = [&](const JointVector& q) {
    return (tool_position(model, tool, chain, q) - reach.center).norm();
  };
  std::vector<int> order(kReachSamples);
  for (int i = 0; i < kReachSamples; ++i) order[i] = i;
  std::partial_sort(order.begin(), order.begin() + kReachAscents, order.end(), [&](int a, int b) {
    return (points[a] - reach.center).squaredNorm() > (points[b] - reach.center).squaredNorm();
  });
  for (int i = 0; i < kReachAscents; ++i) {
    reach.radius = std::max(reach.radius, distance(box.ascend(samples[order[i]], distance)));
  }
  reach.radius += kMargin;
  return reach;
}

std::vector<Reach> compute_reaches(const RobotModel& model) {
  std::vector<Reach> reaches;
  for (int t = 0; t < model.tool_count(); ++t) reaches.push_back(compute_reach(model, t));
  return reaches;
}

Vector3 clip(const Reach& reach, const Vector3& point) {
  const Vector3 offset = point - reach.center;
  const double distance = offset.norm();
  return distance <= reach.radius ? point : Vector3(reach.center + (reach.radius / distance) * offset);
}

}  // namespace steadyhand

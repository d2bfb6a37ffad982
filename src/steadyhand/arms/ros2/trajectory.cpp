#include "steadyhand/arms/ros2/trajectory.hpp"

#include <algorithm>

#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

namespace {

/// Before and behind a node: half a cycle of a controller at 500 Hz.
constexpr double kBeside = 0.001;           // s
constexpr double kSameAcceleration = 1e-3;  // rad/s^2

}  // namespace

void make_trajectory(std::span<const JointCommand> commands, const Plan& plan, std::vector<JointCommand>& points) {
  points.assign(commands.begin(), commands.end());
  const auto add = [&](Time at, const JointVector& ddq) {
    if (at <= points.back().stamp.made) return;
    JointCommand point = sample(plan, at);
    point.stamp.made = at;
    point.ddq = ddq;
    points.push_back(point);
  };
  const Time beside = from_seconds(std::min(kBeside, 0.25 * plan.dt));
  const JointVector none = JointVector::Zero(plan.joints);
  for (int k = 1; k < plan.intervals; ++k) {
    const Time node = plan.start + from_seconds(k * plan.dt);
    if (node <= points.back().stamp.made) continue;
    if ((plan.u[k] - plan.u[k - 1]).cwiseAbs().maxCoeff() < kSameAcceleration) continue;
    add(node - beside, plan.u[k - 1]);
    add(node + beside, plan.u[k]);
  }
  const Time end = plan.start + from_seconds(plan.intervals * plan.dt);
  if (plan.intervals > 0) add(end - beside, plan.u[plan.intervals - 1]);
  add(std::max(end, points.back().stamp.made) + beside, none);
}

}  // namespace steadyhand

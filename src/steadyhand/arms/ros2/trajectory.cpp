#include "steadyhand/arms/ros2/trajectory.hpp"

#include <algorithm>

#include "steadyhand/arms/ros2/stamps.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

namespace {

dds_sequence_double numbers(JointVector& values) {
  dds_sequence_double sequence{};
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(values.size());
  sequence._buffer = values.data();
  return sequence;
}

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

TrajectoryOrder& TrajectoryOrder::operator=(const TrajectoryOrder& other) {
  count = other.count;
  std::copy_n(other.commands.begin(), count, commands.begin());
  plan = other.plan;
  begin = other.begin;
  executes = other.executes;
  return *this;
}

TrajectorySender::TrajectorySender(const std::vector<std::string>& names) : joints_(names) {
  for (std::string& name : joints_) names_.push_back(name.data());
}

Status TrajectorySender::open(Ros2Node& node, const std::string& topic, Time lifespan) {
  auto trajectories = node.publish<JointTrajectoryMessage>(topic, lifespan);
  if (!trajectories) return trajectories.error();
  trajectories_ = *trajectories;
  return Done{};
}

void TrajectorySender::send_newest() {
  if (!orders_.read(order_)) return;
  make_trajectory({order_.commands.data(), static_cast<std::size_t>(order_.count)}, order_.plan, points_);
  messages_.resize(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    JointCommand& point = points_[i];
    messages_[i] = {};
    messages_[i].positions = numbers(point.q);
    messages_[i].velocities = numbers(point.dq);
    messages_[i].accelerations = numbers(point.ddq);
    messages_[i].time_from_start = stamp_of<builtin_interfaces_msg_dds__Duration_>(point.stamp.made - order_.begin);
  }
  JointTrajectoryMessage message{};
  message.header.stamp = stamp_of<builtin_interfaces_msg_dds__Time_>(order_.executes);
  message.header.frame_id = frame_.data();
  message.joint_names = sequence_of<decltype(message.joint_names)>(names_);
  message.points = sequence_of<decltype(message.points)>(messages_);
  (void)trajectories_.send(message);  // one that does not get away is made good by the next
}

}  // namespace steadyhand

#include "steadyhand/arms/ros2/ros2_link_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <thread>

#include "steadyhand/arms/ros2/stamps.hpp"
#include "steadyhand/core/time.hpp"

namespace steadyhand {

namespace {

constexpr double kPaceFrom = 0.5;   ///< s
constexpr double kPaceOff = 0.02;   ///< share, and ...
constexpr double kPaceLate = 0.06;  ///< ... s, for messages that come late, by which the stamps' pace may be off

}  // namespace

void Ros2LinkMeter::state(Time arrival, Time stamp, Ros2PublisherId publisher) {
  publishers_.insert(publisher);
  report_.stamped = report_.stamped && stamp > Time(0);
  if (report_.states++ == 0) {
    first_ = arrival;
  } else {
    report_.longest_gap = std::max(report_.longest_gap, 1e-3 * static_cast<double>((arrival - last_).count()));
  }
  last_ = arrival;
  if (stamp == last_stamp_ && stamp > Time(0)) unusable(JointStateFault::kSameStamp);
  if (stamp <= last_stamp_) return;
  if (first_stamp_ == Time(0)) first_stamp_ = stamp;
  last_stamp_ = stamp;
  const Time due = earliest_.update(stamp, arrival, true);
  late_.add(1e-3 * static_cast<double>((arrival - due).count()));
}

Ros2LinkReport Ros2LinkMeter::report(int controllers) const {
  Ros2LinkReport report = report_;
  report.seconds = to_seconds(last_ - first_);
  if (report.seconds >= kPaceFrom) report.pace = to_seconds(last_stamp_ - first_stamp_) / report.seconds;
  report.publishers = publishers_.size();
  report.late = late_.summary();
  report.wake = wake_.summary();
  report.controllers = controllers;
  return report;
}

Ros2LinkJudgement judge(const Ros2LinkReport& r, const Ros2Settings& s, const RobotModel& model) {
  Ros2LinkJudgement j;
  const auto say = [&](std::string line) { j.findings.push_back(std::move(line)); };
  const double silence = 1e6 * s.state_timeout;
  for (const JointStateFault fault :
       {JointStateFault::kCounts, JointStateFault::kNotFinite, JointStateFault::kSameStamp}) {
    // A publisher that is faster than its data sends a few stamps twice.
    const std::uint64_t count = r.unusable[static_cast<std::size_t>(fault)];
    if (count > 0 && (fault != JointStateFault::kSameStamp || 2 * count > r.states))
      say(fmt::format("{} of {} states cannot be used: {}", count, r.states + count, describe(fault, s.joint_states)));
  }
  if (r.states == 0) {
    if (!j.findings.empty()) return j;
    say(fmt::format(
        "no joint states with this arm's joints are received from {}, {} with others: is the driver running, "
        "in this domain, with these names (ros2.joint_states, ros2.prefix, ros2.joints)?",
        s.joint_states, r.strangers));
    return j;
  }
  if (r.publishers > 1) {
    say(fmt::format("{} publishers send states of this arm's joints to {}: end all but one", r.publishers,
                    s.joint_states));
  }
  if (!r.stamped) {
    say(describe(JointStateFault::kNoStamp, s.joint_states));
  } else if (2 * r.unusable[static_cast<std::size_t>(JointStateFault::kSameStamp)] <= r.states &&
             std::abs(r.pace - 1.0) * r.seconds > kPaceOff * r.seconds + kPaceLate) {
    say(fmt::format(
        "the stamps of the joint states advance at {:.0f} % of real time: run the simulation at a real-time "
        "factor of 1",
        100.0 * r.pace));
  }
  for (int i = 0; i < std::min<int>(model.dof(), static_cast<int>(r.q.size())); ++i) {
    if (r.q[i] >= model.position_min[i] && r.q[i] <= model.position_max[i]) continue;
    say(fmt::format("joint '{}' is at {:.4g}, beyond its position limits, {:.4g} to {:.4g}: move it back first",
                    model.joints[i].name, r.q[i], model.position_min[i], model.position_max[i]));
  }
  if (r.controllers == 0) {
    say(fmt::format("no controller listens to {}/joint_trajectory: activate one, or set ros2.controller",
                    s.controller));
  } else if (!r.active) {
    say(
        fmt::format("{} listens, but is not active (no messages on {}/controller_state): ros2 control "
                    "switch_controllers --activate {}",
                    s.controller, s.controller, s.controller.substr(s.controller.rfind('/') + 1)));
  }
  if (r.speed_scaling < 99.9) {
    say(fmt::format(
        "{} reports {:.4g} %; below 100 the arm does not move: set its speed slider to 100 %, and start its "
        "program",
        s.speed_scaling, r.speed_scaling));
  }
  if (r.grippers && *r.grippers != 1) {
    say(
        fmt::format("{} action servers answer for the gripper at {}; one should: start its controller, name its action "
                    "with ros2.gripper, or leave it alone with an empty one",
                    *r.grippers, s.gripper.action));
  }
  if (r.commanders > 0) {
    say(fmt::format("another program sent {} trajectories to {}: end that program", r.commanders, s.controller));
  }
  j.fit = j.findings.empty() && r.longest_gap < silence && r.late.max < silence;
  if (r.longest_gap >= 0.5 * silence || r.late.max >= 0.5 * silence) {
    say(
        fmt::format("joint states had gaps of up to {:.1f} ms and were up to {:.1f} ms late; {:.0f} ms stop the arm "
                    "(ros2.state_timeout, and with it ros2.look_ahead)",
                    1e-3 * r.longest_gap, 1e-3 * r.late.max, 1e-3 * silence));
  }
  if (r.wake.max > 0.25 * silence) {
    say(
        fmt::format("this machine wakes up to {:.1f} ms late: allow real-time priority (rtprio and memlock in "
                    "/etc/security/limits.conf), end other work",
                    1e-3 * r.wake.max));
  }
  const double rate = r.seconds > 0.0 ? static_cast<double>(r.states) / r.seconds : 0.0;
  if (rate < 4.0 / s.state_timeout) {
    say(
        fmt::format("joint states have {:.0f} Hz; {:.0f} would tolerate a lost one: raise the controller "
                    "manager's update_rate, or ros2.state_timeout",
                    rate, 4.0 / s.state_timeout));
  }
  return j;
}

Result<Ros2LinkReport> measure_ros2_link(const RobotModel& model, const Ros2Settings& s, double seconds,
                                         const std::function<bool()>& ends) {
  auto names = ros2_joint_names(model, s);
  if (!names) return names.error();
  const Result<int> domain = ros2_domain(s.domain);
  if (!domain) return domain.error();
  MonotonicClock clock;
  Ros2LinkMeter meter;
  std::mutex mutex;  // guards the meter; waiting for it is not measured
  JointOrder joints(*std::move(names));
  auto node = Ros2Node::open(*domain, true);
  if (!node) return node.error();
  const std::string topic = s.controller + "/joint_trajectory";
  const auto trajectories = (*node)->publish<JointTrajectoryMessage>(topic);  // to see who listens; never sends
  if (!trajectories) return trajectories.error();
  Status listens = (*node)->listen<JointStateMessage>(
      s.joint_states, [&](const JointStateMessage& message, Ros2PublisherId publisher) {
        const Time arrival = clock.now();
        JointVector q, dq;
        const JointStateFault fault = read_joint_state(message, joints, q, dq);
        const std::lock_guard lock(mutex);
        if (fault == JointStateFault::kOtherJoints) return meter.stranger();
        if (fault == JointStateFault::kCounts || fault == JointStateFault::kNotFinite) return meter.unusable(fault);
        meter.measured(q);
        meter.state(arrival, fault == JointStateFault::kNoStamp ? Time(0) : time_of(message.header.stamp), publisher);
      });
  if (!listens) return listens.error();
  listens = (*node)->listen<JointTrajectoryMessage>(topic, [&](const JointTrajectoryMessage&, Ros2PublisherId) {
    const std::lock_guard lock(mutex);
    meter.commanded();
  });
  if (!listens) return listens.error();
  listens = (*node)->listen<ControllerStateMessage>(s.controller + "/controller_state",
                                                    [&](const ControllerStateMessage&, Ros2PublisherId) {
                                                      const std::lock_guard lock(mutex);
                                                      meter.active();
                                                    });
  if (!listens) return listens.error();
  if (!s.speed_scaling.empty()) {
    listens = (*node)->listen<Float64Message>(s.speed_scaling, [&](const Float64Message& message, Ros2PublisherId) {
      const std::lock_guard lock(mutex);
      meter.slowed_down(message.data);
    });
    if (!listens) return listens.error();
  }
  std::optional<Ros2Subscription> grippers;
  if (model.tool().gripper_time && !s.gripper.action.empty()) {
    const auto heard = (*node)->subscribe<GoalStatusArrayMessage>(
        {s.gripper.action + "/_action/status", Ros2Topic::Kind::kTopic, true},
        [](const GoalStatusArrayMessage&, Ros2PublisherId) {});
    if (!heard) return heard.error();
    grippers = *heard;
  }
  int controllers = 0;
  std::thread([&] {
    prefer_this_thread();
    const Time end = clock.now() + from_seconds(seconds), period = std::chrono::milliseconds(10);
    for (Time next = clock.now() + period; next < end && !ends(); next = std::max(next + period, clock.now())) {
      clock.sleep_until(next);
      const Time late = clock.now() - next;
      const std::lock_guard lock(mutex);
      meter.woke(late);
    }
    controllers = trajectories->subscribers();
  }).join();
  std::optional<int> servers;
  if (grippers) servers = static_cast<int>(grippers->publishers().size());
  node->reset();  // its threads use what is made here
  Ros2LinkReport report = meter.report(controllers);
  report.grippers = servers;
  return report;
}

}  // namespace steadyhand

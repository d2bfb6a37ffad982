#include "steadyhand/ros2/ros2_link_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "steadyhand/core/clock.hpp"
#include "steadyhand/ros2/joint_order.hpp"
#include "steadyhand/ros2/stamps.hpp"

namespace steadyhand {

void Ros2LinkMeter::state(Time arrival, Time stamp, Ros2PublisherId publisher) {
  publishers_.insert(publisher);
  report_.stamped = report_.stamped && stamp > Time(0);
  if (report_.states++ == 0) {
    first_ = arrival;
  } else {
    report_.longest_gap = std::max(report_.longest_gap, 1e-3 * static_cast<double>((arrival - last_).count()));
  }
  last_ = arrival;
  if (stamp <= last_stamp_) return;
  last_stamp_ = stamp;
  const Time due = earliest_.update(stamp, arrival, true);
  late_.add(1e-3 * static_cast<double>((arrival - due).count()));
}

Ros2LinkReport Ros2LinkMeter::report(int controllers) const {
  Ros2LinkReport report = report_;
  report.seconds = to_seconds(last_ - first_);
  report.publishers = publishers_.size();
  report.late = late_.summary();
  report.wake = wake_.summary();
  report.controllers = controllers;
  return report;
}

Ros2LinkJudgement judge(const Ros2LinkReport& r, const Ros2Settings& s) {
  Ros2LinkJudgement j;
  const auto say = [&](std::string line) { j.findings.push_back(std::move(line)); };
  const double silence = 1e6 * s.state_timeout;
  if (r.states == 0) {
    say(
        fmt::format("no joint states that name this arm's joints come from {}, {} that do not: is the driver running, "
                    "in this domain, with these names (ros2.joint_states, ros2.prefix, ros2.joints)?",
                    s.joint_states, r.strangers));
    return j;
  }
  if (r.publishers > 1) {
    say(fmt::format("{} publishers send states of this arm's joints to {}: end all but one", r.publishers,
                    s.joint_states));
  }
  if (!r.stamped) say("joint states carry no stamps: trajectories cannot be timed");
  if (r.controllers == 0) {
    say(fmt::format("no controller listens to {}/joint_trajectory: activate one, or set ros2.controller",
                    s.controller));
  } else if (!r.active) {
    say(
        fmt::format("{} listens, but is not active (nothing comes from {}/controller_state): ros2 control "
                    "switch_controllers --activate {}",
                    s.controller, s.controller, s.controller.substr(s.controller.rfind('/') + 1)));
  }
  if (r.speed_scaling < 99.9) {
    say(
        fmt::format("{} tells of {:.4g} %; below 100 nothing moves: set the arm's speed slider to 100 %, and start its "
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
    say(fmt::format("somebody else sent {} trajectories to {}: end that program", r.commanders, s.controller));
  }
  j.fit = j.findings.empty() && r.longest_gap < silence && r.late.max < silence;
  if (r.longest_gap >= 0.5 * silence || r.late.max >= 0.5 * silence) {
    say(
        fmt::format("joint states stayed away for up to {:.1f} ms, came up to {:.1f} ms late; {:.0f} ms stop the arm "
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
        fmt::format("joint states come at {:.0f} Hz; {:.0f} would leave room for a lost one: raise the controller "
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
  std::mutex mutex;  // of the meter; what it holds up is not measured
  JointOrder joints(*std::move(names));
  auto node = Ros2Node::open(*domain, true);
  if (!node) return node.error();
  const std::string topic = s.controller + "/joint_trajectory";
  const auto trajectories = (*node)->publish<JointTrajectoryMessage>(topic);  // to see who listens; never sends
  if (!trajectories) return trajectories.error();
  Status listens = (*node)->listen<JointStateMessage>(
      s.joint_states, [&](const JointStateMessage& message, Ros2PublisherId publisher) {
        const Time arrival = clock.now();
        const std::uint32_t count = message.name._length;
        const bool ours = joints.find({message.name._buffer, count}) && message.position._length == count;
        const std::lock_guard lock(mutex);
        if (!ours) return meter.stranger();
        const auto& stamp = message.header.stamp;
        meter.state(arrival, is_time(stamp) ? time_of(stamp) : Time(0), publisher);
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
  if (model.gripper_time && !s.gripper.action.empty()) {
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

#include "app/commissioning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <vector>

#include "plan/straight_stop.hpp"
#include "robot/kinematics.hpp"

namespace steadyhand {

namespace {

constexpr double kStartWithin = 20.0;  // s
constexpr double kLongestDelay = 0.3;  // s
constexpr double kApart = 0.01;        // m, between spheres, at least

/// q0 + way / 2 (1 - cos w t), to and fro in whole periods, and rest.
struct Swing {
  JointVector q0, way;
  double w = 0.0, end = 0.0;

  Swing(Stage stage, const RobotModel& model, const JointVector& from, double seconds) : q0(from), way(from.size()) {
    const StageMotion m = motion_of(stage);
    way.setZero();
    if (m.way == 0.0) return;
    const JointVector middle = 0.5 * (model.position_min + model.position_max);
    for (int i = 0; i < way.size(); ++i) way[i] = from[i] > middle[i] ? -m.way : m.way;
    w = std::min(2.0 * m.share * model.velocity_max.minCoeff() / m.way,
                 std::sqrt(2.0 * m.share * model.acceleration_max.minCoeff() / m.way));
    const double period = 2.0 * M_PI / w;
    end = period * std::max(1.0, std::round(seconds / period));
  }
  JointVector q(double t) const { return q0 + 0.5 * (1.0 - std::cos(w * inside(t))) * way; }
  JointVector dq(double t) const { return (t < end ? 0.5 * w * std::sin(w * inside(t)) : 0.0) * way; }
  JointVector ddq(double t) const { return (t < end ? 0.5 * w * w * std::cos(w * inside(t)) : 0.0) * way; }
  double inside(double t) const { return std::clamp(t, 0.0, end); }
};

struct Sample {
  double t;
  JointVector q;
};

double misfit(const Swing& swing, const std::vector<Sample>& samples, double delay) {
  double sum = 0.0;
  for (const Sample& s : samples) sum += (s.q - swing.q(s.t - delay)).squaredNorm();
  return sum;
}

}  // namespace

StageMotion motion_of(Stage stage) {
  switch (stage) {
    case Stage::kSlow:
      return {0.1, 0.05};
    case Stage::kEmpty:
      return {0.2, 0.25};
    case Stage::kGlass:
      return {0.2, 0.1};
    default:
      return {};
  }
}

Status check_stage(Stage stage, const RobotModel& model, const JointVector& q) {
  const Swing swing(stage, model, q, 0.0);
  Kinematics kinematics(model);
  for (int i = 0; i <= 20; ++i) {
    const JointVector at = swing.q0 + 0.05 * i * swing.way;
    for (int k = 0; k < at.size(); ++k) {
      if (at[k] >= model.position_min[k] && at[k] <= model.position_max[k]) continue;
      return Error{fmt::format("joint {} would go to {:.2f} rad, beyond its limit: move the arm away at the pendant",
                               model.joints[k].name, at[k])};
    }
    kinematics.set_position(at);
    if (const double gap = kinematics.clearance(); gap < kApart) {
      return Error{fmt::format("the arm would come within {:.0f} mm of itself: move it into the open at the pendant",
                               1e3 * gap)};
    }
  }
  return Done{};
}

StageReport run_stage(Stage stage, Arm& arm, const RobotModel& model, double seconds, const StopSignals& signals) {
  StageReport report;
  const double period = 1.0 / arm.info().rate_hz;
  ArmState state = arm.receive();
  const Time asked = state.joints.stamp.made;
  while (state.status == ArmStatus::kStarting && to_seconds(state.joints.stamp.made - asked) < kStartWithin) {
    state = arm.receive();
  }
  if (state.status != ArmStatus::kFollowing) {
    report.stopped = state.status == ArmStatus::kStopped ? std::string(state.reason) : "it does not begin to follow";
    return report;
  }
  const Swing swing(stage, model, state.joints.q, seconds);
  const double duration = std::max(seconds, swing.end) + 0.5;
  const Time begin = state.joints.stamp.made;
  std::vector<Sample> samples;
  samples.reserve(static_cast<std::size_t>(2.0 * duration / period));
  Plan plan;
  double last = 0.0;
  std::uint64_t last_cycle = state.cycle;
  for (int i = 0; state.status == ArmStatus::kFollowing; ++i) {
    const Time now = state.joints.stamp.made;
    const double t = to_seconds(now - begin);
    if (t > duration || (i % 64 == 63 && signals.arrived_within(Time(0)))) break;
    const JointCommand command{{now, now}, swing.q(t), swing.dq(t), swing.ddq(t)};
    make_straight_stop(model, command, 0.0, plan);
    arm.follow(plan);
    arm.send(command);
    if (samples.size() < samples.capacity()) samples.push_back({t, state.joints.q});
    state = arm.receive();
    const double passed = to_seconds(state.joints.stamp.made - begin) - last;
    report.jitter = std::max(report.jitter, std::abs(passed - period * std::round(passed / period)));
    last += passed;
    report.cycles += state.cycle - last_cycle;
    report.late += state.cycle - last_cycle - 1;
    last_cycle = state.cycle;
  }
  if (state.status == ArmStatus::kStopped) report.stopped = std::string(state.reason);
  report.seconds = last;
  if (swing.w > 0.0 && samples.size() > 100) {
    double best = misfit(swing, samples, 0.0);
    for (double delay = 0.001; delay < kLongestDelay; delay += 0.001) {
      const double here = misfit(swing, samples, delay);
      if (here >= best) continue;
      best = here;
      report.delay = delay;
    }
  }
  for (const Sample& s : samples) {
    report.stray = std::max(report.stray, (s.q - swing.q(s.t - report.delay)).cwiseAbs().maxCoeff());
  }
  return report;
}

Status write_setting(const std::filesystem::path& file, const std::string& key, const std::string& value) {
  const std::size_t dot = key.find('.');
  const std::string section = key.substr(0, dot) + ":", name = "  " + key.substr(dot + 1) + ":";
  std::vector<std::string> lines;
  if (std::ifstream in(file); in) {
    for (std::string line; std::getline(in, line);) lines.push_back(line);
  }
  const auto begins = [](const std::string& line, const std::string& with) { return line.rfind(with, 0) == 0; };
  auto at = std::find_if(lines.begin(), lines.end(), [&](const std::string& line) { return begins(line, section); });
  if (at == lines.end()) at = lines.insert(at, section);
  for (++at; at != lines.end() && !begins(*at, name) && (at->empty() || (*at)[0] == ' ' || (*at)[0] == '#');) ++at;
  const std::string line = name + " " + value + "  # measured by steadyhand check";
  if (at != lines.end() && begins(*at, name)) {
    *at = line;
  } else {
    lines.insert(at, line);
  }
  std::ostringstream text;
  for (const std::string& each : lines) text << each << "\n";
  std::ofstream out(file);
  if (!(out << text.str() << std::flush)) return Error{fmt::format("{} cannot be written", file.string())};
  return Done{};
}

}  // namespace steadyhand

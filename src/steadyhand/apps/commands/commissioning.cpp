#include "steadyhand/apps/commands/commissioning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <vector>

#include "steadyhand/geometry/robot/gaps.hpp"
#include "steadyhand/operator/console/settings.hpp"
#include "steadyhand/planning/plan/straight_stop.hpp"
#include "steadyhand/planning/plan/tracker.hpp"

namespace steadyhand {

namespace fs = std::filesystem;

namespace {

constexpr double kStartWithin = 20.0;  // s
constexpr double kLongestDelay = 0.3;  // s
constexpr double kApart = 0.01;        // m, between bodies, at least
constexpr double kRest = 0.5;          // s, for which an arm at rest is still sent where it is

/// q0 + way / 2 (1 - cos w t), back and forth in whole periods, then rest.
struct Swing {
  JointVector q0, way;
  double w = 0.0, end = 0.0;

  Swing(Stage stage, const RobotModel& model, const JointVector& from, double seconds) : q0(from), way(from.size()) {
    const StageMotion m = motion_of(stage);
    way.setZero();
    if (m.way == 0.0) return;
    const JointVector middle = 0.5 * (model.position_min + model.position_max);
    for (int i = 0; i < way.size(); ++i) way[i] = from[i] > middle[i] ? -m.way : m.way;
    w = std::min(2.0 * m.speed_scaling * model.velocity_max.minCoeff() / m.way,
                 std::sqrt(2.0 * m.speed_scaling * model.acceleration_max.minCoeff() / m.way));
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
    if (const double gap = clearance(kinematics); gap < kApart) {
      return Error{fmt::format(
          "the distance between the arm's bodies would be {:.0f} mm: move the arm into free space with the pendant",
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
    report.stopped = state.status == ArmStatus::kStopped ? std::string(state.reason) : "it does not start to follow";
    return report;
  }
  const Swing swing(stage, model, state.joints.q, seconds);
  const double duration = std::max(seconds, swing.end) + kRest;
  const double speed_scaling = std::max(motion_of(stage).speed_scaling, 1e-3);
  const Time begin = state.joints.stamp.made;
  std::vector<Sample> samples;
  samples.reserve(static_cast<std::size_t>(2.0 * duration / period));
  Plan plan;
  double last = 0.0;
  std::uint64_t last_cycle = state.cycle;
  JointCommand command{state.joints.stamp, swing.q(0.0), swing.dq(0.0), swing.ddq(0.0)};
  bool interrupted = false;
  while (state.status == ArmStatus::kFollowing) {
    const Time now = state.joints.stamp.made;
    const double t = to_seconds(now - begin);
    if (!interrupted && signals.arrived_within(Time(0))) {
      interrupted = true;
      report.stopped = fmt::format("interrupted after {:.1f} s", t);
      make_straight_stop(model, command, stop_time(model, command.dq) / speed_scaling, plan);
      arm.follow(plan);
    }
    if (interrupted ? now > plan.start + from_seconds(plan.intervals * plan.dt + kRest) : t > duration) break;
    if (interrupted) {
      command = sample(plan, now);
    } else {
      command = {{now, now}, swing.q(t), swing.dq(t), swing.ddq(t)};
      make_straight_stop(model, command, 0.0, plan);
      arm.follow(plan);
      samples.push_back({t, state.joints.q});
    }
    arm.send(command);
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

namespace {

/// The settings file's text with the line for `key` in it.
std::string with_setting(std::istream& in, const std::string& section, const std::string& name,
                         const std::string& value) {
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  const auto begins = [](const std::string& line, const std::string& with) { return line.rfind(with, 0) == 0; };
  auto first = std::find_if(lines.begin(), lines.end(), [&](const auto& line) { return begins(line, section + ":"); });
  if (first == lines.end()) first = lines.insert(first, section + ":");
  ++first;
  const auto is_inside = [](const std::string& line) { return line.empty() || line[0] == ' ' || line[0] == '#'; };
  const auto is_key = [](const std::string& line) {
    const std::size_t text = line.find_first_not_of(' ');
    return text != std::string::npos && line[text] != '#';
  };
  const auto end = std::find_if_not(first, lines.end(), is_inside);
  const auto sibling = std::find_if(first, end, is_key);
  const std::string indentation = sibling == end ? "  " : sibling->substr(0, sibling->find_first_not_of(' '));
  const std::string line = indentation + name + ": " + value + "  # measured by steadyhand check";
  const auto own = std::find_if(first, end, [&](const auto& each) { return begins(each, indentation + name + ":"); });
  if (own != end) {
    *own = line;
  } else {
    lines.insert(first, line);
  }
  std::ostringstream text;
  for (const std::string& each : lines) text << each << "\n";
  return text.str();
}

/// Whether the program reads this value from that file.
bool reads_back(const fs::path& file, const std::string& key, const std::string& value) {
  SessionSettings settings;
  SettingsTable table = describe(settings);
  return table.load(file) && std::stod(table.values().at(key)) == std::stod(value);
}

}  // namespace

Status write_setting(const fs::path& file, const std::string& key, const std::string& value) {
  const std::size_t dot = key.find('.');
  const std::string section = key.substr(0, dot), name = key.substr(dot + 1);
  std::error_code failed;
  const bool exists = fs::exists(file, failed);
  const fs::path target = exists ? fs::canonical(file, failed) : file;  // through links
  fs::path next = target;
  next += ".new";
  {
    std::ifstream in(target);
    std::ofstream out(next);
    out << with_setting(in, section, name, value) << std::flush;
    if (!out) failed = std::make_error_code(std::errc::io_error);
  }
  std::string why = failed                         ? "it cannot be written"
                    : reads_back(next, key, value) ? ""
                                                   : "its form is beyond this program";
  if (why.empty()) {
    if (exists) fs::permissions(next, fs::status(target, failed).permissions(), failed);
    fs::rename(next, target, failed);
    if (!failed) return Done{};
    why = failed.message();
  }
  fs::remove(next, failed);
  return Error{
      fmt::format("{} is left as it was: {}; put {}: {} under {} yourself", file.string(), why, name, value, section)};
}

}  // namespace steadyhand

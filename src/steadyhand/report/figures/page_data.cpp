#include "steadyhand/report/figures/page_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

#include "steadyhand/core/json_writer.hpp"
#include "steadyhand/report/figures/session_story.hpp"
#include "steadyhand/report/figures/table.hpp"

namespace steadyhand {
namespace {

constexpr int kMaxStepPoints = 4000, kMaxCommandPoints = 3000, kMaxTailPoints = 400;

/// Which of the values that share a point is drawn: the extreme where the page must show the worst case.
/// kBroken keeps the first value, or NaN if the curve breaks among them. NaN is never the extreme.
enum class Keep { kFirst, kBroken, kSmallest, kLargest };

/// value(i) for i = 0..count-1, `per_point` of them to a number.
template <typename Value>
void write_curve(JsonWriter& json, std::size_t count, std::size_t per_point, Keep keep, Value&& value) {
  json.begin_array();
  for (std::size_t point = 0; point < (count + per_point - 1) / per_point; ++point) {
    double kept = value(point * per_point);
    for (std::size_t i = point * per_point + 1; keep != Keep::kFirst && i < std::min(count, (point + 1) * per_point);
         ++i) {
      const double next = value(i);
      if (keep == Keep::kBroken) {
        if (std::isnan(next)) kept = next;
      } else if (!std::isnan(next)) {
        kept = std::isnan(kept) ? next : keep == Keep::kSmallest ? std::min(kept, next) : std::max(kept, next);
      }
    }
    json.value(kept);
  }
  json.end_array();
}

constexpr double kJump = 90.0;  ///< degrees; a larger step of an angle between two plans is not a motion

/// An angle in degrees, -180 to 180. NaN breaks the curve where the angle wraps around, or where roll and yaw flip at a
/// pitch of 90 degrees. `pose` is a member of ToolStep. (Counting full turns instead would separate plan and target for
/// good if they pass a pitch of 90 degrees on different sides, since roll flips by half a turn there.)
std::vector<double> broken(const std::vector<PlanStep>& steps, int tool, Pose ToolStep::*pose,
                           double (*of)(const Quaternion&)) {
  std::vector<double> angles;
  double last = 0;
  for (const PlanStep& step : steps) {
    const double angle = kDegrees * of((step.tools[tool].*pose).q);
    const bool jumps = !angles.empty() && std::abs(angle - last) > kJump;
    angles.push_back(jumps ? std::numeric_limits<double>::quiet_NaN() : angle);
    last = angle;
  }
  return angles;
}

/// Position, m, and orientation, degrees, of the glass, by axis.
void write_pose(JsonWriter& json, const std::vector<PlanStep>& steps, int tool, Pose ToolStep::*pose,
                std::size_t per_point) {
  for (const auto& [name, axis] : {std::pair("x", 0), {"y", 1}, {"z", 2}}) {
    json.key(name);
    write_curve(json, steps.size(), per_point, Keep::kFirst,
                [&](std::size_t i) { return (steps[i].tools[tool].*pose).p[axis]; });
  }
  for (const auto& [name, of] : {std::pair("roll", &roll_angle), {"pitch", &pitch_angle}, {"yaw", &yaw_angle}}) {
    const std::vector<double> angles = broken(steps, tool, pose, of);
    json.key(name);
    write_curve(json, steps.size(), per_point, Keep::kBroken, [&](std::size_t i) { return angles[i]; });
  }
}

bool same_targets(const ProfileResult& a, const ProfileResult& b, int tool) {
  return std::equal(a.steps.begin(), a.steps.end(), b.steps.begin(), b.steps.end(),
                    [tool](const PlanStep& x, const PlanStep& y) {
                      const Pose &here = x.tools[tool].X_base_target, &there = y.tools[tool].X_base_target;
                      return x.t_s == y.t_s && here.p.isApprox(there.p, 1e-9) && here.q.angularDistance(there.q) < 1e-6;
                    });
}

void write_target(JsonWriter& json, const ProfileResult& profile, int tool, const std::string& label,
                  std::size_t per_point) {
  const std::vector<PlanStep>& steps = profile.steps;
  json.begin_object();
  json.member("label", label);
  json.key("t");
  write_curve(json, steps.size(), per_point, Keep::kFirst, [&](std::size_t i) { return steps[i].t_s; });
  write_pose(json, steps, tool, &ToolStep::X_base_target, per_point);
  json.end_object();
}

/// The figures on a profile's card next to its curves, in the units of Metrics.
void write_metrics(JsonWriter& json, const Metrics& metrics, int t) {
  const ToolMetrics& m = metrics.tools[t];
  json.key("metrics");
  json.begin_object();
  json.member("spills", m.spills);
  json.member("spilled_share", m.spilled_share);
  json.member("spills_per_minute", m.spills_per_minute);
  json.member("lateral_mean", m.lateral_mean);
  json.member("lateral_max", m.lateral_max);
  json.member("position_mean", m.position_mean);
  json.member("position_rms", m.position_rms);
  if (t == 0) json.member("solve_mean", metrics.solve_mean);
  json.end_object();
}

/// The curves of one tool.
void write_tool(JsonWriter& json, const std::vector<PlanStep>& steps, int t, std::size_t per_point) {
  const auto curve = [&](std::string_view name, Keep keep, auto&& value) {
    json.key(name);
    write_curve(json, steps.size(), per_point, keep, [&](std::size_t i) { return value(steps[i].tools[t]); });
  };
  write_pose(json, steps, t, &ToolStep::X_base_planned, per_point);
  curve("lateral", Keep::kLargest, lateral_acceleration);
  curve("vertical", Keep::kSmallest, [](const ToolStep& tool) { return tool.local_acceleration.z(); });
  // Without engagement there is no tracking error; the figures exclude these steps too.
  const auto while_engaged = [](const ToolStep& tool, double value) {
    return tool.engaged ? value : std::numeric_limits<double>::quiet_NaN();
  };
  curve("position_error", Keep::kLargest,
        [&](const ToolStep& tool) { return while_engaged(tool, 1e3 * position_error(tool)); });
  curve("orientation_error", Keep::kLargest,
        [&](const ToolStep& tool) { return while_engaged(tool, kDegrees * orientation_error(tool)); });
}

/// Members of the first tool in place; those of others, with its metrics, in `other_tools`.
void write_steps(JsonWriter& json, const ProfileResult& profile, const Metrics& metrics, std::size_t per_point) {
  const std::vector<PlanStep>& steps = profile.steps;
  const auto curve = [&](std::string_view name, Keep keep, auto&& value) {
    json.key(name);
    write_curve(json, steps.size(), per_point, keep, value);
  };
  curve("t", Keep::kFirst, [&](std::size_t i) { return steps[i].t_s; });
  write_tool(json, steps, 0, per_point);
  if (metrics.tool_count > 1) {
    json.key("other_tools");
    json.begin_array();
    for (int t = 1; t < metrics.tool_count; ++t) {
      json.begin_object();
      json.member("name", profile.names.tools[t]);
      write_metrics(json, metrics, t);
      write_tool(json, steps, t, per_point);
      json.end_object();
    }
    json.end_array();
    curve("distance_between_arms", Keep::kSmallest,
          [&](std::size_t i) { return 1e3 * steps[i].distance_between_arms_m; });
  }
  curve("solve_time", Keep::kLargest, [&](std::size_t i) { return 1e-3 * steps[i].solve_time_us; });
  curve("iterations", Keep::kLargest, [&](std::size_t i) { return steps[i].iterations; });
  curve("distance", Keep::kSmallest, [&](std::size_t i) { return 1e3 * steps[i].smallest_sphere_distance_m; });

  std::vector<std::string> objects;  // that were there at any time
  for (const PlanStep& step : steps) {
    for (const auto& [name, distance] : step.object_distances) {
      if (std::find(objects.begin(), objects.end(), name) == objects.end()) objects.push_back(name);
    }
  }
  json.member("objects", objects);
  json.key("object_distances");
  json.begin_array();
  for (const std::string& object : objects) {
    write_curve(json, steps.size(), per_point, Keep::kSmallest, [&](std::size_t i) {
      for (const auto& [name, distance] : steps[i].object_distances) {
        if (name == object) return 1e3 * distance;
      }
      return std::numeric_limits<double>::quiet_NaN();
    });
  }
  json.end_array();

  std::vector<double> failures;
  for (const PlanStep& step : steps) {
    if (step.status != PlanOrigin::kSolved) failures.push_back(step.t_s);
  }
  json.member("failures", failures);

  std::vector<std::string> terms;
  std::ranges::transform(profile.names.terms, std::back_inserter(terms), term_text);
  json.member("terms", terms);
  json.member("term_names", profile.names.terms);
  json.key("shares");
  json.begin_array();
  for (std::size_t term = 0; term < profile.names.terms.size(); ++term) {
    write_curve(json, steps.size(), per_point, Keep::kFirst, [&](std::size_t i) { return steps[i].shares[term]; });
  }
  json.end_array();
}

/// Solve times in ascending order, each with the percentage of steps that took at least as long. All of the slowest are
/// included.
void write_tail(JsonWriter& json, const std::vector<PlanStep>& steps) {
  std::vector<double> times;
  for (const PlanStep& step : steps) times.push_back(1e-3 * step.solve_time_us);
  std::sort(times.begin(), times.end());
  const std::size_t stride = times.size() / kMaxTailPoints + 1;
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < times.size(); i += times.size() - i > 100 + stride ? stride : 1) shown.push_back(i);

  json.key("tail");
  json.begin_object();
  json.key("ms");
  write_curve(json, shown.size(), 1, Keep::kFirst, [&](std::size_t i) { return times[shown[i]]; });
  json.key("percent");
  write_curve(json, shown.size(), 1, Keep::kFirst, [&](std::size_t i) {
    return 100.0 * static_cast<double>(times.size() - shown[i]) / static_cast<double>(times.size());
  });
  json.end_object();
}

/// Speed of each joint in percent of its limit; from the steps if there are no commands.
void write_speeds(JsonWriter& json, const ProfileResult& profile, const Thinning& thinning) {
  const bool from_commands = !profile.commands.empty();
  const std::size_t count = from_commands ? profile.commands.size() : profile.steps.size();
  const std::size_t per_point = from_commands ? thinning.commands_per_point : thinning.steps_per_point;
  const auto speed = [&](std::size_t i, Eigen::Index joint) {
    return from_commands ? profile.commands[i].dq[joint] : profile.steps[i].dq[joint];
  };

  json.member("joints", part_texts(profile.names.joints));
  json.member("joint_names", profile.names.joints);
  json.key("speeds");
  json.begin_object();
  json.key("t");
  write_curve(json, count, per_point, Keep::kFirst, [&](std::size_t i) {
    return from_commands ? to_seconds(profile.commands[i].stamp.made) : profile.steps[i].t_s;
  });
  json.key("percent");
  json.begin_array();
  for (Eigen::Index joint = 0; joint < profile.limits.velocity_max.size(); ++joint) {
    write_curve(json, count, per_point, Keep::kLargest,
                [&](std::size_t i) { return 100 * std::abs(speed(i, joint)) / profile.limits.velocity_max[joint]; });
  }
  json.end_array();
  json.end_object();
}

void write_weights(JsonWriter& json, const Weights& weights) {
  json.key("weights");
  json.begin_array();
  for (const auto& [name, values] : weights) {
    if (values.empty()) continue;
    json.begin_object();
    json.member("name", name);
    json.member("text", weight_text(values));
    json.end_object();
  }
  json.end_array();
}

/// Index of the best profile in this row; -1 if the row is not ranked, there is only one profile, or the values as
/// shown are equal. Profiles with few steps are excluded.
int best_profile(const MetricRow& row, const std::vector<Metrics>& metrics) {
  constexpr int kMoment = 5;  // a profile needs the steps of the longest one divided by this
  int longest = 0;
  for (const Metrics& m : metrics) longest = std::max(longest, m.steps);
  const auto counts = [longest](const Metrics& m) { return kMoment * m.steps >= longest; };
  if (row.best == MetricRow::Best::kNone || std::count_if(metrics.begin(), metrics.end(), counts) < 2) return -1;
  const double sign = row.best == MetricRow::Best::kLowest ? 1 : -1;
  const auto better = [&](const Metrics& a, const Metrics& b) {
    return counts(a) == counts(b) ? sign * row.value(a) < sign * row.value(b) : counts(a);
  };
  const auto best = std::min_element(metrics.begin(), metrics.end(), better);
  const auto ties = std::count_if(metrics.begin(), metrics.end(),
                                  [&](const Metrics& m) { return format_value(row, m) == format_value(row, *best); });
  return ties > 1 ? -1 : static_cast<int>(best - metrics.begin());
}

/// The comparison: a row for each metric that is known, with a text for each profile.
void write_figures(JsonWriter& json, const std::vector<std::string>& tools, const std::vector<Metrics>& metrics) {
  json.key("figures");
  json.begin_array();
  for (const MetricRow& row : metric_rows(tools)) {
    if (!is_known(row, metrics)) continue;
    json.begin_object();
    json.member("group", row.group);
    json.member("label", row.label);
    json.member("unit", row.unit);
    json.member("meaning", row.meaning);
    json.member("best", best_profile(row, metrics));
    json.key("texts");
    json.begin_array();
    for (const Metrics& m : metrics) json.value(format_value(row, m));
    json.end_array();
    json.end_object();
  }
  json.end_array();
}

void write_session(JsonWriter& json, const ReportInput& input) {
  const SessionStory& story = *input.story;
  json.begin_object();
  json.key("zero_s");  // more than six digits: the clock may have run for days
  json.raw(fmt::format("{:.4f}", input.begin_s));
  json.member("begin", story.begin_s);
  json.member("end", story.end_s);
  json.member("led_s", story.led_s);
  json.member("has_glass", story.has_glass);
  json.member("knows_liquid", story.knows_liquid);
  const auto curve = [&](std::string_view name, double SessionStory::Latency::*value) {
    json.key(name);
    json.begin_array();
    for (const SessionStory::Latency& each : story.latency) json.value(each.*value);
    json.end_array();
  };
  json.key("latency");
  json.begin_object();
  curve("t", &SessionStory::Latency::t_s);
  curve("p50", &SessionStory::Latency::p50_ms);
  curve("p99", &SessionStory::Latency::p99_ms);
  json.end_object();
  json.member("robot", story.robot);
  json.key("motion");
  json.raw(input.motion.empty() ? "null" : input.motion);
  json.end_object();
}

}  // namespace

Thinning choose_thinning(const ReportInput& input) {
  std::size_t steps = 1, commands = 1;
  for (const ProfileResult& profile : input.profiles) {
    steps = std::max(steps, profile.steps.size());
    commands = std::max(commands, profile.commands.size());
  }
  return {static_cast<int>((steps - 1) / kMaxStepPoints + 1), static_cast<int>((commands - 1) / kMaxCommandPoints + 1)};
}

std::string page_data(const ReportInput& input, const Thinning& thinning) {
  JsonBuffer out;
  /// Six digits: a millisecond in a quarter of an hour, and more than a curve can show.
  JsonWriter json(out, JsonWriter::Digits::kSix);
  std::vector<Metrics> metrics;
  for (const ProfileResult& profile : input.profiles) metrics.push_back(metrics_of(profile));
  json.begin_object();
  json.member("recording", input.recording);
  json.member("title", input.title);
  json.member("recorded", input.recorded);
  json.member("command", input.command);
  json.member("rate_hz", input.rate_hz);
  json.member("scales", input.scales.empty() ? fmt::format("{:g}", input.scale) : input.scales);
  json.member("steps_per_point", thinning.steps_per_point);
  json.member("commands_per_point", thinning.commands_per_point * input.profiles.front().commands_merged);
  const std::vector<std::string>& tools = input.profiles.front().names.tools;
  if (tools.size() > 1) json.member("tools", tools);
  write_figures(json, tools, metrics);
  json.key("targets");
  json.begin_array();
  for (int t = 0; t < metrics.front().tool_count; ++t) {
    const std::string target = metrics.front().tool_count > 1 ? "target, " + tools[t] : "target";
    write_target(json, input.profiles.front(), t, target, thinning.steps_per_point);
    // A new engagement starts at the arm's pose, so from then on the profiles may have different targets.
    for (std::size_t i = 1; i < input.profiles.size(); ++i) {
      if (same_targets(input.profiles.front(), input.profiles[i], t)) continue;
      write_target(json, input.profiles[i], t, target + " of " + input.profiles[i].label, thinning.steps_per_point);
    }
  }
  json.end_array();
  json.key("profiles");
  json.begin_array();
  for (std::size_t i = 0; i < input.profiles.size(); ++i) {
    const ProfileResult& profile = input.profiles[i];
    json.begin_object();
    json.member("name", profile.name);
    json.member("label", profile.label);
    write_weights(json, profile.weights);
    json.member("led_s", profile.led_s);
    write_metrics(json, metrics[i], 0);
    write_steps(json, profile, metrics[i], thinning.steps_per_point);
    write_tail(json, profile.steps);
    write_speeds(json, profile, thinning);
    json.end_object();
  }
  json.end_array();
  if (input.story) {
    json.key("session");
    write_session(json, input);
  }
  json.end_object();
  std::string embedded;  // in a <script>
  for (const char c : out) {
    if (c == '<') {
      embedded += "\\u003c";
    } else {
      embedded += c;
    }
  }
  return embedded;
}

}  // namespace steadyhand

#include "steadyhand/report/page_data.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "steadyhand/record/json_messages.hpp"

namespace steadyhand {
namespace {

constexpr int kMaxStepPoints = 4000, kMaxCommandPoints = 1000, kMaxTailPoints = 400;

/// What stands for the values that share a point: where the page must show the worst case it keeps the extreme.
enum class Keep { kFirst, kSmallest, kLargest };

/// A JSON object that is written member by member.
class JsonObject {
 public:
  explicit JsonObject(JsonBuffer& out) : out_(out) { out_.push_back('{'); }
  ~JsonObject() { out_.push_back('}'); }
  JsonObject(const JsonObject&) = delete;
  JsonObject& operator=(const JsonObject&) = delete;

  JsonBuffer& key(std::string_view name) {
    if (!std::exchange(first_, false)) out_.push_back(',');
    append_text(out_, name);
    out_.push_back(':');
    return out_;
  }

 private:
  JsonBuffer& out_;
  bool first_ = true;
};

template <typename Item>
void write_array(JsonBuffer& out, std::size_t count, Item&& item) {
  out.push_back('[');
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) out.push_back(',');
    item(i);
  }
  out.push_back(']');
}

/// Six figures: a millisecond in a quarter of an hour, and more than a curve shows.
void write_rounded(JsonBuffer& out, double value) {
  if (!std::isfinite(value)) return append_number(out, value);
  fmt::format_to(std::back_inserter(out), "{:.6g}", value);
}

void write_texts(JsonBuffer& out, const std::vector<std::string>& texts) {
  write_array(out, texts.size(), [&](std::size_t i) { append_text(out, texts[i]); });
}

/// value(i) for i = 0..count-1, `per_point` of them to a number.
template <typename Value>
void write_curve(JsonBuffer& out, std::size_t count, std::size_t per_point, Keep keep, Value&& value) {
  write_array(out, (count + per_point - 1) / per_point, [&](std::size_t point) {
    double kept = value(point * per_point);
    for (std::size_t i = point * per_point + 1; keep != Keep::kFirst && i < std::min(count, (point + 1) * per_point);
         ++i) {
      kept = keep == Keep::kSmallest ? std::min<double>(kept, value(i)) : std::max<double>(kept, value(i));
    }
    write_rounded(out, kept);
  });
}

/// Roll in degrees, -180 to 180; not a number, which breaks the curve, where it goes on at the other end of that range.
/// `pose` is a member of PlanStep. (Counting full turns instead would part plan and target for good wherever they pass
/// a pitch of 90 degrees on different sides, since roll turns by half a turn there.)
std::vector<double> broken_roll(const std::vector<PlanStep>& steps, Pose PlanStep::*pose) {
  std::vector<double> roll;
  double last = 0;
  for (const PlanStep& step : steps) {
    const double angle = kDegrees * roll_angle((step.*pose).q);
    const bool jumps = !roll.empty() && std::abs(angle - last) > 180;
    roll.push_back(jumps ? std::numeric_limits<double>::quiet_NaN() : angle);
    last = angle;
  }
  return roll;
}

bool same_targets(const ProfileResult& a, const ProfileResult& b) {
  return std::equal(a.steps.begin(), a.steps.end(), b.steps.begin(), b.steps.end(),
                    [](const PlanStep& x, const PlanStep& y) {
                      return x.t_s == y.t_s && x.X_base_target.p.isApprox(y.X_base_target.p, 1e-9) &&
                             x.X_base_target.q.angularDistance(y.X_base_target.q) < 1e-6;
                    });
}

void write_target(JsonBuffer& out, const ProfileResult& profile, const std::string& label, std::size_t per_point) {
  const std::vector<PlanStep>& steps = profile.steps;
  const std::vector<double> roll = broken_roll(steps, &PlanStep::X_base_target);
  JsonObject target(out);
  append_text(target.key("label"), label);
  const auto curve = [&](std::string_view name, auto&& value) {
    write_curve(target.key(name), steps.size(), per_point, Keep::kFirst, value);
  };
  curve("t", [&](std::size_t i) { return steps[i].t_s; });
  curve("y", [&](std::size_t i) { return steps[i].X_base_target.p.y(); });
  curve("roll", [&](std::size_t i) { return roll[i]; });
}

void write_steps(JsonObject& profile_object, const ProfileResult& profile, std::size_t per_point) {
  const std::vector<PlanStep>& steps = profile.steps;
  const std::vector<double> roll = broken_roll(steps, &PlanStep::X_base_planned);
  const auto curve = [&](std::string_view name, Keep keep, auto&& value) {
    write_curve(profile_object.key(name), steps.size(), per_point, keep, value);
  };
  curve("t", Keep::kFirst, [&](std::size_t i) { return steps[i].t_s; });
  curve("y", Keep::kFirst, [&](std::size_t i) { return steps[i].X_base_planned.p.y(); });
  curve("roll", Keep::kFirst, [&](std::size_t i) { return roll[i]; });
  curve("lateral", Keep::kLargest, [&](std::size_t i) { return lateral_acceleration(steps[i]); });
  curve("vertical", Keep::kSmallest, [&](std::size_t i) { return steps[i].local_acceleration.z(); });
  curve("position_error", Keep::kLargest, [&](std::size_t i) { return 1e3 * position_error(steps[i]); });
  curve("orientation_error", Keep::kLargest, [&](std::size_t i) { return kDegrees * orientation_error(steps[i]); });
  curve("solve_time", Keep::kLargest, [&](std::size_t i) { return 1e-3 * steps[i].solve_time_us; });
  curve("iterations", Keep::kLargest, [&](std::size_t i) { return steps[i].iterations; });
  curve("distance", Keep::kSmallest, [&](std::size_t i) { return 1e3 * steps[i].smallest_sphere_distance_m; });

  std::vector<double> failures;
  for (const PlanStep& step : steps) {
    if (step.status != PlanOrigin::kSolved) failures.push_back(step.t_s);
  }
  write_curve(profile_object.key("failures"), failures.size(), 1, Keep::kFirst,
              [&](std::size_t i) { return failures[i]; });

  write_texts(profile_object.key("terms"), profile.names.terms);
  JsonBuffer& shares = profile_object.key("shares");
  write_array(shares, profile.names.terms.size(), [&](std::size_t term) {
    write_curve(shares, steps.size(), per_point, Keep::kFirst, [&](std::size_t i) { return steps[i].shares[term]; });
  });
}

/// Solve times in rising order with the share of steps, in percent, that took at least as long. The slowest are all
/// there.
void write_tail(JsonObject& profile_object, const std::vector<PlanStep>& steps) {
  std::vector<double> times;
  for (const PlanStep& step : steps) times.push_back(1e-3 * step.solve_time_us);
  std::sort(times.begin(), times.end());
  const std::size_t stride = times.size() / kMaxTailPoints + 1;
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i<times.size(); i += times.size() - i> 100 + stride ? stride : 1) shown.push_back(i);

  JsonObject tail(profile_object.key("tail"));
  write_curve(tail.key("ms"), shown.size(), 1, Keep::kFirst, [&](std::size_t i) { return times[shown[i]]; });
  write_curve(tail.key("percent"), shown.size(), 1, Keep::kFirst, [&](std::size_t i) {
    return 100.0 * static_cast<double>(times.size() - shown[i]) / static_cast<double>(times.size());
  });
}

/// Every joint's speed in percent of its limit; from the steps if there are no commands.
void write_speeds(JsonObject& profile_object, const ProfileResult& profile, const Thinning& thinning) {
  const bool from_commands = !profile.commands.empty();
  const std::size_t count = from_commands ? profile.commands.size() : profile.steps.size();
  const std::size_t per_point = from_commands ? thinning.commands_per_point : thinning.steps_per_point;
  const auto speed = [&](std::size_t i, Eigen::Index joint) {
    return from_commands ? profile.commands[i].dq[joint] : profile.steps[i].dq[joint];
  };

  write_texts(profile_object.key("joints"), profile.names.joints);
  JsonObject speeds(profile_object.key("speeds"));
  write_curve(speeds.key("t"), count, per_point, Keep::kFirst, [&](std::size_t i) {
    return from_commands ? to_seconds(profile.commands[i].stamp.made) : profile.steps[i].t_s;
  });
  JsonBuffer& percent = speeds.key("percent");
  const Eigen::Index joints = profile.limits.velocity_max.size();
  write_array(percent, static_cast<std::size_t>(joints), [&](std::size_t joint) {
    const double limit = profile.limits.velocity_max[static_cast<Eigen::Index>(joint)];
    write_curve(percent, count, per_point, Keep::kLargest,
                [&](std::size_t i) { return 100 * std::abs(speed(i, static_cast<Eigen::Index>(joint))) / limit; });
  });
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
  {
    JsonObject root(out);
    append_number(root.key("period_ms"), 1e3 / input.rate_hz);

    JsonBuffer& targets = root.key("targets");
    targets.push_back('[');
    write_target(targets, input.profiles.front(), "target", thinning.steps_per_point);
    // A hand that re-engages is anchored at the arm, so from then on each profile may have a target of its own.
    for (std::size_t i = 1; i < input.profiles.size(); ++i) {
      if (same_targets(input.profiles.front(), input.profiles[i])) continue;
      targets.push_back(',');
      write_target(targets, input.profiles[i], "target of " + input.profiles[i].label, thinning.steps_per_point);
    }
    targets.push_back(']');

    JsonBuffer& profiles = root.key("profiles");
    write_array(profiles, input.profiles.size(), [&](std::size_t i) {
      const ProfileResult& profile = input.profiles[i];
      JsonObject object(profiles);
      append_text(object.key("label"), profile.label);
      write_steps(object, profile, thinning.steps_per_point);
      write_tail(object, profile.steps);
      write_speeds(object, profile, thinning);
    });
  }
  std::string json;
  for (const char c : fmt::to_string(out)) {
    if (c == '<') {
      json += "\\u003c";
    } else {
      json += c;
    }
  }
  return json;
}

}  // namespace steadyhand

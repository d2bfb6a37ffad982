#include "steadyhand/report/figures/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "steadyhand/report/figures/report.hpp"

namespace steadyhand {
namespace {

constexpr const char* kGlass = "Glass";
constexpr const char* kTracking = "Tracking";
constexpr const char* kSolver = "Solver";
constexpr const char* kLimits = "Limits";
using Best = MetricRow::Best;

const MetricRow kRows[] = {
    {kGlass, "Lateral specific force, mean", "m/s²", [](const Metrics& m, int t) { return m.tools[t].lateral_mean; }, 2,
     Best::kLowest,
     "Lateral specific force at the glass: √(a_x² + a_y²) in the frame of the glass, mean over all steps; in a live "
     "session as measured while engaged."},
    {kGlass, "Lateral specific force, p99", "m/s²", [](const Metrics& m, int t) { return m.tools[t].lateral_p99; }, 2,
     Best::kLowest, "99 % of the steps stay at or below it (nearest rank, as all percentiles here)."},
    {kGlass, "Lateral specific force, largest", "m/s²", [](const Metrics& m, int t) { return m.tools[t].lateral_max; },
     2, Best::kLowest, "The same at its worst."},
    {kGlass, "Vertical specific force, smallest", "m/s²",
     [](const Metrics& m, int t) { return m.tools[t].vertical_min; }, 2, Best::kHighest,
     "It keeps the liquid in the glass: 9.81 at rest, 0 in free fall."},
    {kGlass, "Spills", "", [](const Metrics& m, int t) { return m.tools[t].spills; }, 0, Best::kNone,
     "Number of spills; the glass is refilled between two spills."},
    {kGlass, "Spills per minute engaged", "", [](const Metrics& m, int t) { return m.tools[t].spills_per_minute; }, 2,
     Best::kLowest, "The same per minute engaged, so that profiles with different times can be compared."},
    {kGlass, "Spilled at once, most", "%", [](const Metrics& m, int t) { return 1e2 * m.tools[t].spilled_share; }, 1,
     Best::kLowest, "Share of the liquid that one of these spills lost, at most."},
    {kTracking, "Position error, RMS", "mm", [](const Metrics& m, int t) { return 1e3 * m.tools[t].position_rms; }, 1,
     Best::kLowest, "Planned against target position at the same time, root mean square over the engaged steps."},
    {kTracking, "Position error, largest", "mm", [](const Metrics& m, int t) { return 1e3 * m.tools[t].position_max; },
     1, Best::kLowest, "The same at its worst."},
    {kTracking, "Orientation error, RMS", "°",
     [](const Metrics& m, int t) { return kDegrees * m.tools[t].orientation_rms; }, 2, Best::kLowest,
     "Angle between planned and target orientation at the same time, over the engaged steps."},
    {kTracking, "Orientation error, largest", "°",
     [](const Metrics& m, int t) { return kDegrees * m.tools[t].orientation_max; }, 2, Best::kLowest,
     "The same at its worst."},
    {kLimits, "Distance between bodies, smallest", "mm",
     [](const Metrics& m, int) { return 1e3 * m.smallest_distance; }, 1, Best::kNone,
     "Between the surfaces of the arm's bodies, over all pairs and nodes; below 0 they overlap."},
    {kLimits, "Distance between arms, smallest", "mm",
     [](const Metrics& m, int) { return 1e3 * m.distance_between_arms; }, 1, Best::kNone,
     "Between the surfaces of bodies on different arms, over all pairs and nodes."},
    {kLimits, "Distance to objects, smallest", "mm", [](const Metrics& m, int) { return 1e3 * m.object_distance; }, 1,
     Best::kNone, "From obstacles, without margins, to the bodies that must not touch them, over all steps."},
    {kLimits, "Joint speed, largest of limit", "%", [](const Metrics& m, int) { return 1e2 * m.speed_ratio_max; }, 1,
     Best::kNone, "Over all joints, steps and commands; 100 % is the limit."},
    {kLimits, "Joint acceleration, largest of limit", "%",
     [](const Metrics& m, int) { return 1e2 * m.acceleration_ratio_max; }, 1, Best::kNone,
     "Over all joints, steps and commands; 100 % is the limit."},
    {kSolver, "Plans looked at", "", [](const Metrics& m, int) { return double(m.steps); }, 0, Best::kNone,
     "Planning steps that the figures are of: all of a run; of a live session those recorded, at most 60 a second."},
    {kSolver, "Failures", "", [](const Metrics& m, int) { return double(m.failures); }, 0, Best::kNone,
     "Steps whose solution did not converge; the arm then follows a feasible or the previous plan."},
    {kSolver, "Solve time, mean", "ms", [](const Metrics& m, int) { return 1e-3 * m.solve_mean; }, 3, Best::kNone,
     "Wall clock of one solution, mean over all steps."},
    {kSolver, "Solve time, p50", "ms", [](const Metrics& m, int) { return 1e-3 * m.solve_p50; }, 3, Best::kNone,
     "Half of the solutions took at most this long."},
    {kSolver, "Solve time, p99", "ms", [](const Metrics& m, int) { return 1e-3 * m.solve_p99; }, 3, Best::kNone,
     "99 % of the solutions took at most this long."},
    {kSolver, "Solve time, p99.9", "ms", [](const Metrics& m, int) { return 1e-3 * m.solve_p999; }, 3, Best::kNone,
     "99.9 % of the solutions took at most this long."},
    {kSolver, "Solve time, largest", "ms", [](const Metrics& m, int) { return 1e-3 * m.solve_max; }, 3, Best::kNone,
     "The slowest solution."},
    {kSolver, "Iterations, mean", "", [](const Metrics& m, int) { return m.iterations_mean; }, 1, Best::kNone,
     "Iterations of the solver per step."},
    {kSolver, "Iterations, largest", "", [](const Metrics& m, int) { return double(m.iterations_max); }, 0, Best::kNone,
     "Largest number of iterations in one step."},
};

/// Characters, not bytes, of UTF-8 text.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

/// The text padded to `columns`; negative: aligned right.
std::string pad(const std::string& text, int columns) {
  const auto space = std::max<std::ptrdiff_t>(0, std::abs(columns) - static_cast<std::ptrdiff_t>(width(text)));
  const std::string spaces(static_cast<std::size_t>(space), ' ');
  return columns < 0 ? spaces + text : text + spaces;
}

}  // namespace

std::vector<MetricRow> metric_rows(std::span<const std::string> tools) {
  std::vector<MetricRow> rows;
  for (const MetricRow& row : kRows) {
    const bool is_of_tool = row.group == kGlass || row.group == kTracking;
    if (!is_of_tool || tools.size() < 2) {
      rows.push_back(row);
      continue;
    }
    for (std::size_t t = 0; t < tools.size(); ++t) {
      MetricRow& one = rows.emplace_back(row);
      one.tool = static_cast<int>(t);
      one.label += ", " + tools[t];
    }
  }
  return rows;
}

bool is_known(const MetricRow& row, std::span<const Metrics> metrics) {
  return std::any_of(metrics.begin(), metrics.end(), [&](const Metrics& m) { return !std::isnan(row.value(m)); });
}

std::string format_value(const MetricRow& row, const Metrics& metrics) {
  if (!std::isfinite(row.value(metrics))) return "none";  // such as the distance to an obstacle if there is none
  const double value = row.value(metrics);
  const std::string text = fmt::format("{:.{}f}", value, row.decimals);
  if (text.find_first_of("123456789") != std::string::npos) return text;
  return value > 0.0 && row.unit == std::string_view("%") ? fmt::format("< {:g}", std::pow(10.0, -row.decimals))
                                                          : fmt::format("{:.{}f}", 0.0, row.decimals);
}

Metrics metrics_of(const ProfileResult& profile) {
  Metrics metrics = evaluate(profile.steps, profile.commands, profile.limits);
  for (int t = 0; t < metrics.tool_count; ++t) {
    const ProfileResult::Liquid& liquid = profile.liquids[t];
    ToolMetrics& tool = metrics.tools[t];
    if (!liquid.felt.empty()) count_felt(liquid.felt, tool);
    if (liquid.spills < 0) continue;
    tool.spills = liquid.spills;
    tool.spilled_share = liquid.spilled_share;
    if (profile.led_s > 0.0) tool.spills_per_minute = liquid.spills / (profile.led_s / 60.0);
  }
  return metrics;
}

std::string format_table(const std::vector<ProfileResult>& profiles) {
  constexpr int kUnitColumns = 5;
  std::vector<MetricRow> rows = metric_rows(profiles.front().names.tools);
  int label_columns = 40;
  for (const MetricRow& row : rows) label_columns = std::max(label_columns, 3 + static_cast<int>(width(row.label)));
  std::string table = pad("", label_columns + kUnitColumns);
  std::vector<Metrics> metrics;
  std::vector<int> columns;
  for (const ProfileResult& profile : profiles) {
    metrics.push_back(metrics_of(profile));
    columns.push_back(2 + std::max(9, static_cast<int>(width(profile.name))));
    table += pad(profile.name, -columns.back());
  }
  std::string group;
  for (const MetricRow& row : rows) {
    if (!is_known(row, metrics)) continue;
    if (group != row.group) table += fmt::format("\n{}", group = row.group);
    table += "\n" + pad(fmt::format("  {}", row.label), label_columns) + pad(row.unit, kUnitColumns);
    for (std::size_t i = 0; i < profiles.size(); ++i) table += pad(format_value(row, metrics[i]), -columns[i]);
  }
  return table + "\n";
}

}  // namespace steadyhand

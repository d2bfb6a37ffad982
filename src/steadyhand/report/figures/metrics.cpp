#include "steadyhand/report/figures/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace steadyhand {

double percentile(std::vector<double> values, double percent) {
  // Slightly below the exact rank, so that e.g. 99.9 % of 1000 is rank 999 despite rounding.
  const double rank = std::ceil(percent / 100 * static_cast<double>(values.size()) - 1e-9);
  const auto index = static_cast<std::size_t>(std::max(rank, 1.0)) - 1;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return values[index];
}

double lateral_acceleration(const ToolStep& tool) { return tool.local_acceleration.head<2>().norm(); }

double position_error(const ToolStep& tool) { return (tool.X_base_planned.p - tool.X_base_target.p).norm(); }

double mean_position_error(std::span<const PlanStep> steps, int tool) {
  double sum = 0.0;
  int engaged = 0;
  for (const PlanStep& step : steps) {
    if (!step.tools[tool].engaged) continue;
    sum += position_error(step.tools[tool]);
    ++engaged;
  }
  return sum / engaged;
}

double orientation_error(const ToolStep& tool) { return tool.X_base_planned.q.angularDistance(tool.X_base_target.q); }

double roll_angle(const Quaternion& q) {
  return std::atan2(2 * (q.w() * q.x() + q.y() * q.z()), 1 - 2 * (q.x() * q.x() + q.y() * q.y()));
}

double pitch_angle(const Quaternion& q) {
  return std::asin(std::clamp(2 * (q.w() * q.y() - q.z() * q.x()), -1.0, 1.0));
}

double yaw_angle(const Quaternion& q) {
  return std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()));
}

double largest_ratio(const JointVector& values, const JointVector& limits) {
  return (values.array().abs() / limits.array()).maxCoeff();
}

namespace {

ToolMetrics evaluate(std::span<const PlanStep> steps, int tool) {
  ToolMetrics m;
  m.vertical_min = std::numeric_limits<double>::infinity();
  std::vector<double> lateral;
  int engaged = 0;
  for (const PlanStep& all : steps) {
    const ToolStep& step = all.tools[tool];
    lateral.push_back(lateral_acceleration(step));
    m.lateral_mean += lateral.back() / static_cast<int>(steps.size());
    m.vertical_min = std::min(m.vertical_min, step.local_acceleration.z());
    if (!step.engaged) continue;
    ++engaged;
    const double position = position_error(step), orientation = orientation_error(step);
    m.position_rms += position * position;
    m.orientation_rms += orientation * orientation;
    m.position_max = std::max(m.position_max, position);
    m.orientation_max = std::max(m.orientation_max, orientation);
  }
  m.position_mean = engaged > 0 ? mean_position_error(steps, tool) : 0.0;
  m.position_rms = std::sqrt(m.position_rms / std::max(engaged, 1));
  m.orientation_rms = std::sqrt(m.orientation_rms / std::max(engaged, 1));
  m.lateral_p99 = percentile(lateral, 99);
  m.lateral_max = percentile(lateral, 100);
  return m;
}

}  // namespace

Metrics evaluate(std::span<const PlanStep> steps, std::span<const JointCommand> commands, const JointLimits& limits) {
  Metrics m;
  m.steps = static_cast<int>(steps.size());
  m.tool_count = steps.front().tool_count;
  for (int t = 0; t < m.tool_count; ++t) m.tools[t] = evaluate(steps, t);
  m.smallest_distance = m.distance_between_arms = m.object_distance = std::numeric_limits<double>::infinity();

  std::vector<double> solve;
  for (const PlanStep& step : steps) {
    solve.push_back(step.solve_time_us);
    m.solve_mean += solve.back() / m.steps;
    m.iterations_mean += static_cast<double>(step.iterations) / m.steps;
    m.iterations_max = std::max(m.iterations_max, step.iterations);
    m.failures += step.status != PlanOrigin::kSolved;
    m.smallest_distance = std::min(m.smallest_distance, step.smallest_sphere_distance_m);
    m.distance_between_arms = std::min(m.distance_between_arms, step.distance_between_arms_m);
    for (const auto& [name, distance] : step.object_distances)
      m.object_distance = std::min(m.object_distance, distance);
    m.speed_ratio_max = std::max(m.speed_ratio_max, largest_ratio(step.dq, limits.velocity_max));
    m.acceleration_ratio_max = std::max(m.acceleration_ratio_max, largest_ratio(step.ddq, limits.acceleration_max));
  }
  if (std::isinf(m.distance_between_arms)) m.distance_between_arms = std::numeric_limits<double>::quiet_NaN();
  m.solve_p50 = percentile(solve, 50);
  m.solve_p99 = percentile(solve, 99);
  m.solve_p999 = percentile(solve, 99.9);
  m.solve_max = percentile(solve, 100);

  for (const JointCommand& command : commands) {
    m.speed_ratio_max = std::max(m.speed_ratio_max, largest_ratio(command.dq, limits.velocity_max));
    m.acceleration_ratio_max = std::max(m.acceleration_ratio_max, largest_ratio(command.ddq, limits.acceleration_max));
  }
  return m;
}

void count_felt(std::span<const Felt> felt, ToolMetrics& metrics) {
  double sum = 0.0;
  int count = 0;
  std::vector<double> largest;
  for (const Felt& each : felt) {
    sum += each.sum;
    count += each.count;
    largest.push_back(each.largest);
  }
  metrics.lateral_mean = sum / count;
  metrics.lateral_p99 = percentile(largest, 99);
  metrics.lateral_max = percentile(largest, 100);
}

}  // namespace steadyhand

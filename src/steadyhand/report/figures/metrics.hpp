#pragma once

#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "steadyhand/core/arrows.hpp"
#include "steadyhand/files/record/step.hpp"

namespace steadyhand {

/// The lateral specific force on the liquid over a short time, m/s^2.
struct Felt {
  double sum = 0.0, largest = 0.0;
  int count = 0;
};

constexpr double kDegrees = 180 / std::numbers::pi;  ///< in a radian

struct JointLimits {
  JointVector velocity_max;      ///< rad/s (m/s)
  JointVector acceleration_max;  ///< rad/s^2 (m/s^2)
};

/// Figures of one tool. Accelerations are specific forces in its frame (a_local of docs/explanation/formulation.md) at
/// the start of each plan. Errors compare planned pose and target at the same time, over the steps in which it is
/// engaged.
struct ToolMetrics {
  double lateral_mean = 0;     ///< m/s^2, mean of sqrt(a_x^2 + a_y^2)
  double lateral_p99 = 0;      ///< m/s^2
  double lateral_max = 0;      ///< m/s^2
  double vertical_min = 0;     ///< m/s^2, smallest a_z; below 0 the liquid leaves the glass
  double position_mean = 0;    ///< m
  double position_rms = 0;     ///< m
  double position_max = 0;     ///< m
  double orientation_rms = 0;  ///< rad, angle between planned and target orientation
  double orientation_max = 0;  ///< rad
  // ---- of a live session; NaN if not known
  double spills = std::numeric_limits<double>::quiet_NaN();             ///< how often the liquid went over the rim
  double spilled_share = std::numeric_limits<double>::quiet_NaN();      ///< share of the liquid, largest of all spills
  double spills_per_minute = std::numeric_limits<double>::quiet_NaN();  ///< per minute of engaged time
};

/// Figures of one profile over a recording.
struct Metrics {
  int steps = 0;
  int tool_count = 1;          ///< entries of tools
  PerTool<ToolMetrics> tools;  ///< of each
  double solve_mean = 0;       ///< us
  double solve_p50 = 0;        ///< us
  double solve_p99 = 0;        ///< us
  double solve_p999 = 0;       ///< us
  double solve_max = 0;        ///< us
  double iterations_mean = 0;
  int iterations_max = 0;
  int failures = 0;                   ///< steps whose status is not kSolved
  double smallest_distance = 0;       ///< m, between the bodies of a pair; below 0 they overlap
  double distance_between_arms = 0;   ///< m, the same of two arms; NaN: there is one
  double object_distance = 0;         ///< m, smallest distance to an obstacle; infinite without obstacles
  double speed_ratio_max = 0;         ///< largest |dq| / limit over joints and commands; 1 is at the limit
  double acceleration_ratio_max = 0;  ///< largest |ddq| / limit
};

/// @pre steps is not empty and has at least one joint; limits and commands are of the same arm
Metrics evaluate(std::span<const PlanStep> steps, std::span<const JointCommand> commands, const JointLimits& limits);

/// Replaces the plans' lateral figures by those measured in a live session. @pre felt is not empty
void count_felt(std::span<const Felt> felt, ToolMetrics& metrics);

/// Nearest rank: the smallest value that at least `percent` of all values do not exceed, so always one of them.
/// @pre values is not empty, 0 < percent <= 100
double percentile(std::vector<double> values, double percent);

/// sqrt(a_x^2 + a_y^2), m/s^2.
double lateral_acceleration(const ToolStep& tool);
/// Distance from target to planned position, m.
double position_error(const ToolStep& tool);
/// Mean position error of a tool over the steps in which it is engaged, m; NaN if there are none.
double mean_position_error(std::span<const PlanStep> steps, int tool);
/// Angle from target to planned orientation, rad, 0 to pi.
double orientation_error(const ToolStep& tool);
/// Roll of a frame in base: its angle about x when written as yaw, pitch, roll (Z-Y'-X''); rad, -pi to pi.
double roll_angle(const Quaternion& q);
/// The others: pitch about y, -pi/2 to pi/2, and yaw about z, -pi to pi.
double pitch_angle(const Quaternion& q);
double yaw_angle(const Quaternion& q);
/// Largest |value_i| / limit_i.
double largest_ratio(const JointVector& values, const JointVector& limits);

}  // namespace steadyhand

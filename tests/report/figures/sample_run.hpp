#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "steadyhand/report/figures/report.hpp"

/// A run that looks like one, made by formulas: for the tests of report and page, which need no planner.
namespace steadyhand::test {

inline JointVector joint_sines(double t, double amplitude, double frequency, int derivative) {
  JointVector v(6);
  for (int i = 0; i < 6; ++i) {
    const double w = frequency * (1 + 0.3 * i);
    const double phase = w * t + i + derivative * std::numbers::pi / 2;
    v[i] = amplitude / (1 + i) * std::pow(w, derivative) * std::sin(phase);
  }
  return v;
}

/// A hand that swings, and a plan that follows it with the given lag (s) and keeps the given share of its acceleration.
inline ProfileResult sample_profile(const std::string& name, const std::string& label, double lag, double share,
                                    double solve_us, unsigned seed, double duration = 11, double rate_hz = 20) {
  std::mt19937 random(seed);
  std::lognormal_distribution<double> spread(0, 0.25);
  std::normal_distribution<double> noise;

  ProfileResult result;
  result.name = name;
  result.label = label;
  result.weights = {{"position", {500}}, {"orientation", {5}}, {"velocity", {0.1}}, {"acceleration", {0.02}}};
  result.names.terms = {"position", "orientation", "velocity", "acceleration", "lateral", "vertical"};
  result.names.joints = {"shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"};
  result.names.joint_units.assign(6, "rad");
  result.limits.velocity_max = JointVector::Constant(6, std::numbers::pi);
  result.limits.acceleration_max = JointVector::Constant(6, 15);

  const auto hand = [](double t) {
    const double swing = std::sin(2.2 * t) * std::sin(0.4 * t);
    Pose pose;
    pose.p = {0.5 + 0.08 * std::sin(1.3 * t), 0.25 * swing, 0.35 + 0.1 * std::sin(0.9 * t + 1)};
    pose.q = Eigen::AngleAxisd(0.35 * swing, Vector3::UnitX()) * Eigen::AngleAxisd(0.2 * t / 11, Vector3::UnitZ());
    return pose;
  };
  const int steps = static_cast<int>(duration * rate_hz);
  for (int k = 0; k < steps; ++k) {
    const double t = k / rate_hz;
    PlanStep step;
    step.t_s = t;
    step.tools[0].X_base_target = hand(t);
    step.tools[0].X_base_planned = hand(std::max(0.0, t - lag));
    step.q = joint_sines(t, 0.8, 1.4, 0);
    step.dq = joint_sines(t, 0.8, 1.4, 1);
    step.ddq = joint_sines(t, 0.8, 1.4, 2);
    step.tools[0].local_acceleration =
        kGravity + share * Vector3(3 * std::sin(2.2 * t), 2 * std::sin(3.1 * t), std::sin(5 * t));
    const double error = position_error(step.tools[0]);
    step.shares = {200 * error * error,
                   5 * orientation_error(step.tools[0]),
                   0.02 * step.dq.squaredNorm(),
                   0.004 * step.ddq.squaredNorm(),
                   share < 0.5 ? 4 * lateral_acceleration(step.tools[0]) : 0,
                   share < 0.5 ? std::abs(step.tools[0].local_acceleration.z() - 9.81) : 0};
    for (const double value : step.shares) step.objective += value;
    step.iterations = 4 + static_cast<int>(4 * std::abs(noise(random)));
    step.solve_time_us = solve_us * spread(random) * (k % 97 == 60 ? 2.5 : 1.0);
    if (k % 150 == 120) step.status = PlanOrigin::kFeasible;
    step.smallest_sphere_distance_m = 0.05 + 0.03 * std::sin(0.7 * t + lag);
    step.tools[0].engaged = true;
    result.steps.push_back(step);
  }
  for (int k = 0; k < static_cast<int>(duration * 500); ++k) {
    const double t = k / 500.0;
    result.commands.push_back({{from_seconds(t), from_seconds(t)},
                               joint_sines(t, 0.8, 1.4, 0),
                               joint_sines(t, 0.8 * (0.5 + share / 2), 1.4, 1),
                               joint_sines(t, 0.8, 1.4, 2)});
  }
  return result;
}

inline ReportInput sample_input() {
  ReportInput input;
  input.recording = "demo-recording.json, track rhand";
  input.rate_hz = 20;
  input.scale = 0.5;
  input.command = "./steadyhand replay --rate 20 --scale 0.5";
  input.profiles = {sample_profile("tracking", "P1 tracking", 0.03, 1.0, 2100, 1),
                    sample_profile("anti-slosh", "P2 anti-slosh", 0.3, 0.12, 5400, 2),
                    sample_profile("waiter", "P3 waiter", 0.12, 0.25, 4300, 3)};
  return input;
}

}  // namespace steadyhand::test

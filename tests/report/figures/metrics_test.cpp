#include "steadyhand/report/figures/metrics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <sstream>

#include "sample_run.hpp"
#include "steadyhand/report/figures/report.hpp"
#include "steadyhand/report/figures/table.hpp"

namespace steadyhand {
namespace {

/// Two joints; nothing moves, planned and target agree.
PlanStep still_step() {
  PlanStep step;
  step.q = step.dq = step.ddq = JointVector::Zero(2);
  step.tools[0].engaged = true;
  return step;
}

JointLimits limits() { return {JointVector::Constant(2, 4.0), JointVector::Constant(2, 10.0)}; }

TEST(Percentile, IsTheNearestRank) {
  const std::vector<double> shuffled = {35, 50, 15, 40, 20};
  EXPECT_EQ(percentile(shuffled, 5), 15);
  EXPECT_EQ(percentile(shuffled, 30), 20);
  EXPECT_EQ(percentile(shuffled, 40), 20);
  EXPECT_EQ(percentile(shuffled, 50), 35);
  EXPECT_EQ(percentile(shuffled, 100), 50);
  EXPECT_EQ(percentile({7}, 99.9), 7);

  std::vector<double> thousand(1000);
  for (int i = 0; i < 1000; ++i) thousand[i] = i + 1;
  EXPECT_EQ(percentile(thousand, 99), 990);
  EXPECT_EQ(percentile(thousand, 99.9), 999);
}

TEST(Percentile, AtLeastThatShareIsNotAboveAndItIsTheSmallestSuchValue) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<double> values(1 + random() % 50);
    for (double& value : values) value = std::round(10 * uniform(random));
    const double percent = 1 + 99 * uniform(random);
    const double result = percentile(values, percent);
    const auto share_up_to = [&](double limit) {
      return 100.0 * std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; }) / values.size();
    };
    EXPECT_GE(share_up_to(result), percent - 1e-6);
    EXPECT_LT(share_up_to(result - 0.5), percent);
  }
}

TEST(Metrics, OfHandMadeSteps) {
  std::vector<PlanStep> steps(4, still_step());
  steps[0].tools[0].local_acceleration = {3, 4, 9};
  steps[1].tools[0].local_acceleration = {0, -1, 5};
  steps[0].tools[0].X_base_planned.p = {0.03, 0, 0.04};
  steps[2].tools[0].X_base_planned.q = Eigen::AngleAxisd(0.2, Vector3(1, 2, 3).normalized());
  for (int k = 0; k < 4; ++k) {
    steps[k].solve_time_us = 1000 * (k + 1);
    steps[k].iterations = 2 * k;
    steps[k].smallest_sphere_distance_m = 0.1 - 0.02 * k;
  }
  steps[3].status = PlanOrigin::kPrevious;
  steps[2].status = PlanOrigin::kFeasible;
  steps[1].dq << 1, -2;
  steps[1].ddq << -9, 1;

  const Metrics m = evaluate(steps, {}, limits());
  EXPECT_EQ(m.steps, 4);
  EXPECT_DOUBLE_EQ(m.tools[0].lateral_mean, 6.0 / 4);
  EXPECT_DOUBLE_EQ(m.tools[0].lateral_p99, 5);
  EXPECT_DOUBLE_EQ(m.tools[0].vertical_min, 5);
  EXPECT_NEAR(m.tools[0].position_rms, 0.05 / 2, 1e-15);
  EXPECT_NEAR(m.tools[0].position_max, 0.05, 1e-15);
  EXPECT_NEAR(m.tools[0].orientation_rms, 0.1, 1e-12);
  EXPECT_NEAR(m.tools[0].orientation_max, 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(m.solve_mean, 2500);
  EXPECT_DOUBLE_EQ(m.solve_p50, 2000);
  EXPECT_DOUBLE_EQ(m.solve_p999, 4000);
  EXPECT_DOUBLE_EQ(m.solve_max, 4000);
  EXPECT_DOUBLE_EQ(m.iterations_mean, 3);
  EXPECT_EQ(m.iterations_max, 6);
  EXPECT_EQ(m.failures, 2);
  EXPECT_NEAR(m.smallest_distance, 0.04, 1e-15);
  EXPECT_DOUBLE_EQ(m.speed_ratio_max, 0.5);
  EXPECT_DOUBLE_EQ(m.acceleration_ratio_max, 0.9);
}

TEST(Metrics, CommandsBetweenTheStepsCount) {
  const std::vector<PlanStep> steps(2, still_step());
  JointCommand command{{}, JointVector::Zero(2), JointVector::Zero(2), JointVector::Zero(2)};
  command.dq << 0, -3;
  command.ddq << 5, 0;
  const Metrics m = evaluate(steps, std::span(&command, 1), limits());
  EXPECT_DOUBLE_EQ(m.speed_ratio_max, 0.75);
  EXPECT_DOUBLE_EQ(m.acceleration_ratio_max, 0.5);
}

TEST(Metrics, ErrorsAreThoseOfEngagedSteps) {
  std::vector<PlanStep> steps(3, still_step());
  steps[0].tools[0].X_base_planned.p.x() = 0.3;
  steps[1].tools[0].X_base_planned.p.x() = 5;
  steps[1].tools[0].engaged = false;
  steps[2].tools[0].X_base_planned.p.x() = 0.3;
  const Metrics m = evaluate(steps, {}, limits());
  EXPECT_DOUBLE_EQ(m.tools[0].position_rms, 0.3);
  EXPECT_DOUBLE_EQ(m.tools[0].position_max, 0.3);

  for (PlanStep& step : steps) step.tools[0].engaged = false;
  EXPECT_EQ(evaluate(steps, {}, limits()).tools[0].position_rms, 0);
}

TEST(Metrics, KeepTheirOrderAndForgetTheOrderOfSteps) {
  std::mt19937 random(6);
  for (unsigned seed = 0; seed < 20; ++seed) {
    ProfileResult run = test::sample_profile("p", "P", 0.1, 0.5, 3000, seed, 2 + 0.3 * seed);
    for (PlanStep& step : run.steps) step.object_distances = {{"table", 1e-3 * static_cast<double>(random() % 1000)}};
    const Metrics m = evaluate(run.steps, run.commands, run.limits);
    EXPECT_LE(m.tools[0].lateral_mean, m.tools[0].lateral_p99);
    EXPECT_LE(m.tools[0].position_rms, m.tools[0].position_max);
    EXPECT_LE(m.tools[0].orientation_rms, m.tools[0].orientation_max);
    EXPECT_LE(m.solve_p50, m.solve_p99);
    EXPECT_LE(m.solve_p99, m.solve_p999);
    EXPECT_LE(m.solve_p999, m.solve_max);
    EXPECT_LE(m.solve_mean, m.solve_max);
    EXPECT_LE(m.iterations_mean, m.iterations_max);

    std::shuffle(run.steps.begin(), run.steps.end(), random);
    const Metrics shuffled = evaluate(run.steps, run.commands, run.limits);
    for (const MetricRow& row : metric_rows()) {
      if (!is_known(row, std::array{m})) continue;  // for live sessions only
      EXPECT_NEAR(row.value(shuffled), row.value(m), 1e-9 * (1 + std::abs(row.value(m)))) << row.label;
    }
  }
}

TEST(Metrics, TheNearestObjectCounts) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ReportInput input = test::sample_input();
  std::vector<PlanStep>& steps = input.profiles[0].steps;
  const auto smallest = [&] { return evaluate(steps, {}, input.profiles[0].limits).object_distance; };
  EXPECT_EQ(smallest(), std::numeric_limits<double>::infinity());
  steps.at(3).object_distances = {{"table", 0.2}, {"all may touch it", nan}};
  steps.at(5).object_distances = {{"table", 0.3}, {"ball", -0.1}};
  EXPECT_EQ(smallest(), -0.1);
}

TEST(Angles, AreYawPitchAndRoll) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 1000; ++i) {
    const double yaw = 3 * uniform(random), pitch = 1.5 * uniform(random), roll = 3 * uniform(random);
    const Quaternion q = Eigen::AngleAxisd(yaw, Vector3::UnitZ()) * Eigen::AngleAxisd(pitch, Vector3::UnitY()) *
                         Eigen::AngleAxisd(roll, Vector3::UnitX());
    EXPECT_NEAR(roll_angle(q), roll, 1e-9);
    EXPECT_NEAR(pitch_angle(q), pitch, 1e-7);
    EXPECT_NEAR(yaw_angle(q), yaw, 1e-9);
  }
}

TEST(FormatValue, ZeroHasNoSign) {
  Metrics m;
  for (const MetricRow& row : metric_rows()) {
    if (std::string_view(row.label) != "Distance between bodies, smallest") continue;
    m.smallest_distance = -1e-9;
    EXPECT_EQ(format_value(row, m), "0.0");
    m.smallest_distance = -1e-3;
    EXPECT_EQ(format_value(row, m), "-1.0");
    return;
  }
  FAIL() << "no such row";
}

TEST(FormatTable, FitsATerminalAndIsAligned) {
  const ReportInput input = test::sample_input();
  std::istringstream lines(format_table(input.profiles));
  std::string line;
  int values = 0;
  while (std::getline(lines, line)) {
    const auto columns = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    EXPECT_LE(columns, 100) << line;
    if (line.starts_with("  ")) {
      EXPECT_GT(columns, 70) << line;
      ++values;
    }
  }
  const std::array known{metrics_of(input.profiles[0])};
  const auto rows = metric_rows();
  const auto told = std::count_if(rows.begin(), rows.end(), [&](const auto& row) { return is_known(row, known); });
  EXPECT_EQ(told, static_cast<std::ptrdiff_t>(rows.size()) - 4);  // a replay's spills are unknown
  EXPECT_EQ(values, static_cast<int>(told) + 1);                  // and the header
}

}  // namespace
}  // namespace steadyhand

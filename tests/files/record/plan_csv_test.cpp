#include "steadyhand/files/record/plan_csv.hpp"

#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "test_data.hpp"

namespace steadyhand {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

std::vector<Row> write_and_read(const std::vector<PlanStep>& steps) {
  const auto path = test::temporary_file("plan.csv");
  Result<PlanCsvWriter> writer = PlanCsvWriter::create(path, test::names());
  EXPECT_TRUE(writer);
  for (const PlanStep& step : steps) EXPECT_TRUE(writer->write(step));
  EXPECT_TRUE(writer->close());

  std::istringstream stream(test::read_file(path));
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> names = split(line);
  std::vector<Row> rows;
  while (std::getline(stream, line)) {
    const std::vector<std::string> fields = split(line);
    EXPECT_EQ(fields.size(), names.size());
    Row& row = rows.emplace_back();
    for (std::size_t i = 0; i < names.size(); ++i) EXPECT_TRUE(row.emplace(names[i], fields[i]).second) << names[i];
  }
  return rows;
}

TEST(PlanCsv, ReadsBackBitForBit) {
  std::mt19937 random(2);
  std::vector<PlanStep> steps;
  for (int i = 0; i < 1000; ++i) steps.push_back(test::random_step(random));
  const std::vector<Row> rows = write_and_read(steps);
  ASSERT_EQ(rows.size(), steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const PlanStep& step = steps[i];
    const Row& row = rows[i];
    const auto value = [&](const std::string& name) { return std::stod(row.at(name)); };
    EXPECT_EQ(value("t_s"), step.t_s);
    EXPECT_EQ(value("target_x_m"), step.tools[0].X_base_target.p.x());
    EXPECT_EQ(value("target_qw"), step.tools[0].X_base_target.q.w());
    EXPECT_EQ(value("planned_z_m"), step.tools[0].X_base_planned.p.z());
    EXPECT_EQ(value("planned_qx"), step.tools[0].X_base_planned.q.x());
    EXPECT_EQ(value("q0_m"), step.q[0]);
    EXPECT_EQ(value("q2_rad"), step.q[2]);
    EXPECT_EQ(value("dq0_m_s"), step.dq[0]);
    EXPECT_EQ(value("ddq1_rad_s2"), step.ddq[1]);
    EXPECT_EQ(value("local_acceleration_y_m_s2"), step.tools[0].local_acceleration.y());
    EXPECT_EQ(value("objective"), step.objective);
    EXPECT_EQ(value("objective_position"), step.shares[0]);
    EXPECT_EQ(value("objective_lateral"), step.shares[1]);
    EXPECT_EQ(value("iterations"), step.iterations);
    EXPECT_EQ(value("solve_time_us"), step.solve_time_us);
    EXPECT_EQ(row.at("status"), to_string(step.status));
    EXPECT_EQ(value("smallest_sphere_distance_m"), step.smallest_sphere_distance_m);
    EXPECT_EQ(row.at("engaged"), step.tools[0].engaged ? "1" : "0");
  }
}

TEST(PlanCsv, OnlyTheSolveTimeDiffersBetweenEqualRuns) {
  std::mt19937 random(3);
  PlanStep step = test::random_step(random);
  const Row first = write_and_read({step}).at(0);
  step.solve_time_us += 1;
  Row second = write_and_read({step}).at(0);
  EXPECT_NE(first, second);
  second["solve_time_us"] = first.at("solve_time_us");
  EXPECT_EQ(first, second);
}

TEST(PlanCsv, RefusesAStepOfAnotherArm) {
  Result<PlanCsvWriter> writer = PlanCsvWriter::create(test::temporary_file("other.csv"), test::names());
  ASSERT_TRUE(writer);
  std::mt19937 random(4);
  PlanStep step = test::random_step(random);
  step.dq.resize(2);
  EXPECT_FALSE(writer->write(step));
}

TEST(PlanCsv, ErrorsNameTheFile) {
  const Result<PlanCsvWriter> nowhere = PlanCsvWriter::create("/nowhere/plan.csv", test::names());
  ASSERT_FALSE(nowhere);
  EXPECT_NE(nowhere.error().message.find("/nowhere/plan.csv"), std::string::npos);

  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  Result<PlanCsvWriter> full = PlanCsvWriter::create("/dev/full", test::names());
  ASSERT_TRUE(full);  // the header waits in a buffer
  const Status status = full->close();
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("No space left"), std::string::npos) << status.error().message;

  RunNames names = test::names();
  names.terms.resize(kMaxObjectives + 1);
  EXPECT_FALSE(PlanCsvWriter::create(test::temporary_file("terms.csv"), names));
}

}  // namespace
}  // namespace steadyhand

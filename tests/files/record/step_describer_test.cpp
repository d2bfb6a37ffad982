#include "steadyhand/files/record/step_describer.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <numeric>
#include <sstream>

#include "files/record/test_data.hpp"
#include "geometry/robot/random_arm.hpp"
#include "steadyhand/files/record/model_json.hpp"
#include "steadyhand/files/record/plan_csv.hpp"
#include "steadyhand/files/record/recorder.hpp"
#include "steadyhand/files/record/session_file.hpp"
#include "steadyhand/planning/solve/solver.hpp"
#include "support/extra_objectives.hpp"

namespace steadyhand {
namespace {

/// At the time of the step, to where the object is then.
TEST(StepDescriber, TellsHowFarObjectsAre) {
  std::mt19937 random(1);
  const RobotModel model = random_arm(3, random);
  StepDescriber describer(model);
  CellObject object;
  object.name = "ball";
  object.shape = Shape::sphere(0.1);
  object.origin = Eigen::Translation3d(50.0, 0.0, 0.0) * Eigen::Isometry3d::Identity();
  object.velocity = {1.0, 0.0, 0.0};
  ASSERT_TRUE(describer.set_cell({"desk", {object}}, from_seconds(1.0)));
  Plan plan;
  plan.joints = 3;
  plan.intervals = 1;
  plan.x[0] = plan.x[1] = StateVector::Zero(6);
  plan.u[0] = JointVector::Zero(3);
  const auto distance = [&](double t) {
    const PlanStep step = describer.describe(plan, from_seconds(t), 1, {});
    EXPECT_EQ(step.object_distances.at(0).first, "ball");
    return step.object_distances.at(0).second;
  };
  EXPECT_NEAR(distance(3.0) - distance(1.0), 2.0, 1e-3);
  EXPECT_GT(distance(1.0), 40.0);
  object.shape = Shape::sphere(-1.0);
  EXPECT_FALSE(describer.set_cell({"desk", {object}}, Time(0)));
}

class ObjectivesOf : public testing::TestWithParam<int> {};

/// The share of every objective gets into step, plan.csv and recording, and out of this again, under its name.
TEST_P(ObjectivesOf, AllSharesAreTold) {
  constexpr int kDof = 3;
  const int count = GetParam();
  std::mt19937 random(count);
  const RobotModel model = random_arm(kDof, random);
  OcpSettings settings = test::with_objectives(count);
  settings.weights["position"] = {500.0};
  const Ocp ocp(model, settings);
  ASSERT_TRUE(make_solver(kDefaultSolver, ocp, 1e-6));

  auto planner = Planner::make(model, settings, {});
  ASSERT_TRUE(planner) << planner.error().message;
  Reference reference;
  reference.nodes = ocp.horizon();
  reference.dt = ocp.dt();
  Kinematics arm(model);
  arm.set_position(model.home);
  for (int k = 0; k < reference.nodes; ++k) {
    reference.tools[0].p[k] = arm.p() + Vector3(0.05, 0.0, 0.0);
    reference.tools[0].R[k] = arm.R();
  }
  const Plan& plan = (*planner)->update(reference);
  const PlanStep step = StepDescriber(model).describe(plan, Time(0), ocp.horizon(), (*planner)->figures());
  EXPECT_GT(step.iterations, 0);
  EXPECT_NEAR(std::accumulate(step.shares.begin(), step.shares.end(), 0.0), step.objective, 1e-9 * step.objective);
  double speed = 0.0;  // sum of squares over the nodes that the objectives act at
  const auto& x = (*planner)->solution().trajectory.x;
  for (std::size_t k = 1; k < x.size(); ++k) speed += x[k].tail(kDof).squaredNorm();
  ASSERT_GT(speed, 0.0);
  std::vector<double> expected(count, 0.0);
  for (int i = 6; i < count; ++i) expected[i] = ocp.dt() * (i + 1) * speed;
  const auto expect_shares = [&](const PlanStep& told) {
    for (int i = 6; i < count; ++i) EXPECT_NEAR(told.shares[i], expected[i], 1e-12) << i;
    for (int i = count; i < std::ssize(told.shares); ++i) EXPECT_EQ(told.shares[i], 0.0);
  };
  expect_shares(step);

  const RunNames names = run_names(model, ocp.objectives());
  const auto csv = test::temporary_file("shares.csv");
  Result<PlanCsvWriter> writer = PlanCsvWriter::create(csv, names);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(step));
  ASSERT_TRUE(writer->close());
  std::ifstream lines(csv);
  std::string header, row, column, value;
  std::getline(lines, header);
  std::getline(lines, row);
  std::istringstream columns(header), values(row);
  int extras = 0;
  while (std::getline(columns, column, ',') && std::getline(values, value, ',')) {
    if (!column.starts_with("objective_extra_")) continue;
    const int i = std::stoi(column.substr(std::string("objective_extra_").size()));
    EXPECT_NEAR(std::stod(value), expected[i], 1e-12) << column;
    ++extras;
  }
  EXPECT_EQ(extras, count - 6);

  const auto path = test::temporary_file("shares.mcap");
  RecorderSettings recorder_settings;
  recorder_settings.names = names;
  Result<Recorder> recorder = Recorder::create(path, recorder_settings);
  ASSERT_TRUE(recorder) << recorder.error().message;
  ASSERT_TRUE(recorder->add_metadata("robot", {{"json", robot_json(model)}}));
  ASSERT_TRUE(recorder->write(step));
  ASSERT_TRUE(recorder->close());
  SessionParts parts;
  parts.steps = true;
  const Result<SessionFile> session = load_session(path, parts);
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->names.terms, names.terms);
  expect_shares(session->steps.at(0));
}

INSTANTIATE_TEST_SUITE_P(Count, ObjectivesOf, testing::Range(9, kMaxObjectives + 1));

TEST(Objectives, AreAtMostSoMany) {
  std::mt19937 random(1);
  const RobotModel model = random_arm(3, random);
  const Ocp ocp(model, test::with_objectives(kMaxObjectives + 1));
  const auto solver = make_solver(kDefaultSolver, ocp, 1e-6);
  ASSERT_FALSE(solver);
  EXPECT_EQ(solver.error().message, "17 objectives; a problem has at most 16");
}

}  // namespace
}  // namespace steadyhand

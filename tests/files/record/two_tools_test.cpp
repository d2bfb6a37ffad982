// Recordings of a robot with two tools.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "files/record/test_data.hpp"
#include "steadyhand/files/record/plan_csv.hpp"
#include "steadyhand/files/record/recorder.hpp"
#include "steadyhand/files/record/session_file.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

RunNames two_tools() {
  RunNames names = test::names();
  names.tools = {"left", "right"};
  return names;
}

constexpr const char* kTwoToolRobot = R"({"joints": [{"name": "lift", "type": "prismatic"}, {"name": "elbow", "type":
"revolute"}, {"name": "wrist", "type": "revolute"}], "tools": [{"name": "left"}, {"name": "right"}], "velocity_max": [1,
2, 3], "acceleration_max": [4, 5, 6]})";

PlanStep random_two_tool_step(std::mt19937& random) {
  PlanStep step = test::random_step(random);
  step.tool_count = 2;
  step.tools[1] = test::random_step(random).tools[0];
  step.distance_between_arms_m = 0.125;
  return step;
}

Plan short_plan() {
  Plan plan;
  plan.joints = 3;
  plan.intervals = 1;
  plan.x[0] = plan.x[1] = StateVector::Zero(6);
  plan.u[0] = JointVector::Zero(3);
  return plan;
}

/// Writes with `write`, and completes the file.
template <typename Write>
std::filesystem::path record_two_tools(const std::string& name, const RunNames& names, const std::string& robot,
                                       Write&& write) {
  const auto path = test::temporary_file(name);
  RecorderSettings settings;
  settings.names = names;
  settings.live = true;
  Result<Recorder> recorder = Recorder::create(path, settings);
  EXPECT_TRUE(recorder) << recorder.error().message;
  EXPECT_TRUE(recorder->add_metadata("robot", {{"json", robot}}));
  write(*recorder);
  EXPECT_TRUE(recorder->close());
  return path;
}

SessionParts parts_of_tools() {
  SessionParts parts;
  parts.samples = parts.steps = parts.commands = parts.states = parts.changes = parts.liquid = true;
  return parts;
}

TEST(TwoTools, AreReadAsTheyWereWritten) {
  std::mt19937 random(1);
  const PlanStep step = random_two_tool_step(random);
  OperatorSample sample;
  sample.tool = 1;
  JointCommand command{{}, step.q, step.dq, step.ddq};
  command.gripper = {std::nullopt, 0.25};
  JointState state{{}, step.q, step.dq};
  state.gripper = {0.5, 0.75};
  LiquidState liquid;
  liquid.tilt_x = 0.125;
  liquid.spilled = true;
  liquid.spilled_share = 0.5;
  const auto path = record_two_tools("two.mcap", two_tools(), kTwoToolRobot, [&](Recorder& to) {
    EXPECT_TRUE(to.write(sample));
    EXPECT_TRUE(to.write(step));
    EXPECT_TRUE(to.write(command));
    EXPECT_TRUE(to.write(state));
    EXPECT_TRUE(to.write(Time(1), LiquidState(), 0));
    EXPECT_TRUE(to.write(Time(1), liquid, 1));
    SupervisionChange change{Time(2), SupervisionState::kReady, SupervisionState::kEngaged, "gripped"};
    change.tool = 1;
    EXPECT_TRUE(to.write(change));
  });
  const auto session = load_session(path, parts_of_tools());
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->names.tools, two_tools().tools);
  ASSERT_EQ(session->samples.size(), 1u);
  EXPECT_EQ(session->samples[0].tool, 1);
  ASSERT_EQ(session->steps.size(), 1u);
  const PlanStep& read = session->steps[0];
  ASSERT_EQ(read.tool_count, 2);
  EXPECT_EQ(read.distance_between_arms_m, 0.125);
  for (int t = 0; t < 2; ++t) {
    EXPECT_EQ(read.tools[t].X_base_target.p, step.tools[t].X_base_target.p);
    EXPECT_EQ(read.tools[t].X_base_planned.q.coeffs(), step.tools[t].X_base_planned.q.coeffs());
    EXPECT_EQ(read.tools[t].local_acceleration, step.tools[t].local_acceleration);
    EXPECT_EQ(read.tools[t].engaged, step.tools[t].engaged);
  }
  EXPECT_EQ(session->commands.at(0).gripper, command.gripper);
  EXPECT_EQ(session->states.at(0).gripper, state.gripper);
  ASSERT_EQ(session->liquids[1].states.size(), 1u);
  EXPECT_EQ(session->liquids[1].states[0].second.tilt_x, 0.125);
  EXPECT_TRUE(session->liquids[0].spills.spills().empty());
  EXPECT_EQ(session->changes.at(0).tool, 1);
}

/// What a robot with one tool records has none of the second one's members.
TEST(TwoTools, PosesOfPlansAndReferencesAreInAMemberOfTheirOwn) {
  const auto encode = [](const auto& message) {
    JsonBuffer buffer;
    JsonOut<MessageStyle>(buffer).put(message);
    return Json::parse(buffer);
  };
  Reference reference;
  reference.nodes = 1;
  reference.tools[0].p[0] = {1.0, 2.0, 3.0};
  reference.tools[1].p[0] = {4.0, 5.0, 6.0};
  reference.tools[0].R[0] = reference.tools[1].R[0] = Matrix3::Identity();
  reference.tools[1].spread[0] = {0.5, 0.25};
  const Plan plan = short_plan();
  const Pose pose{{7.0, 8.0, 9.0}, Quaternion::Identity()};
  const Json both = encode(ReferenceMessage{{&reference}, 2}), one = encode(ReferenceMessage{{&reference}, 1});
  EXPECT_EQ(both["poses"][0]["position"]["x"], 1.0);
  EXPECT_EQ(both["second_tool"]["poses"][0]["position"]["x"], 4.0);
  EXPECT_EQ(both["second_tool"]["along_m"], Json({0.5}));
  EXPECT_EQ(both["second_tool"]["across_m"], Json({0.25}));
  EXPECT_FALSE(one.contains("second_tool"));
  EXPECT_EQ(encode(PlanMessage{{&plan}, {{{pose, pose}, {pose, pose}}}})["second_tool"]["poses"].size(), 2u);
  std::mt19937 random(1);
  JointCommand command;
  command.gripper[0] = 0.5;
  for (const Json& message :
       {encode(PlanMessage{{&plan}, {{{pose, pose}, {}}}}), encode(StepMessage{test::random_step(random), {}}),
        encode(message_of(command)), encode(message_of(OperatorSample())), encode(message_of(Target())),
        encode(StateChange{}), encode(LiquidMessage{})}) {
    for (const char* member : {"tool", "second_tool", "second_gripper", "distance_between_arms_m"})
      EXPECT_FALSE(message.contains(member)) << message.dump();
  }
}

TEST(TwoTools, HaveTheirNamesBeforeTheColumnsOfPlanCsv) {
  std::mt19937 random(2);
  const PlanStep step = random_two_tool_step(random);
  const auto path = test::temporary_file("two.csv");
  Result<PlanCsvWriter> csv = PlanCsvWriter::create(path, two_tools());
  ASSERT_TRUE(csv);
  ASSERT_TRUE(csv->write(step));
  ASSERT_TRUE(csv->close());
  std::istringstream text(test::read_file(path));
  std::string names, values;
  std::getline(text, names);
  std::getline(text, values);
  const auto value = [&](const std::string& column) {
    std::istringstream name_cells(names), value_cells(values);
    for (std::string name, cell; std::getline(name_cells, name, ',') && std::getline(value_cells, cell, ',');) {
      if (name == column) return std::stod(cell);
    }
    ADD_FAILURE() << column << " is not in " << names;
    return 0.0;
  };
  EXPECT_EQ(value("left_target_x_m"), step.tools[0].X_base_target.p.x());
  EXPECT_EQ(value("right_planned_qw"), step.tools[1].X_base_planned.q.w());
  EXPECT_EQ(value("right_local_acceleration_z_m_s2"), step.tools[1].local_acceleration.z());
  EXPECT_EQ(value("left_engaged"), step.tools[0].engaged);
  EXPECT_EQ(value("right_engaged"), step.tools[1].engaged);
  EXPECT_EQ(value("distance_between_arms_m"), 0.125);
  EXPECT_EQ(std::ranges::count(names, ','), std::ranges::count(values, ','));
}

TEST(TwoTools, AreThoseOfTheRobot) {
  std::mt19937 random(3);
  const PlanStep step = random_two_tool_step(random);
  const std::string one = R"({"joints": [{"name": "a", "type": "revolute"}, {"name": "b", "type": "revolute"}, {"name":
"c", "type": "revolute"}], "velocity_max": [1, 2, 3], "acceleration_max": [4, 5, 6]})";
  const auto refused = load_session(
      record_two_tools("other.mcap", two_tools(), one, [&](Recorder& to) { (void)to.write(step); }), parts_of_tools());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("its robot has 1 tool, and its messages others"), std::string::npos)
      << refused.error().message;
  OperatorSample sample;
  sample.tool = 7;
  const auto third = load_session(
      record_two_tools("third.mcap", two_tools(), kTwoToolRobot, [&](Recorder& to) { (void)to.write(sample); }),
      parts_of_tools());
  ASSERT_FALSE(third);
  EXPECT_NE(third.error().message.find("'tool' must be within 0 and 1, not 7"), std::string::npos)
      << third.error().message;
}

}  // namespace
}  // namespace steadyhand

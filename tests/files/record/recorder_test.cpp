#include "steadyhand/files/record/recorder.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "test_data.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

template <typename M>
Json encode(const M& message) {
  JsonBuffer buffer;
  JsonOut<MessageStyle>(buffer).put(message);
  return Json::parse(buffer);
}

/// Empty if `value` matches the schema and has no other members; otherwise where it differs.
std::string differs(const Json& value, const Json& schema, const std::string& where = "") {
  if (schema.is_boolean()) return "";
  const std::string type = schema["type"];
  const bool fits = type == "object"    ? value.is_object()
                    : type == "array"   ? value.is_array()
                    : type == "number"  ? value.is_number()
                    : type == "integer" ? value.is_number_integer()
                    : type == "boolean" ? value.is_boolean()
                                        : type == "string" && value.is_string();
  if (!fits) return where + " is not a " + type;
  if (type == "object" && schema.size() <= 2 && !schema.contains("properties")) return "";  // of any members
  const Json members = type == "object" ? value : Json::object();
  for (const auto& [key, item] : members.items()) {
    const bool named = schema.contains("properties") && schema["properties"].contains(key);
    if (!named && !schema.contains("additionalProperties")) return where + "/" + key + " is not in the schema";
    const Json& expected = named ? schema["properties"][key] : schema["additionalProperties"];
    if (const std::string difference = differs(item, expected, where + "/" + key); !difference.empty())
      return difference;
  }
  if (type == "array") {
    for (const Json& item : value) {
      if (const std::string difference = differs(item, schema["items"], where + "/[]"); !difference.empty())
        return difference;
    }
  }
  return "";
}

Pose some_pose() { return {{0.1, -0.2, 0.3}, Quaternion(0.5, 0.5, -0.5, 0.5)}; }

Plan some_plan() {
  Plan plan;
  plan.stamp = {Time{5}, Time{9}};
  plan.start = from_seconds(1.25);
  plan.joints = 3;
  plan.intervals = 2;
  for (int k = 0; k <= 2; ++k) plan.x[k] = StateVector::Random(6);
  for (int k = 0; k < 2; ++k) plan.u[k] = JointVector::Random(3);
  return plan;
}

TEST(JsonMessages, FitTheirSchemas) {
  std::mt19937 random(1);
  OperatorSample sample;
  Target target;
  sample.X_operator_hand = target.X_base_tool = some_pose();
  Reference reference;
  reference.nodes = 2;
  for (int k = 0; k < 2; ++k)
    for (ToolReference& tool : reference.tools) tool.p[k] = some_pose().p, tool.R[k] = some_pose().q.toRotationMatrix();
  const std::vector<Pose> path = {some_pose(), some_pose(), some_pose()};
  const JointCommand command{{}, JointVector::Random(3), JointVector::Random(3), JointVector::Random(3)};
  const JointState state{{}, JointVector::Random(3), JointVector::Random(3)};

  const auto check = [](const auto& message, const Schema& schema, const std::string& name) {
    const Json parsed = Json::parse(schema.text), json = encode(message);
    EXPECT_EQ(schema.name, name);
    EXPECT_EQ(differs(json, parsed), "") << json.dump(1);
    EXPECT_TRUE(json.contains("timestamp"));
  };
  const Schema pose_schema = schema_of<Message<OperatorSample>, Message<Target>>(),
               poses_schema = schema_of<ReferenceMessage, PlanMessage>();
  check(message_of(sample), pose_schema, "foxglove.PoseInFrame");
  check(message_of(target), pose_schema, "foxglove.PoseInFrame");
  for (const int tools : {1, 2}) check(ReferenceMessage{{&reference}, tools}, poses_schema, "foxglove.PosesInFrame");
  const Plan plan = some_plan();
  check(PlanMessage{{&plan}, {path, {}}}, poses_schema, "foxglove.PosesInFrame");
  check(PlanMessage{{&plan}, {path, path}}, poses_schema, "foxglove.PosesInFrame");
  check(message_of(command), schema_of<Message<JointCommand>>(), "steadyhand.JointCommand");
  check(message_of(state), schema_of<Message<JointState>>(), "steadyhand.JointState");
  const Cell cell{"desk", {{"ball", Shape::sphere(0.1), Eigen::Isometry3d::Identity()}}};
  check(CellLook{Time(7), {cell_json(cell)}}, schema_of<CellLook>(), "steadyhand.Cell");
  for (int i = 0; i < 100; ++i) {
    PlanStep step = test::random_step(random);
    step.tool_count = 1 + i % 2;
    if (i % 2 == 1) step.distance_between_arms_m = 0.5;
    check(StepMessage{step, {{"position", 0.5}}}, schema_of<StepMessage>(), "steadyhand.PlanStep");
  }
  check(StateChange{}, schema_of<StateChange>(), "steadyhand.Supervision");
  check(LiquidMessage{}, schema_of<LiquidMessage>(), "steadyhand.Liquid");
  check(LimitChange{}, schema_of<LimitChange>(), "steadyhand.ActiveConstraint");
  check(message_of(SessionStatistics{}), schema_of<Message<SessionStatistics>>(), "steadyhand.Statistics");
  EpisodeMark mark;
  mark.success = true;
  check(message_of(mark), schema_of<Message<EpisodeMark>>(), "steadyhand.Episode");
  SettingsChange settings;
  settings.weights = {{"position", {1.0}}};
  settings.tilt = settings.fill = settings.latency = 0.1;
  settings.no_spill = true;
  settings.prediction = settings.profile = "x";
  check(message_of(settings), schema_of<Message<SettingsChange>>(), "steadyhand.OperatorSettings");
  SceneLook look;
  look.scene.things = 2;
  look.progress.success = false;
  check(message_of(look), schema_of<Message<SceneLook>>(), "steadyhand.Scene");
  VideoPacket picture;
  picture.data = "abc";
  check(PictureMessage{{&picture}, "front"}, schema_of<PictureMessage>(), "foxglove.CompressedVideo");
  EXPECT_EQ(Json::parse(schema_of<PictureMessage>().text)["properties"]["data"]["contentEncoding"], "base64");
}

TEST(JsonMessages, KeepEveryBitOfANumber) {
  const Plan plan = some_plan();
  const Json message = encode(PlanMessage{{&plan}, {}});
  ASSERT_EQ(message["nodes"].size(), 3u);
  for (int k = 0; k <= 2; ++k) {
    for (int i = 0; i < 3; ++i) {
      EXPECT_EQ(message["nodes"][k]["q"][i].get<double>(), plan.x[k][i]);
      EXPECT_EQ(message["nodes"][k]["dq"][i].get<double>(), plan.x[k][3 + i]);
      if (k < 2) {
        EXPECT_EQ(message["nodes"][k]["ddq"][i].get<double>(), plan.u[k][i]);
      }
    }
  }
  EXPECT_EQ(message["timestamp"]["sec"], 1);
  EXPECT_EQ(message["timestamp"]["nsec"], 250'000'000);
}

TEST(JsonMessages, OrientationIsXyzw) {
  Target target;
  target.X_base_tool = some_pose();
  const Json q = encode(message_of(target))["pose"]["orientation"];
  EXPECT_EQ(q["x"], 0.5);
  EXPECT_EQ(q["y"], -0.5);
  EXPECT_EQ(q["z"], 0.5);
  EXPECT_EQ(q["w"], 0.5);
}

TEST(JsonMessages, NumbersThatAreNotFiniteBecomeNull) {
  JointState state{{}, JointVector::Zero(2), JointVector::Zero(2)};
  state.q << std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity();
  const Json message = encode(message_of(state));
  EXPECT_TRUE(message["q"][0].is_null());
  EXPECT_TRUE(message["q"][1].is_null());
}

/// A controller's own words, say, cut in the middle of a letter: the file could not be read any more.
TEST(JsonMessages, TextThatIsNoUtf8IsStillRead) {
  StateChange change;
  change.reason = "error C4A0 of the controller: gr\xc3\xb6\xc3";
  EXPECT_EQ(encode(change)["reason"], "error C4A0 of the controller: gr\xc3\xb6\xef\xbf\xbd");
  change.reason = "\xff\xfe\x80";
  EXPECT_TRUE(encode(change)["reason"].is_string());
}

TEST(Recorder, RefusesAFolderThatDoesNotExist) {
  const Result<Recorder> recorder = Recorder::create("/nowhere/run.mcap", {});
  ASSERT_FALSE(recorder);
  EXPECT_NE(recorder.error().message.find("/nowhere/run.mcap"), std::string::npos);
}

}  // namespace
}  // namespace steadyhand

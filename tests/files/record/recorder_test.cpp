#include "steadyhand/files/record/recorder.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "steadyhand/files/record/schemas.hpp"
#include "test_data.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

template <typename... Arguments>
Json encode(const Arguments&... arguments) {
  JsonBuffer buffer;
  append_json(buffer, arguments...);
  return Json::parse(buffer.begin(), buffer.end());
}

/// Empty if `value` is what the schema says, and nothing that it does not mention; otherwise where it differs.
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
  for (int k = 0; k < 2; ++k) reference.p[k] = some_pose().p, reference.R[k] = some_pose().q.toRotationMatrix();
  const std::array<Pose, 3> path = {some_pose(), some_pose(), some_pose()};
  const JointCommand command{{}, JointVector::Random(3), JointVector::Random(3), JointVector::Random(3)};
  const JointState state{{}, JointVector::Random(3), JointVector::Random(3)};

  const auto check = [](const Json& message, const Schema& schema) {
    const Json parsed = Json::parse(schema.text);
    EXPECT_EQ(parsed["title"], schema.name);
    EXPECT_EQ(differs(message, parsed), "") << message.dump(1);
    EXPECT_TRUE(message.contains("timestamp"));
  };
  check(encode(sample), operator_sample_schema());
  check(encode(target), target_schema());
  check(encode(reference), reference_schema());
  check(encode(some_plan(), std::span<const Pose>(path)), plan_schema());
  check(encode(command), joint_command_schema());
  check(encode(state), joint_state_schema());
  check(encode(Time(7), Cell{"desk", {{"ball", Shape::sphere(0.1), Eigen::Isometry3d::Identity()}}}), cell_schema());
  for (int i = 0; i < 100; ++i) check(encode(test::random_step(random), test::names()), plan_step_schema());
}

TEST(JsonMessages, KeepEveryBitOfANumber) {
  const Plan plan = some_plan();
  const Json message = encode(plan, std::span<const Pose>());
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
  const Json q = encode(target)["pose"]["orientation"];
  EXPECT_EQ(q["x"], 0.5);
  EXPECT_EQ(q["y"], -0.5);
  EXPECT_EQ(q["z"], 0.5);
  EXPECT_EQ(q["w"], 0.5);
}

TEST(JsonMessages, NumbersThatAreNotFiniteBecomeNull) {
  JointState state{{}, JointVector::Zero(2), JointVector::Zero(2)};
  state.q << std::numeric_limits<double>::quiet_NaN(), -std::numeric_limits<double>::infinity();
  const Json message = encode(state);
  EXPECT_TRUE(message["q"][0].is_null());
  EXPECT_TRUE(message["q"][1].is_null());
}

/// A controller's own words, say, cut in the middle of a letter: the file could not be read any more.
TEST(JsonMessages, TextThatIsNoUtf8IsStillRead) {
  SupervisionChange change;
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

#include "steadyhand/files/record/problem_json.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "geometry/robot/random_arm.hpp"

namespace steadyhand {
namespace {

using Json = nlohmann::json;

std::filesystem::path write(const std::string& text) {
  const auto path = std::filesystem::path(testing::TempDir()) / "problem_json_test.json";
  std::ofstream(path) << text;
  return path;
}

Json good_problem() {
  Json node{{"p", {0.1, 0.2, 0.3}}, {"R", {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
  return {{"robot", "ur5e"},
          {"dt", 0.05},
          {"horizon", 2},
          {"x0", {0.1, 0.2, 0.0, 0.0}},
          {"weights", {{"position", {500, 500, 500}}, {"lateral", 10}}},
          {"reference", {node, node}}};
}

TEST(ProblemJson, RoundTrips) {
  std::mt19937 random(1);
  const RobotModel model = random_arm(6, random);
  const Ocp ocp(model, {});
  OcpInstance instance;
  instance.x0 = StateVector::Random(12);
  instance.weights = *ocp.weights({{"position", {500}}, {"lateral", {0.1}}});
  instance.reference.nodes = 8;
  for (int k = 0; k < 8; ++k) {
    instance.reference.p[k] = Vector3::Random();
    instance.reference.R[k] = Quaternion::UnitRandom().toRotationMatrix();
  }
  Trajectory guess(6, 8);
  for (auto& x : guess.x) x.setRandom();
  for (auto& u : guess.u) u.setRandom();

  const auto path = write("");
  ASSERT_TRUE(write_problems({to_record(ocp, instance, guess, 1e-7), to_record(ocp, instance, guess, 1e-6)}, path));
  const auto file = read_problems(path);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_TRUE(file->is_array);
  ASSERT_EQ(file->problems.size(), 2u);
  const ProblemRecord& read = file->problems[0];
  EXPECT_EQ(read.robot, "random");
  EXPECT_EQ(read.x0, instance.x0);
  EXPECT_EQ(*ocp.weights(read.weights), instance.weights);
  for (int k = 0; k < 8; ++k) {
    EXPECT_EQ(read.reference.p[k], instance.reference.p[k]);
    EXPECT_EQ(read.reference.R[k], instance.reference.R[k]);
  }
  EXPECT_EQ(read.guess->x, guess.x);
  EXPECT_EQ(read.guess->u, guess.u);
  EXPECT_EQ(read.tolerance, 1e-7);
}

TEST(ProblemJson, TheLiquidAndWhatIsFollowedGoAlong) {
  std::mt19937 random(2);
  const RobotModel model = random_arm(6, random);
  OcpSettings settings;
  settings.liquid.emplace().price = 70.0;
  settings.weights["acceleration_step"] = {0.1};
  add_optional_objectives(settings);
  const Ocp ocp(model, settings);
  OcpInstance instance;
  instance.x0 = StateVector::Random(12);
  instance.u_followed = JointVector::Random(6);
  instance.clearance = 3e-3;
  instance.weights = *ocp.weights(settings.weights);
  instance.reference.nodes = 8;
  for (int k = 0; k < 8; ++k) {
    instance.reference.p[k] = Vector3::Random();
    instance.reference.R[k].setIdentity();
  }
  GlassSettings glass = settings.liquid->glass;
  glass.fill = 0.07;
  glass.frequency_factor = 0.9;
  instance.liquid = {SloshModel(glass, ocp.dt(), settings.liquid->frequencies), glass, false, 0.0123,
                     SloshState::Random()};
  const auto path = write("");
  ASSERT_TRUE(write_problems({to_record(ocp, instance, Trajectory(6, 8), 1e-6)}, path));
  const auto file = read_problems(path);
  ASSERT_TRUE(file) << file.error().message;
  const ProblemRecord& read = file->problems[0];
  EXPECT_EQ(read.u_followed, instance.u_followed);
  EXPECT_EQ(read.clearance, instance.clearance);
  ASSERT_TRUE(read.liquid);
  LiquidSettings expected = *settings.liquid;
  expected.glass = glass;
  EXPECT_EQ(read.liquid->settings, expected);
  EXPECT_FALSE(read.liquid->counts);
  EXPECT_EQ(read.liquid->room, 0.0123);
  EXPECT_EQ(read.liquid->state, instance.liquid.state);

  Json json = Json::parse(std::ifstream(path))[0];
  const auto message = [&](const std::string& key, const Json& value) {
    Json spoilt = json;
    value.is_null() ? void(spoilt["liquid"].erase(key)) : void(spoilt["liquid"][key] = value);
    const auto result = parse_problems(spoilt.dump(), "");
    return result ? "" : result.error().message;
  };
  EXPECT_EQ(message("fill", 0.06), "");
  EXPECT_EQ(message("fill", nullptr), "problem: 'liquid.fill' is missing");
  EXPECT_EQ(message("fill", "full"), "problem: 'liquid.fill' must be a number, not \"full\"");
  EXPECT_EQ(message("counts", 1), "problem: 'liquid.counts' must be true or false, not 1");
  EXPECT_EQ(
      message("colour", 1),
      "problem: 'liquid.colour' is unknown; there are "
      "radius, height, fill, viscosity, frequency_factor, price, least_weight, lean, room, frequencies, counts, state");
  EXPECT_EQ(message("state", {1.0, 2.0}), "problem: 'liquid.state' must be a list of 15 numbers, not [1.0,2.0]");
  json["u_followed"] = {1.0};
  EXPECT_EQ(message("fill", 0.06), "problem: 'u_followed' has 1 entries; it must have 6");
}

TEST(ProblemJson, OneProblemNeedsNoGuess) {
  const auto file = read_problems(write(good_problem().dump()));
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_FALSE(file->is_array);
  EXPECT_FALSE(file->problems[0].guess);
  EXPECT_EQ(file->problems[0].tolerance, 1e-6);
}

TEST(ProblemJson, BadInputIsNamed) {
  const auto spoilt = [](const auto& spoil) {
    Json json = good_problem();
    spoil(json);
    return json.dump();
  };
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "is no JSON"},
      {R"({"robot": "ur5e", )", "is no JSON"},
      {"3", "problem: it must be an object, not 3"},
      {spoilt([](Json& j) { j.erase("x0"); }), "problem: 'x0' is missing"},
      {spoilt([](Json& j) { j["speed"] = 1; }), "problem: 'speed' is unknown; there are robot, dt, "},
      {spoilt([](Json& j) { j["dt"] = 0; }), "problem: 'dt' must be above 0, not 0"},
      {spoilt([](Json& j) { j["dt"] = "fast"; }), "problem: 'dt' must be a number, not \"fast\""},
      {spoilt([](Json& j) { j["horizon"] = 2.5; }), "problem: 'horizon' must be a whole number, not 2.5"},
      {spoilt([](Json& j) { j["horizon"] = 4000; }), "problem: 'horizon' must be within 1 and 128, not 4000"},
      {spoilt([](Json& j) { j["horizon"] = 3; }), "problem: 'reference' has 2 entries; it must have 3"},
      {spoilt([](Json& j) { j["x0"] = {1, 2, 3}; }), "problem: 'x0' has 3 entries; it must have 2n"},
      {spoilt([](Json& j) { j["x0"][1] = nullptr; }), "problem: 'x0' must be a number, not null"},
      {spoilt([](Json& j) { j["reference"][1]["R"][0][0] = 2; }), "problem: 'reference[1]': 'R' is no rotation matrix"},
      {spoilt([](Json& j) { j["reference"][0].erase("p"); }), "problem: 'reference[0].p' is missing"},
      {spoilt([](Json& j) { j["guess"] = {{"x", Json::array()}, {"u", Json::array()}}; }),
       "problem: 'guess' must have 3 'x' of 4 entries and 2 'u' of 2"},
      {spoilt([](Json& j) { j["tolerance"] = -1; }), "problem: 'tolerance' must be above 0, not -1"},
      {R"([{"robot": 5}])", "problem[0]: 'robot' must be text, not 5"},
  };
  for (const auto& [text, expected] : cases) {
    const auto file = read_problems(write(text));
    ASSERT_FALSE(file) << text;
    EXPECT_NE(file.error().message.find(expected), std::string::npos)
        << file.error().message << "\n wanted " << expected;
  }
  EXPECT_FALSE(read_problems("/nowhere/problem.json"));
}

}  // namespace
}  // namespace steadyhand

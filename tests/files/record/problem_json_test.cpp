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
    instance.reference.tools[0].p[k] = Vector3::Random();
    instance.reference.tools[0].R[k] = Quaternion::UnitRandom().toRotationMatrix();
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
    EXPECT_EQ(read.reference.tools[0].p[k], instance.reference.tools[0].p[k]);
    EXPECT_EQ(read.reference.tools[0].R[k], instance.reference.tools[0].R[k]);
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
    instance.reference.tools[0].p[k] = Vector3::Random();
    instance.reference.tools[0].R[k].setIdentity();
  }
  GlassSettings glass = settings.liquid->glass;
  glass.fill = 0.07;
  glass.frequency_factor = 0.9;
  instance.liquid[0] = {SloshModel(glass, ocp.dt(), settings.liquid->frequencies), glass, false, 0.0123,
                        SloshState::Random()};
  const auto path = write("");
  ASSERT_TRUE(write_problems({to_record(ocp, instance, Trajectory(6, 8), 1e-6)}, path));
  const auto file = read_problems(path);
  ASSERT_TRUE(file) << file.error().message;
  const ProblemRecord& read = file->problems[0];
  EXPECT_EQ(read.u_followed, instance.u_followed);
  EXPECT_EQ(read.clearance, instance.clearance);
  ASSERT_EQ(read.liquid.size(), 1u);
  LiquidSettings expected = *settings.liquid;
  expected.glass = glass;
  EXPECT_EQ(read.liquid[0].settings, expected);
  EXPECT_FALSE(read.liquid[0].counts);
  EXPECT_EQ(read.liquid[0].room, 0.0123);
  EXPECT_EQ(read.liquid[0].state, instance.liquid[0].state);

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

TEST(ProblemJson, GivenJointsAreIndices) {
  Json json = good_problem();
  const auto message = [&](const Json& given) {
    json["given"] = given;
    const auto result = parse_problems(json.dump(), "");
    return result ? result->problems[0].given.to_string().substr(kMaxJoints - 2) : result.error().message;
  };
  EXPECT_EQ(message(Json::array()), "00");
  EXPECT_EQ(message({1}), "10");
  EXPECT_EQ(message({1, 0}), "11");
  EXPECT_EQ(message({1, 1}), "problem: 'given' has joint 1 twice");
  EXPECT_EQ(message({2}), "problem: 'given[0]' must be within 0 and 1, not 2");
  EXPECT_EQ(message({-1}), "problem: 'given[0]' must be within 0 and 1, not -1");
  EXPECT_EQ(message({0.5}), "problem: 'given[0]' must be a whole number, not 0.5");
  EXPECT_EQ(message("all"), "problem: 'given' must be a list of entries, not \"all\"");

  json["given"] = {1};
  const auto path = write("");
  ASSERT_TRUE(write_problems(parse_problems(json.dump(), "")->problems, path));
  EXPECT_EQ(Json::parse(std::ifstream(path))[0]["given"], Json({1}));
}

TEST(ProblemJson, EachOfTwoToolsHasItsPart) {
  std::mt19937 random(3);
  const RobotModel model = random_tree(1, 3, 4, random);
  OcpSettings settings;
  settings.horizon = 2;
  settings.liquid.emplace();
  settings.weights["relative_pose"] = {2.0, 3.0};
  add_optional_objectives(settings);
  const Ocp ocp(model, settings);
  OcpInstance instance;
  instance.x0 = StateVector::Random(16);
  instance.weights = *ocp.weights(settings.weights);
  instance.reference.nodes = 2;
  instance.held = {Vector3::Random(), random_rotation(random)};
  for (int t = 0; t < 2; ++t) {
    for (int k = 0; k < 2; ++k) {
      instance.reference.tools[t].p[k] = Vector3::Random();
      instance.reference.tools[t].R[k] = random_rotation(random);
    }
    GlassSettings glass = settings.liquid->glass;
    glass.fill -= 0.01 * t;
    instance.liquid[t] = {SloshModel(glass, ocp.dt(), settings.liquid->frequencies), glass, t == 0, 0.01,
                          SloshState::Random()};
  }
  const auto path = write("");
  ASSERT_TRUE(write_problems({to_record(ocp, instance, Trajectory(8, 2), 1e-6)}, path));
  const auto file = read_problems(path);
  ASSERT_TRUE(file) << file.error().message;
  const ProblemRecord& read = file->problems[0];
  ASSERT_EQ(read.tools, 2);
  ASSERT_TRUE(read.held);
  EXPECT_EQ(read.held->p, instance.held.p);
  ASSERT_EQ(read.liquid.size(), 2u);
  for (int t = 0; t < 2; ++t) {
    EXPECT_EQ(read.reference.tools[t].p[1], instance.reference.tools[t].p[1]);
    EXPECT_TRUE(read.reference.tools[t].R[1].isApprox(instance.reference.tools[t].R[1], 1e-12));
    EXPECT_EQ(read.liquid[t].settings.glass, instance.liquid[t].glass);
    EXPECT_EQ(read.liquid[t].counts, t == 0);
    EXPECT_EQ(read.liquid[t].state, instance.liquid[t].state);
  }

  const Json json = Json::parse(std::ifstream(path))[0];
  const auto message = [&](const auto& change) {
    Json spoilt = json;
    change(spoilt);
    const auto result = parse_problems(spoilt.dump(), "");
    return result ? "" : result.error().message;
  };
  EXPECT_EQ(message([](Json& j) { j["tools"].erase(1); }), "problem: 'tools' has 1 entries; it must have 2");
  EXPECT_EQ(message([](Json& j) { j["tools"][1]["reference"].erase(0); }),
            "problem: 'tools[1].reference' has 1 entries; it must have 2");
  EXPECT_EQ(message([](Json& j) { j["tools"][1].erase("liquid"); }),
            "problem: 'tools[1].liquid' must be there for each tool, or for none");
  EXPECT_EQ(message([](Json& j) { j["tools"][1]["liquid"]["price"] = 1.0; }),
            "problem: 'tools[1].liquid' must have price, least_weight, lean and frequencies of the first tool's");
  EXPECT_EQ(message([](Json& j) { j["reference"] = j["tools"][0]["reference"]; }),
            "problem: 'reference' and 'liquid' belong into 'tools' where there are several");
  EXPECT_EQ(message([](Json& j) { j.erase("tools"); }), "problem: 'reference' is missing");
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
